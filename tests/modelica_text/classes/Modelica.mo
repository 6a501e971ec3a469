// Ideal classes under the names that written drives use, so that another compiler can run them.
package Modelica
  package Mechanics
    package Rotational
      package Interfaces
        connector Flange_a
          Real phi;
          flow Real tau;
        end Flange_a;
        connector Flange_b
          Real phi;
          flow Real tau;
        end Flange_b;
        partial model Compliant
          Flange_a flange_a;
          Flange_b flange_b;
          Real phi_rel;
          Real w_rel;
          Real tau;
        equation
          phi_rel = flange_b.phi - flange_a.phi;
          w_rel = der(phi_rel);
          flange_b.tau = tau;
          flange_a.tau = -tau;
        end Compliant;
      end Interfaces;
      package Components
        model Fixed
          parameter Real phi0 = 0;
          Interfaces.Flange_b flange;
        equation
          flange.phi = phi0;
        end Fixed;
        model Inertia
          parameter Real J;
          Interfaces.Flange_a flange_a;
          Interfaces.Flange_b flange_b;
          Real phi;
          Real w;
          Real a;
        equation
          phi = flange_a.phi;
          phi = flange_b.phi;
          w = der(phi);
          a = der(w);
          J * a = flange_a.tau + flange_b.tau;
        end Inertia;
        model Spring
          extends Interfaces.Compliant;
          parameter Real c;
          parameter Real phi_rel0 = 0;
        equation
          tau = c * (phi_rel - phi_rel0);
        end Spring;
        model Damper
          extends Interfaces.Compliant;
          parameter Real d;
        equation
          tau = d * w_rel;
        end Damper;
        model SpringDamper
          extends Interfaces.Compliant;
          parameter Real c;
          parameter Real d;
          parameter Real phi_rel0 = 0;
        equation
          tau = c * (phi_rel - phi_rel0) + d * w_rel;
        end SpringDamper;
        model IdealGear
          parameter Real ratio;
          Interfaces.Flange_a flange_a;
          Interfaces.Flange_b flange_b;
        equation
          flange_a.phi = ratio * flange_b.phi;
          0 = ratio * flange_a.tau + flange_b.tau;
        end IdealGear;
      end Components;
      package Sources
        model Torque
          input Real tau;
          Interfaces.Flange_b flange;
        equation
          flange.tau = -tau;
        end Torque;
        model ConstantTorque
          parameter Real tau_constant;
          Interfaces.Flange_b flange;
        equation
          flange.tau = -tau_constant;
        end ConstantTorque;
        model QuadraticSpeedDependentTorque
          parameter Real tau_nominal;
          parameter Boolean TorqueDirection = true;
          parameter Real w_nominal;
          Interfaces.Flange_b flange;
          Real w;
        equation
          w = der(flange.phi);
          flange.tau = -tau_nominal * noEvent(if TorqueDirection or w >= 0 then 1 else -1) * (w / w_nominal)^2;
        end QuadraticSpeedDependentTorque;
      end Sources;
    end Rotational;
    package Translational
      package Interfaces
        connector Flange_a
          Real s;
          flow Real f;
        end Flange_a;
        connector Flange_b
          Real s;
          flow Real f;
        end Flange_b;
      end Interfaces;
      package Components
        model Fixed
          parameter Real s0 = 0;
          Interfaces.Flange_b flange;
        equation
          flange.s = s0;
        end Fixed;
        model Mass
          parameter Real m;
          parameter Real L = 0;
          Interfaces.Flange_a flange_a;
          Interfaces.Flange_b flange_b;
          Real s;
          Real v;
          Real a;
        equation
          flange_a.s = s - L / 2;
          flange_b.s = s + L / 2;
          v = der(s);
          a = der(v);
          m * a = flange_a.f + flange_b.f;
        end Mass;
        model Spring
          parameter Real c;
          parameter Real s_rel0 = 0;
          Interfaces.Flange_a flange_a;
          Interfaces.Flange_b flange_b;
          Real s_rel;
          Real f;
        equation
          s_rel = flange_b.s - flange_a.s;
          f = c * (s_rel - s_rel0);
          flange_b.f = f;
          flange_a.f = -f;
        end Spring;
      end Components;
    end Translational;
  end Mechanics;
  package Electrical
    package Analog
      package Interfaces
        connector Pin
          Real v;
          flow Real i;
        end Pin;
        partial model OnePort
          Pin p;
          Pin n;
          Real v;
          Real i;
        equation
          v = p.v - n.v;
          0 = p.i + n.i;
          i = p.i;
        end OnePort;
      end Interfaces;
      package Basic
        model Ground
          Interfaces.Pin p;
        equation
          p.v = 0;
        end Ground;
        model Resistor
          extends Interfaces.OnePort;
          parameter Real R;
          parameter Real T_ref = 300.15;
          parameter Real alpha = 0;
          parameter Real T = T_ref;
        equation
          v = R * (1 + alpha * (T - T_ref)) * i;
        end Resistor;
        model Inductor
          extends Interfaces.OnePort;
          parameter Real L;
        equation
          L * der(i) = v;
        end Inductor;
        model RotationalEMF
          extends Interfaces.OnePort;
          parameter Real k;
          Modelica.Mechanics.Rotational.Interfaces.Flange_b flange;
          Real w;
        equation
          w = der(flange.phi);
          v = k * w;
          flange.tau = -k * i;
        end RotationalEMF;
        model TranslationalEMF
          extends Interfaces.OnePort;
          parameter Real k;
          Modelica.Mechanics.Translational.Interfaces.Flange_b flange;
          Real vel;
        equation
          vel = der(flange.s);
          v = k * vel;
          flange.f = -k * i;
        end TranslationalEMF;
      end Basic;
      package Sources
        model ConstantVoltage
          extends Interfaces.OnePort;
          parameter Real V;
        equation
          v = V;
        end ConstantVoltage;
        model ConstantCurrent
          extends Interfaces.OnePort;
          parameter Real I;
        equation
          i = I;
        end ConstantCurrent;
      end Sources;
    end Analog;
  end Electrical;
end Modelica;
