/* Bench of two DC machines: two equations of motion until the clutch locks, then one. See README.md. */
#include "rk4.h"

#define V(name) (m->v[name])

enum { FREE = 0, STUCK = 1, FORWARD = 4, BACKWARD = 5 };
enum { START, W1, W2, PHI2 }; /* memory: begin of the run, speeds of both sides of the clutch, angle of the flywheel */
enum { COUNT = 3 };

static const double STEP = 1e-4;

static double actuated(const Model *m, double t) {
    double since = t - m->memory[START] - V(coil_t11);
    return since <= 0 ? 0 : V(capacity) * (1 - pow(10, -since / V(coil_t12)));
}

static double motor_current(const Model *m, double w1) { return (V(supply) - V(k) * V(ratio) * w1) / V(R); }

static double motor_torque(const Model *m, double w1) { return V(ratio) * (V(k) * motor_current(m, w1) - V(friction)); }

static double driving_inertia(const Model *m) { return V(pulley) + V(ratio) * V(ratio) * V(rotor); }
static double driven_inertia(const Model *m) { return V(pulley) + V(disc) + V(ratio) * V(ratio) * V(rotor); }
static double bearing(const Model *m) { return V(ratio) * V(friction); }

static double clutch_torque(const Model *m, double t, double w1) {
    double J1 = driving_inertia(m), J2 = driven_inertia(m);
    if (V(clutch_mode) != STUCK) return actuated(m, t);
    return bearing(m) + J2 * (motor_torque(m, w1) - bearing(m)) / (J1 + J2);
}

static void rates(const Model *m, double t, const double y[], double rate[]) {
    double torque = clutch_torque(m, t, y[0]);
    int turns = V(generator_bearing_mode) == FORWARD;
    rate[0] = (motor_torque(m, y[0]) - torque) / driving_inertia(m);
    rate[1] = turns ? (torque - bearing(m)) / driven_inertia(m) : 0;
    rate[2] = y[1];
}

static int over(const Model *m, double t, const double y[]) {
    if (V(clutch_mode) == FREE) return t >= m->memory[START] + V(coil_t11);
    if (V(clutch_mode) == STUCK) return 0;
    if (V(generator_bearing_mode) == STUCK) return actuated(m, t) >= bearing(m);
    return y[1] >= y[0];
}

static void switch_mode(Model *m) {
    if (V(clutch_mode) == FREE) {
        V(clutch_mode) = BACKWARD;
    } else if (V(generator_bearing_mode) == STUCK) {
        V(generator_bearing_mode) = FORWARD;
    } else {
        V(clutch_mode) = STUCK;
    }
}

static void outputs(Model *m) {
    double w1 = m->memory[W1], w2 = m->memory[W2];
    V(motor_w) = V(ratio) * w1;
    V(motor_ia) = motor_current(m, w1);
    V(clutch_pulley_w) = w1;
    V(clutch_tau) = -clutch_torque(m, m->time, w1);
    V(clutch_w_rel) = w2 - w1;
    V(flywheel_w) = w2;
    V(flywheel_phi) = m->memory[PHI2];
    V(generator_w) = V(ratio) * w2;
    V(generator_v) = V(k) * V(ratio) * w2;
}

/* The motor idles, the driven side stands still. */
void model_start(Model *m) {
    m->memory[START] = m->time;
    m->memory[W1] = (V(supply) - V(R) * V(friction) / V(k)) / V(k) / V(ratio);
    m->memory[W2] = m->memory[PHI2] = 0;
    V(clutch_mode) = FREE;
    V(generator_bearing_mode) = STUCK;
    outputs(m);
}

static void after_step(Model *m, int event) {
    if (event) switch_mode(m);
    if (V(clutch_mode) == STUCK) m->memory[W2] = m->memory[W1];
}

void model_advance(Model *m, double end) {
    rk4_advance(m, rates, over, after_step, COUNT, m->memory + W1, end, STEP);
    outputs(m);
}
