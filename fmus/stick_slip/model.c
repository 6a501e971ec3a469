/* Mass on a moving belt: sticking is uniform motion, sliding a harmonic oscillation; both in closed form. See
 * README.md. */
#include <math.h>

#include "model.h"

#define V(name) (m->v[name])

enum { STUCK = 1, FORWARD = 4, BACKWARD = 5 };

static int mode(const Model *m) { return (int)V(friction_mode); }
static double direction(const Model *m) { return mode(m) == FORWARD ? 1 : -1; }

void model_evaluate(Model *m) {
    double spring = -V(spring_c) * V(mass_s), sliding = V(friction_f_scale);
    int stuck = mode(m) == STUCK;
    V(friction_f) = stuck ? spring : direction(m) * sliding;
    V(mass_v) = V(belt_v_fixed) + V(friction_v);
    V(der_mass_s) = V(mass_v);
    V(der_friction_v) = stuck ? 0 : (spring - V(friction_f)) / V(mass_m);
    V(limit) = stuck ? V(friction_peak) * sliding - fabs(spring) : direction(m) * V(friction_v);
}

void model_start(Model *m) {
    double v = V(friction_v);
    V(friction_mode) = v > 0 ? FORWARD : v < 0 ? BACKWARD : STUCK;
    model_evaluate(m);
    model_update(m);
}

/* The mass breaks away in the direction in which the spring pulls; it sticks as soon as it is as fast as the belt. */
int model_update(Model *m) {
    double spring = -V(spring_c) * V(mass_s);
    if (mode(m) == STUCK) {
        if (fabs(spring) < V(friction_peak) * V(friction_f_scale) * (1 - 1e-13)) return 0;
        V(friction_mode) = spring > 0 ? FORWARD : BACKWARD;
    } else {
        double rate = direction(m) * (spring - direction(m) * V(friction_f_scale));
        if (direction(m) * V(friction_v) > 0 || rate > 0) return 0;
        V(friction_mode) = STUCK;
        V(friction_v) = 0;
    }
    model_evaluate(m);
    return 1;
}

/* Time until the spring of a mass that moves with the belt reaches the static friction. */
static double sticking_time(const Model *m) {
    double v = V(belt_v_fixed);
    if (v == 0) return INFINITY;
    return (copysign(V(friction_peak) * V(friction_f_scale) / V(spring_c), v) - V(mass_s)) / v;
}

/* Time until a sliding mass is as fast as the belt: v = A*sin(omega*t + start) with omega*t in (0, 2*pi). */
static double sliding_time(const Model *m) {
    double omega = sqrt(V(spring_c) / V(mass_m)), rest = -direction(m) * V(friction_f_scale) / V(spring_c);
    double x = V(mass_s) - rest, v = V(mass_v), belt = V(belt_v_fixed), amplitude = hypot(v, omega * x);
    double now = atan2(v, -omega * x), there = asin(fmax(-1, fmin(1, belt / amplitude)));
    double first = fmod(there - now + 4 * M_PI, 2 * M_PI), second = fmod(M_PI - there - now + 4 * M_PI, 2 * M_PI);
    double nothing = 1e-9; /* the mass has just broken away at this velocity */
    if (first < nothing || first > 2 * M_PI - nothing) first = INFINITY;
    if (second < nothing || second > 2 * M_PI - nothing) second = INFINITY;
    return fmin(first, second) / omega;
}

static void move(Model *m, double h) {
    if (mode(m) == STUCK) {
        V(mass_s) += V(belt_v_fixed) * h;
    } else {
        double omega = sqrt(V(spring_c) / V(mass_m)), rest = -direction(m) * V(friction_f_scale) / V(spring_c);
        double x = V(mass_s) - rest, v = V(mass_v), c = cos(omega * h), s = sin(omega * h);
        V(mass_s) = rest + x * c + v / omega * s;
        V(friction_v) = v * c - omega * x * s - V(belt_v_fixed);
    }
    model_evaluate(m);
}

void model_advance(Model *m, double end) {
    while (m->time < end) {
        double h = end - m->time, event = mode(m) == STUCK ? sticking_time(m) : sliding_time(m);
        if (event > h) {
            move(m, h);
            m->time = end;
            return;
        }
        move(m, fmax(event, 0));
        m->time += fmax(event, 0);
        if (mode(m) == STUCK) {
            V(friction_mode) = V(mass_s) < 0 ? FORWARD : BACKWARD;
        } else {
            V(friction_mode) = STUCK;
            V(friction_v) = 0;
        }
        model_evaluate(m);
    }
}
