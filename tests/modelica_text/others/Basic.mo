package Basic
  package SpringAndDamper
    package Types
      type Mode_R = enumeration(LL "linear, linear", NL "nonlinear, linear");
    end Types;
    package Rotational
      model Linear
        extends Modelica.Mechanics.Rotational.Interfaces.PartialCompliantWithRelativeStates;
        parameter Modelica.SIunits.RotationalSpringConstant c_LL;
        parameter Modelica.SIunits.RotationalDampingConstant d_LL;
      equation
        tau = c_LL*phi_rel + d_LL*w_rel;
      end Linear;
      model Table
        extends Modelica.Mechanics.Rotational.Interfaces.PartialCompliantWithRelativeStates;
        parameter Boolean tableOnFile = false;
        parameter Real table[:, 2] = [0, 1];
        parameter String tableName = "NoName", fileName = "NoName";
        parameter Modelica.SIunits.RotationalDampingConstant d_NL;
        Modelica.Blocks.Tables.CombiTable1Ds law(final tableOnFile = tableOnFile, final table = table, final tableName = tableName, final fileName = fileName, extrapolation = Modelica.Blocks.Types.Extrapolation.LastTwoPoints);
      equation
        law.u = phi_rel;
        tau = law.y[1] + d_NL*w_rel;
      end Table;
    end Rotational;
    model Rotational_SpringDamper
      parameter SpringAndDamper.Types.Mode_R mode_select = SpringAndDamper.Types.Mode_R.LL;
      parameter Modelica.SIunits.RotationalSpringConstant c = 1 annotation(Dialog(enable = mode == 1));
      parameter Modelica.SIunits.RotationalDampingConstant d = 1;
      parameter Boolean tableOnFile_spring = false;
      parameter Real table_spring[:, 2] = [0, 1];
      parameter String tableName_spring = "NoName";
      parameter String fileName_spring = "NoName";
      Rotational.Linear mode_1(c_LL = c, d_LL = d) if mode == 1;
      Rotational.Table mode_2(tableOnFile = tableOnFile_spring, table = table_spring, tableName = tableName_spring, fileName = fileName_spring, d_NL = d) if mode == 2;
      Modelica.Mechanics.Rotational.Interfaces.Flange_a flange_a;
      Modelica.Mechanics.Rotational.Interfaces.Flange_b flange_b;
    protected
      parameter Integer mode = if mode_select == SpringAndDamper.Types.Mode_R.LL then 1 elseif mode_select == SpringAndDamper.Types.Mode_R.NL then 2 else 3;
    equation
      connect(flange_a, mode_2.flange_a);
      connect(flange_a, mode_1.flange_a);
      connect(flange_b, mode_1.flange_b);
      connect(flange_b, mode_2.flange_b);
    end Rotational_SpringDamper;
  end SpringAndDamper;
  model Test
    Modelica.Mechanics.Rotational.Components.Inertia J(J = 2, phi(start = 0.1, fixed = true), w(fixed = true));
    Modelica.Mechanics.Rotational.Components.Fixed wall;
    SpringAndDamper.Rotational_SpringDamper s(c = 8, d = 0);
  equation
    connect(wall.flange, s.flange_a); connect(s.flange_b, J.flange_a);
  end Test;
  model Other
    extends Test(s(mode_select = SpringAndDamper.Types.Mode_R.NL, table_spring = {{-1, -18}, {0, 0}, {1, 18}}));
  end Other;
end Basic;
