/* What an FMU offers beyond the standard: derivatives of its whole run, through all events, by chosen parameters,
 * inputs that are held, and start values. A Co-Simulation instance keeps its steps for them. Both functions return 0,
 * or 1 where they fail; the instance's logger tells why. The FMU's documentation has an example. */
#ifndef MODELICA_LIKE_H
#define MODELICA_LIKE_H

#include <stddef.h>
#include <stdint.h>

#ifdef _WIN32
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

/* In initialization mode: by what to differentiate; n = 0: by nothing. A reset, or going back to a copy, ends them. */
EXPORTED int modelica_like_gradient_start(void *instance, const uint32_t by[], size_t n);

/* Behind it: derivatives of variables at the present time, that of variable k by parameter j in gradient[k * n + j];
 * nan where there is none. It fails where there are none at all. */
EXPORTED int modelica_like_gradient(void *instance, const uint32_t of[], size_t n_of, double gradient[]);

#endif
