/* Ravigneaux set, small sun driven, large sun braked: the carrier speed decays exponentially until the large sun
 * stands. See README.md. */
#include <math.h>

#include "function_of_time.h"

#define V(name) (m->v[name])

enum { STUCK = 1, FORWARD = 4 };

static void evaluate(Model *m) {
    double w = V(motor_w_fixed), i = V(planets_small_ratio), e = V(planets_large_ratio);
    /* w_ring = a*w + (1 - a)*w_carrier, w_large = b*w + (1 - b)*w_carrier */
    double a = 1 / i, b = e / i, viscous = -V(load_tau_nominal) / V(load_w_nominal), brake = V(brake_large_capacity);
    double inertia = V(carrier_J) + (1 - a) * (1 - a) * V(machine_J) + (1 - b) * (1 - b) * V(large_sun_J);
    /* inertia*dw/dt = -damping*(w_carrier - limit) */
    double damping = (1 - a) * (1 - a) * viscous;
    double limit = -((1 - a) * viscous * a * w + (1 - b) * brake) / damping;
    double stands = -b * w / (1 - b); /* carrier speed at which the large sun stands still */
    double locks = inertia / damping * log((w - limit) / (stands - limit));
    double t = since_start(m);
    int stuck = t >= locks;
    double carrier = stuck ? stands : limit + (w - limit) * exp(-damping * t / inertia);
    double rate = stuck ? 0 : -damping * (carrier - limit) / inertia;
    double ring = a * w + (1 - a) * carrier, large = stuck ? 0 : b * w + (1 - b) * carrier;
    double load = viscous * ring; /* against the rotation */
    if (stuck) brake = -(1 - a) * load / (1 - b);
    double at_large = -brake - V(large_sun_J) * (1 - b) * rate, at_ring = -load - V(machine_J) * (1 - a) * rate;
    double at_carrier = -V(carrier_J) * rate, at_small = -(at_large + at_ring + at_carrier);
    V(small_sun_w) = w;
    V(large_sun_w) = large;
    V(carrier_w) = carrier;
    V(machine_w) = ring;
    V(clutch_small_tau) = -at_small; /* the small sun does not accelerate */
    V(brake_large_tau) = brake;
    V(planets_small_sun_tau) = at_small;
    V(planets_large_sun_tau) = at_large;
    V(planets_carrier_tau) = at_carrier;
    V(planets_ring_tau) = at_ring;
    V(planets_small_rolling_power) = at_small * (w - carrier);
    V(planets_large_rolling_power) = at_large * (large - carrier);
    V(brake_large_mode) = stuck ? STUCK : FORWARD;
}
