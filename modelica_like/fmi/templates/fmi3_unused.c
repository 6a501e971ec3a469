/* FMI 3.0 functions for types, clocks and partitions that no model has: they refuse every call that asks for something.
 */
#include "fmi3.h"

#define REFERENCES fmi3Instance instance, const fmi3ValueReference r[], size_t n
#define UNLESS_EMPTY(name, phases, why) \
    ENTER(name, phases);                \
    (void)r;                            \
    return n == 0 ? fmi3OK : refuse(c, why)

/* Types that no variable of this model has. */
#define OTHER_TYPE(type)                                                                         \
    fmi3Status fmi3Get##type(REFERENCES, fmi3##type values[], size_t m) {                        \
        (void)values, (void)m;                                                                   \
        UNLESS_EMPTY(fmi3Get##type, READABLE, "This model has no variables of type " #type "."); \
    }                                                                                            \
    fmi3Status fmi3Set##type(REFERENCES, const fmi3##type values[], size_t m) {                  \
        (void)values, (void)m;                                                                   \
        UNLESS_EMPTY(fmi3Set##type, SETTABLE, "This model has no variables of type " #type "."); \
    }

OTHER_TYPE(Float32)
OTHER_TYPE(Int8)
OTHER_TYPE(UInt8)
OTHER_TYPE(Int16)
OTHER_TYPE(UInt16)
OTHER_TYPE(Int32)
OTHER_TYPE(UInt32)
OTHER_TYPE(UInt64)
OTHER_TYPE(Boolean)
OTHER_TYPE(String)

fmi3Status fmi3GetBinary(REFERENCES, size_t sizes[], fmi3Binary values[], size_t m) {
    (void)sizes, (void)values, (void)m;
    UNLESS_EMPTY(fmi3GetBinary, READABLE, "This model has no variables of type Binary.");
}

fmi3Status fmi3SetBinary(REFERENCES, const size_t sizes[], const fmi3Binary values[], size_t m) {
    (void)sizes, (void)values, (void)m;
    UNLESS_EMPTY(fmi3SetBinary, SETTABLE, "This model has no variables of type Binary.");
}

/* Functions of clocks: one array of values, or two. */
#define CLOCK_VALUES(name, type)                                    \
    fmi3Status name(REFERENCES, type values[]) {                    \
        (void)values;                                               \
        UNLESS_EMPTY(name, ANY_PHASE, "This model has no clocks."); \
    }
#define CLOCK_PAIRS(name, type, other)                              \
    fmi3Status name(REFERENCES, type values[], other more[]) {      \
        (void)values, (void)more;                                   \
        UNLESS_EMPTY(name, ANY_PHASE, "This model has no clocks."); \
    }

CLOCK_VALUES(fmi3GetClock, fmi3Clock)
CLOCK_VALUES(fmi3SetClock, const fmi3Clock)
CLOCK_VALUES(fmi3GetShiftDecimal, fmi3Float64)
CLOCK_VALUES(fmi3SetShiftDecimal, const fmi3Float64)
CLOCK_VALUES(fmi3SetIntervalDecimal, const fmi3Float64)
CLOCK_PAIRS(fmi3GetIntervalDecimal, fmi3Float64, fmi3IntervalQualifier)
CLOCK_PAIRS(fmi3GetShiftFraction, fmi3UInt64, fmi3UInt64)
CLOCK_PAIRS(fmi3SetShiftFraction, const fmi3UInt64, const fmi3UInt64)
CLOCK_PAIRS(fmi3SetIntervalFraction, const fmi3UInt64, const fmi3UInt64)

fmi3Status fmi3GetIntervalFraction(
    REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]) {
    (void)counters, (void)resolutions, (void)qualifiers;
    UNLESS_EMPTY(fmi3GetIntervalFraction, ANY_PHASE, "This model has no clocks.");
}

fmi3Status fmi3ActivateModelPartition(
    fmi3Instance instance, fmi3ValueReference clockReference, fmi3Float64 activationTime) {
    ENTER(fmi3ActivateModelPartition, ANY_PHASE);
    (void)clockReference, (void)activationTime;
    return refuse(c, "This model has no scheduled execution.");
}
