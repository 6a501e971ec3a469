/* Machine table: constant acceleration until the clutch locks, then constant speed. See README.md. */
#include <math.h>

#include "function_of_time.h"

#define V(name) (m->v[name])

enum { STUCK = 1, BACKWARD = 5 };

static void evaluate(Model *m) {
    double w = V(motor_w_fixed), ratio = V(gear_ratio), pitch = V(screw_lead) / (2 * M_PI);
    double spindle_side = V(gear_output_J) + V(spindle_J) + V(table_m) * pitch * pitch;
    double referred = V(hub_J) + V(gear_input_J) + spindle_side / (ratio * ratio);
    double load = -V(load_tau_constant) / ratio;
    double acceleration = (V(clutch_capacity) - load) / referred, locks = w / acceleration;
    double t = since_start(m), sliding = fmin(t, locks);
    int stuck = t >= locks;
    double speed = stuck ? w : acceleration * t;
    double angle = acceleration * sliding * sliding / 2 + w * (t - sliding);
    V(motor_w) = w;
    V(hub_w) = speed;
    V(spindle_w) = speed / ratio;
    V(table_v) = pitch * speed / ratio;
    V(table_s) = pitch * angle / ratio;
    V(clutch_tau) = -(stuck ? load : V(clutch_capacity));
    V(clutch_w_rel) = stuck ? 0 : speed - w;
    V(clutch_phi_rel) = angle - w * t;
    V(clutch_loss_power) = V(clutch_tau) * V(clutch_w_rel);
    V(clutch_mode) = stuck ? STUCK : BACKWARD;
}
