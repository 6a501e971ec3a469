/* Two-mass oscillator: the exact solution under a constant torque. See README.md. */
#include <math.h>

#include "model.h"

#define V(name) (m->v[name])

void model_evaluate(Model *m) {
    double x = V(shaft_phi_rel), u = V(shaft_w_rel);
    double torque = V(shaft_c) * x + V(shaft_d) * u;
    double a1 = (V(motor_tau) + torque) / V(J1_J), a2 = -torque / V(J2_J);
    V(J2_phi) = V(J1_phi) + x;
    V(J2_w) = V(J1_w) + u;
    V(shaft_tau) = torque;
    V(der_J1_phi) = V(J1_w);
    V(der_J1_w) = a1;
    V(der_shaft_phi_rel) = u;
    V(der_shaft_w_rel) = a2 - a1;
}

void model_start(Model *m) { model_evaluate(m); }

int model_update(Model *m) {
    (void)m;
    return 0;
}

void model_advance(Model *m, double end) {
    double h = end - m->time, J1 = V(J1_J), J2 = V(J2_J), J = J1 + J2, M = V(motor_tau);
    double reduced = J1 * J2 / J, decay = V(shaft_d) / (2 * reduced), omega0 = sqrt(V(shaft_c) / reduced);
    double omega = sqrt(omega0 * omega0 - decay * decay);
    double rest = -M * J2 / (J * V(shaft_c)); /* twist around which the shaft swings */
    double x = V(shaft_phi_rel) - rest, u = V(shaft_w_rel);
    double e = exp(-decay * h), c = cos(omega * h), s = sin(omega * h);
    double x1 = e * (x * c + (u + decay * x) / omega * s);
    double u1 = e * (u * c - (omega0 * omega0 * x + decay * u) / omega * s);
    /* The centre of mass, phi1 + J2/J*twist, moves with constant acceleration M/J. */
    double phi = V(J1_phi) + J2 / J * (x + rest), w = V(J1_w) + J2 / J * u;
    V(shaft_phi_rel) = x1 + rest;
    V(shaft_w_rel) = u1;
    V(J1_phi) = phi + w * h + M / J * h * h / 2 - J2 / J * V(shaft_phi_rel);
    V(J1_w) = w + M / J * h - J2 / J * u1;
    m->time = end;
    model_evaluate(m);
}
