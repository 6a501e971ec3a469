/* Start-up of a machine tool drive with a multi-plate clutch. See README.md. */
#include "rk4.h"

#define V(name) (m->v[name])

enum { STUCK = 1, FORWARD = 4, BACKWARD = 5, WAITING = 0, RUNNING_COIL = 1 };
/* memory: twists of the three shafts, speeds of the four masses; then the beginning of the run */
enum { TWIST0, TWIST1, TWIST2, W1, W2, W3, W4, START };
enum { COUNT = 7 };

static const double STEP = 1e-5, SWITCHED_ON = 0.07, TIME_CONSTANT = 0.07;

static double normal_force(const Model *m, double t) {
    double since = t - m->memory[START] - SWITCHED_ON;
    if (since <= 0) return 0;
    return V(clutch_fn_max) * pow(1 - exp(-since / TIME_CONSTANT), 2);
}

static double sliding_coefficient(double slip) {
    double below = 12.57 - slip;
    return below > 0 ? 3.023e-5 * below * below * below + 0.04 : -1.55e-4 * below + 0.04;
}

static double load_torque(double w) { return 9 + 0.1 * pow(fmax(w, 0), 2.0 / 3); }

static double torque0(const Model *m, const double y[]) { return V(k0) * y[TWIST0]; }
static double torque1(const Model *m, const double y[]) { return V(k1) * y[TWIST1] + V(h1) * (y[W1] - y[W2]); }
static double torque2(const Model *m, const double y[]) { return V(k2) * y[TWIST2] + V(h2) * (y[W3] - y[W4]); }

static double clutch_torque(const Model *m, double t, const double y[]) {
    double T1 = torque1(m, y), T2 = torque2(m, y);
    if (V(clutch_mode) == STUCK) return T1 - V(J2_J) * (T1 - T2) / (V(J2_J) + V(J3_J));
    return normal_force(m, t) * V(clutch_cgeo) * sliding_coefficient(y[W2] - y[W3]) + V(drag);
}

static void rates(const Model *m, double t, const double y[], double rate[]) {
    double T0 = torque0(m, y), T1 = torque1(m, y), T2 = torque2(m, y), M = clutch_torque(m, t, y);
    rate[TWIST0] = V(motor_w_fixed) - T0 / V(h0) - y[W1];
    rate[TWIST1] = y[W1] - y[W2];
    rate[TWIST2] = y[W3] - y[W4];
    rate[W1] = (T0 - T1) / V(J1_J);
    rate[W2] = (T1 - M) / V(J2_J);
    rate[W3] = (M - T2) / V(J3_J);
    rate[W4] = V(load_mode) == STUCK ? 0 : (T2 - load_torque(y[W4])) / V(J4_J);
}

static int breaks_away(const Model *m, const double y[]) {
    return V(load_mode) == STUCK && torque2(m, y) >= load_torque(0);
}

static int locks(const Model *m, const double y[]) { return V(clutch_mode) == BACKWARD && y[W3] >= y[W2]; }

static int slips(const Model *m, double t, const double y[]) {
    double grip = normal_force(m, t) * V(clutch_cgeo) * V(clutch_mu_static) + V(drag);
    return V(clutch_mode) == STUCK && clutch_torque(m, t, y) >= grip;
}

static int switches_on(const Model *m, double t) {
    return V(coil_stage) == WAITING && t >= m->memory[START] + SWITCHED_ON;
}

static int over(const Model *m, double t, const double y[]) {
    return switches_on(m, t) || breaks_away(m, y) || locks(m, y) || slips(m, t, y);
}

static void switch_mode(Model *m) {
    double *y = m->memory;
    if (switches_on(m, m->time)) V(coil_stage) = RUNNING_COIL;
    if (breaks_away(m, y)) V(load_mode) = FORWARD;
    if (slips(m, m->time, y)) {
        V(clutch_mode) = BACKWARD;
    } else if (locks(m, y)) {
        V(clutch_mode) = STUCK;
    }
}

static void outputs(Model *m) {
    const double *y = m->memory;
    V(J1_w) = y[W1];
    V(J2_w) = y[W2];
    V(J3_w) = y[W3];
    V(J4_w) = y[W4];
    V(shaft0_tau) = -torque0(m, y);
    V(shaft1_tau) = -torque1(m, y);
    V(shaft2_tau) = -torque2(m, y);
    V(clutch_tau) = -clutch_torque(m, m->time, y);
    V(clutch_w_rel) = y[W3] - y[W2];
    V(clutch_f_normalized) = normal_force(m, m->time) / V(clutch_fn_max);
    V(load_tau) = V(load_mode) == STUCK ? torque2(m, y) : load_torque(y[W4]);
}

/* The motor idles against the drag of the open clutch, the machine stands still. */
void model_start(Model *m) {
    double *y = m->memory;
    y[START] = m->time;
    y[TWIST0] = V(drag) / V(k0);
    y[TWIST1] = V(drag) / V(k1);
    y[TWIST2] = V(drag) / V(k2);
    y[W1] = y[W2] = V(motor_w_fixed) - V(drag) / V(h0);
    y[W3] = y[W4] = 0;
    V(coil_stage) = WAITING;
    V(clutch_mode) = BACKWARD;
    V(load_mode) = STUCK;
    outputs(m);
}

static void after_step(Model *m, int event) {
    if (event) switch_mode(m);
    if (V(clutch_mode) == STUCK) m->memory[W3] = m->memory[W2];
}

void model_advance(Model *m, double end) {
    rk4_advance(m, rates, over, after_step, COUNT, m->memory, end, STEP);
    outputs(m);
}
