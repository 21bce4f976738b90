/* A sensor as a network of capacitors that depend on a force: FMI 3.0, model exchange and co-simulation.
 *
 * Made by elastocap, under MIT or Apache-2.0 at your choice. tables.h has the numbers of this sensor, modelDescription.xml what each value
 * reference is. There are no continuous states: capacitances and charges follow from the inputs at once. No memory is shared between instances. */

#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"
#include "tables.h"

/* Value references; the same are in modelDescription.xml. */
enum {
    VR_TIME = 0,
    VR_FORCE = 1,
    VR_BAND = 2,
    VR_BAND_GROUND = 3,
    VR_REFUSE_OUTSIDE = 4,
    VR_OUTSIDE = 5,
    VR_VOLTAGE = 100,
    VR_CHARGE = 200,
    VR_CAPACITANCE = 1000 /* four for each capacitor: value, lower bound, upper bound, derivative */
};

/* Everything that an instance remembers; saved and restored as a whole. */
typedef struct {
    double time;
    double force;
    double band[2]; /* of mutual capacitances, and of those to common */
    double voltages[ELC_POTENTIALS];
    fmi3Boolean refuse_outside;
    int phase;
} State;

enum { INSTANTIATED, INITIALIZING, EVENT, CONTINUOUS, STEP, TERMINATED };

typedef struct {
    State state;
    int is_cosimulation;
    fmi3Boolean logging;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} Instance;

/* A serialized state. The token of the model comes first, so that the state of another model is refused. */
typedef struct {
    char token[sizeof(ELC_TOKEN)];
    State state;
} Serialized;

#define UNUSED(x) (void)(x)

static fmi3Status fail(Instance *self, const char *message) {
    if (self != NULL && self->log != NULL) {
        self->log(self->environment, fmi3Error, "logStatusError", message);
    }
    return fmi3Error;
}

static void reset(State *state) {
    memset(state, 0, sizeof *state); /* the gaps between its members as well: it is saved as bytes */
    state->force = elc_forces[0];
    state->refuse_outside = fmi3True;
    state->phase = INSTANTIATED;
}

/* The force, or the nearer end of the range of the model if it is outside. */
static double clamped(double force) {
    if (force < elc_forces[0]) return elc_forces[0];
    if (force > elc_forces[ELC_INTERVALS]) return elc_forces[ELC_INTERVALS];
    return force;
}

/* Whether the force is outside by more than rounding. What is not a number is outside. */
static int is_outside(double force) {
    const double slack = 1e-9 * (elc_forces[ELC_INTERVALS] - elc_forces[0]);
    return !(force >= elc_forces[0] - slack && force <= elc_forces[ELC_INTERVALS] + slack);
}

/* A capacitance, F, with its first and second derivative over the force; band from -1 to 1. */
static void capacitance(int branch, double force, double band, double out[3]) {
    int k = 0, which, last = ELC_INTERVALS - 1;
    const double at = clamped(force);
    const double weights[3] = {band < 0 ? -band : 0, 1 - (band < 0 ? -band : band), band > 0 ? band : 0};
    /* The interval that begins at or before the force. */
    while (k < last) {
        const int middle = (k + last + 1) / 2;
        if (elc_forces[middle] <= at) k = middle;
        else last = middle - 1;
    }
    {
        const double h = elc_forces[k + 1] - elc_forces[k];
        const double t = (at - elc_forces[k]) / h, s = 1 - t;
        out[0] = out[1] = out[2] = 0;
        for (which = 0; which < 3; ++which) {
            const double *p = elc_points[branch][k][which], w = weights[which];
            out[0] += w * (p[0] * s * s * s + 3 * p[1] * t * s * s + 3 * p[2] * t * t * s + p[3] * t * t * t);
            out[1] += w * 3 / h * ((p[1] - p[0]) * s * s + 2 * (p[2] - p[1]) * t * s + (p[3] - p[2]) * t * t);
            out[2] += w * 6 / (h * h) * ((p[2] - 2 * p[1] + p[0]) * s + (p[3] - 2 * p[2] + p[1]) * t);
        }
    }
    if (force != at) out[1] = out[2] = 0;
}

static double band_of(const State *state, int branch) { return state->band[elc_band[branch]]; }

/* The voltage across a capacitor; one end may be the common node. */
static double across(const State *state, int branch) {
    const int a = elc_ends[branch][0], b = elc_ends[branch][1];
    return state->voltages[a] - (b < 0 ? 0 : state->voltages[b]);
}

/* 1 where a capacitor begins at a terminal, -1 where it ends there, else 0. */
static int incidence(int branch, int terminal) {
    return (elc_ends[branch][0] == terminal) - (elc_ends[branch][1] == terminal);
}

/* The charge of a terminal, C, or its derivative over the force. */
static double charge(const State *state, int terminal, int derivative) {
    double sum = 0, c[3];
    int k;
    for (k = 0; k < ELC_BRANCHES; ++k) {
        if (incidence(k, terminal) != 0) {
            capacitance(k, state->force, band_of(state, k), c);
            sum += incidence(k, terminal) * c[derivative] * across(state, k);
        }
    }
    return sum;
}

static int is_voltage(fmi3ValueReference vr) { return vr >= VR_VOLTAGE && vr < VR_VOLTAGE + ELC_POTENTIALS; }
static int is_charge(fmi3ValueReference vr) { return vr >= VR_CHARGE && vr < VR_CHARGE + ELC_POTENTIALS; }
static int is_capacitance(fmi3ValueReference vr) {
    return vr >= VR_CAPACITANCE && vr < VR_CAPACITANCE + 4 * ELC_BRANCHES;
}

/* The band of a capacitance output by its kind: 0 value and 3 derivative have that of the parameter, 1 is the lower bound, 2 the upper bound. */
static double band_for(const State *state, int branch, int kind) {
    return kind == 1 ? -1 : kind == 2 ? 1 : band_of(state, branch);
}

static fmi3Status check_force(Instance *self) {
    if (self->state.refuse_outside && is_outside(self->state.force)) return fail(self, ELC_OUTSIDE_MESSAGE);
    return fmi3OK;
}

/* ---- Inquiry and instances ---- */

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t count, const fmi3String categories[]) {
    UNUSED(count);
    UNUSED(categories);
    ((Instance *)instance)->logging = on;
    return fmi3OK;
}

static Instance *instantiate(fmi3String token, int is_cosimulation, fmi3Boolean logging, fmi3InstanceEnvironment environment,
                             fmi3LogMessageCallback log) {
    Instance *self;
    if (token == NULL || strcmp(token, ELC_TOKEN) != 0) {
        if (log != NULL) log(environment, fmi3Error, "logStatusError", "the instantiation token is that of another model");
        return NULL;
    }
    self = calloc(1, sizeof *self);
    if (self == NULL) return NULL;
    reset(&self->state);
    self->is_cosimulation = is_cosimulation;
    self->logging = logging;
    self->environment = environment;
    self->log = log;
    return self;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
    UNUSED(name);
    UNUSED(resources);
    UNUSED(visible);
    return instantiate(token, 0, logging, environment, log);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
                                         fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference required[], size_t count,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
    UNUSED(name);
    UNUSED(resources);
    UNUSED(visible);
    UNUSED(event_mode);
    UNUSED(early_return);
    UNUSED(required);
    UNUSED(count);
    UNUSED(update);
    return instantiate(token, 1, logging, environment, log);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                               fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                               fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock) {
    UNUSED(name);
    UNUSED(token);
    UNUSED(resources);
    UNUSED(visible);
    UNUSED(logging);
    UNUSED(update);
    UNUSED(lock);
    UNUSED(unlock);
    if (log != NULL) log(environment, fmi3Error, "logStatusError", "there is no scheduled execution; use co-simulation or model exchange");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance) { free(instance); }

/* ---- Phases ---- */

static fmi3Status enter(fmi3Instance instance, int phase) {
    Instance *self = instance;
    if (self->state.phase == TERMINATED) return fail(self, "the simulation has been terminated; call fmi3Reset first");
    self->state.phase = phase;
    return fmi3OK;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean tolerance_defined, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean stop_defined, fmi3Float64 stop) {
    UNUSED(tolerance_defined);
    UNUSED(tolerance);
    UNUSED(stop_defined);
    UNUSED(stop);
    if (((Instance *)instance)->state.phase != INSTANTIATED) return fail(instance, "it is initialized already; call fmi3Reset first");
    ((Instance *)instance)->state.time = start;
    return enter(instance, INITIALIZING);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    Instance *self = instance;
    fmi3Status status = check_force(self);
    if (status != fmi3OK) return status;
    return enter(instance, self->is_cosimulation ? STEP : EVENT);
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance) { return enter(instance, EVENT); }
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) { return enter(instance, CONTINUOUS); }
fmi3Status fmi3EnterStepMode(fmi3Instance instance) { return enter(instance, STEP); }
fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance) { return enter(instance, INSTANTIATED); }
fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance) { return enter(instance, INSTANTIATED); }

fmi3Status fmi3Terminate(fmi3Instance instance) { return enter(instance, TERMINATED); }

fmi3Status fmi3Reset(fmi3Instance instance) {
    reset(&((Instance *)instance)->state);
    return fmi3OK;
}

/* ---- Variables ---- */

static fmi3Status get_one(Instance *self, fmi3ValueReference vr, double *value) {
    const State *state = &self->state;
    if (vr == VR_TIME) *value = state->time;
    else if (vr == VR_FORCE) *value = state->force;
    else if (vr == VR_BAND) *value = state->band[0];
    else if (vr == VR_BAND_GROUND && ELC_BANDS == 2) *value = state->band[1];
    else if (is_voltage(vr)) *value = state->voltages[vr - VR_VOLTAGE];
    else if (is_charge(vr) || is_capacitance(vr)) {
        fmi3Status status = check_force(self);
        if (status != fmi3OK) return status;
        if (is_charge(vr)) {
            *value = charge(state, (int)(vr - VR_CHARGE), 0);
        } else {
            const int branch = (int)(vr - VR_CAPACITANCE) / 4, kind = (int)(vr - VR_CAPACITANCE) % 4;
            double c[3];
            capacitance(branch, state->force, band_for(state, branch, kind), c);
            *value = c[kind == 3];
        }
    } else return fail(self, "there is no Float64 variable of this value reference");
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, fmi3Float64 values[], size_t places) {
    size_t k;
    if (places != count) return fail(instance, "all variables are scalars: as many values as value references");
    for (k = 0; k < count; ++k) {
        fmi3Status status = get_one(instance, vrs[k], &values[k]);
        if (status != fmi3OK) return status;
    }
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, const fmi3Float64 values[], size_t places) {
    Instance *self = instance;
    State *state = &self->state;
    size_t k;
    if (places != count) return fail(self, "all variables are scalars: as many values as value references");
    if (state->phase == TERMINATED) return fail(self, "the simulation has been terminated; call fmi3Reset first");
    for (k = 0; k < count; ++k) {
        const fmi3ValueReference vr = vrs[k];
        const double value = values[k];
        if (vr == VR_FORCE) state->force = value;
        else if (is_voltage(vr)) state->voltages[vr - VR_VOLTAGE] = value;
        else if (vr == VR_BAND || (vr == VR_BAND_GROUND && ELC_BANDS == 2)) {
            if (!(value >= -1 && value <= 1)) return fail(self, "a band lies between -1 and 1");
            state->band[vr - VR_BAND] = value;
        } else return fail(self, "there is no Float64 variable of this value reference that can be set");
    }
    return fmi3OK;
}

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, fmi3Boolean values[], size_t places) {
    const State *state = &((Instance *)instance)->state;
    size_t k;
    if (places != count) return fail(instance, "all variables are scalars: as many values as value references");
    for (k = 0; k < count; ++k) {
        if (vrs[k] == VR_REFUSE_OUTSIDE) values[k] = state->refuse_outside;
        else if (vrs[k] == VR_OUTSIDE) values[k] = is_outside(state->force);
        else return fail(instance, "there is no Boolean variable of this value reference");
    }
    return fmi3OK;
}

fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, const fmi3Boolean values[], size_t places) {
    size_t k;
    if (places != count) return fail(instance, "all variables are scalars: as many values as value references");
    for (k = 0; k < count; ++k) {
        if (vrs[k] != VR_REFUSE_OUTSIDE) return fail(instance, "there is no Boolean variable of this value reference that can be set");
        ((Instance *)instance)->state.refuse_outside = values[k];
    }
    return fmi3OK;
}

/* The derivative of an output by an input. If it is not one of those that can be computed, the result and *known are 0. */
static double partial(const State *state, fmi3ValueReference unknown, fmi3ValueReference over, int *known) {
    double c[3], sum = 0;
    int k;
    *known = (is_charge(unknown) || is_capacitance(unknown)) && (over == VR_FORCE || is_voltage(over));
    if (!*known) return 0;
    if (is_capacitance(unknown)) {
        const int branch = (int)(unknown - VR_CAPACITANCE) / 4, kind = (int)(unknown - VR_CAPACITANCE) % 4;
        if (over != VR_FORCE) return 0;
        capacitance(branch, state->force, band_for(state, branch, kind), c);
        return c[kind == 3 ? 2 : 1];
    }
    if (over == VR_FORCE) return charge(state, (int)(unknown - VR_CHARGE), 1);
    for (k = 0; k < ELC_BRANCHES; ++k) {
        const int sign = incidence(k, (int)(unknown - VR_CHARGE)) * incidence(k, (int)(over - VR_VOLTAGE));
        if (sign != 0) {
            capacitance(k, state->force, band_of(state, k), c);
            sum += sign * c[0];
        }
    }
    return sum;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t unknown_count,
                                        const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seed[], size_t seed_count,
                                        fmi3Float64 sensitivity[], size_t sensitivity_count) {
    Instance *self = instance;
    size_t i, j;
    if (seed_count != known_count || sensitivity_count != unknown_count) return fail(self, "all variables are scalars: one seed for each");
    if (check_force(self) != fmi3OK) return fmi3Error;
    for (i = 0; i < unknown_count; ++i) {
        sensitivity[i] = 0;
        for (j = 0; j < known_count; ++j) {
            int known;
            sensitivity[i] += partial(&self->state, unknowns[i], knowns[j], &known) * seed[j];
            if (!known) return fail(self, "derivatives are known of charges and capacitances over force and voltages");
        }
    }
    return fmi3OK;
}

/* ---- Saved states ---- */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *saved) {
    if (*saved == NULL) *saved = malloc(sizeof(State));
    if (*saved == NULL) return fail(instance, "there is no memory for a state");
    memcpy(*saved, &((Instance *)instance)->state, sizeof(State));
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState saved) {
    if (saved == NULL) return fail(instance, "there is no saved state");
    memcpy(&((Instance *)instance)->state, saved, sizeof(State));
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *saved) {
    UNUSED(instance);
    if (saved != NULL) {
        free(*saved);
        *saved = NULL;
    }
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState saved, size_t *size) {
    UNUSED(instance);
    UNUSED(saved);
    *size = sizeof(Serialized);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState saved, fmi3Byte bytes[], size_t size) {
    Serialized out;
    if (saved == NULL || size < sizeof out) return fail(instance, "there is no saved state, or no room for it");
    memset(&out, 0, sizeof out);
    memcpy(out.token, ELC_TOKEN, sizeof out.token);
    memcpy(&out.state, saved, sizeof out.state);
    memcpy(bytes, &out, sizeof out);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size, fmi3FMUState *saved) {
    Serialized in;
    if (size != sizeof in) return fail(instance, "these bytes are not a state of this model");
    memcpy(&in, bytes, sizeof in);
    if (memcmp(in.token, ELC_TOKEN, sizeof in.token) != 0) return fail(instance, "these bytes are not a state of this model");
    if (*saved == NULL) *saved = malloc(sizeof(State));
    if (*saved == NULL) return fail(instance, "there is no memory for a state");
    memcpy(*saved, &in.state, sizeof in.state);
    return fmi3OK;
}

/* ---- Model exchange ---- */

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals_changed,
                                    fmi3Boolean *states_changed, fmi3Boolean *next_defined, fmi3Float64 *next) {
    UNUSED(instance);
    *again = *terminate = *nominals_changed = *states_changed = *next_defined = fmi3False;
    *next = 0;
    return fmi3OK;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance) {
    UNUSED(instance);
    return fmi3OK;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean no_set_state, fmi3Boolean *event_mode, fmi3Boolean *terminate) {
    UNUSED(no_set_state);
    *event_mode = *terminate = fmi3False;
    return check_force(instance);
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
    ((Instance *)instance)->state.time = time;
    return fmi3OK;
}

/* Continuous states and event indicators: an array of them must be empty. */
static fmi3Status must_be_empty(fmi3Instance instance, size_t count) {
    return count == 0 ? fmi3OK : fail(instance, "the model has no continuous states and no event indicators");
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 states[], size_t count) {
    UNUSED(states);
    return must_be_empty(instance, count);
}
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[], size_t count) {
    UNUSED(derivatives);
    return must_be_empty(instance, count);
}
fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 indicators[], size_t count) {
    UNUSED(indicators);
    return must_be_empty(instance, count);
}
fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 states[], size_t count) {
    UNUSED(states);
    return must_be_empty(instance, count);
}
fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[], size_t count) {
    UNUSED(nominals);
    return must_be_empty(instance, count);
}
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *count) {
    UNUSED(instance);
    *count = 0;
    return fmi3OK;
}
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *count) {
    UNUSED(instance);
    *count = 0;
    return fmi3OK;
}

/* ---- Co-simulation ---- */

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 point, fmi3Float64 step, fmi3Boolean no_set_state, fmi3Boolean *event_needed,
                      fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last_time) {
    Instance *self = instance;
    fmi3Status status = check_force(self);
    UNUSED(no_set_state);
    *event_needed = *terminate = *early_return = fmi3False;
    *last_time = self->state.time;
    if (self->state.phase != STEP) return fail(self, "a step can be done in step mode only");
    if (status != fmi3OK) return status;
    self->state.time = point + step;
    *last_time = self->state.time;
    return fmi3OK;
}

/* ---- What this model lacks: variables of other types, clocks, arrays that depend on parameters ---- */

#define NO_VARIABLES(Type)                                                                                                               \
    fmi3Status fmi3Get##Type(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, fmi3##Type values[], size_t places) {   \
        UNUSED(vrs);                                                                                                                      \
        UNUSED(values);                                                                                                                   \
        UNUSED(places);                                                                                                                   \
        return count == 0 ? fmi3OK : fail(instance, "there are no variables of type " #Type);                                             \
    }                                                                                                                                     \
    fmi3Status fmi3Set##Type(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, const fmi3##Type values[],              \
                             size_t places) {                                                                                             \
        UNUSED(vrs);                                                                                                                      \
        UNUSED(values);                                                                                                                   \
        UNUSED(places);                                                                                                                   \
        return count == 0 ? fmi3OK : fail(instance, "there are no variables of type " #Type);                                             \
    }

NO_VARIABLES(Float32)
NO_VARIABLES(Int8)
NO_VARIABLES(UInt8)
NO_VARIABLES(Int16)
NO_VARIABLES(UInt16)
NO_VARIABLES(Int32)
NO_VARIABLES(UInt32)
NO_VARIABLES(Int64)
NO_VARIABLES(UInt64)
NO_VARIABLES(String)

#define NOT_HERE(arguments) arguments { return fail(instance, "this model has no such thing"); }

NOT_HERE(fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, size_t sizes[], fmi3Binary values[],
                                  size_t places))
NOT_HERE(fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, const size_t sizes[],
                                  const fmi3Binary values[], size_t places))
NOT_HERE(fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, fmi3Clock values[]))
NOT_HERE(fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, const fmi3Clock values[]))
NOT_HERE(fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference vr, size_t *count))
NOT_HERE(fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent, size_t element[],
                                                fmi3ValueReference independents[], size_t elements[], fmi3DependencyKind kinds[],
                                                size_t count))
NOT_HERE(fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t unknown_count,
                                             const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seed[],
                                             size_t seed_count, fmi3Float64 sensitivity[], size_t sensitivity_count))
NOT_HERE(fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, fmi3Float64 intervals[],
                                           fmi3IntervalQualifier qualifiers[]))
NOT_HERE(fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, fmi3UInt64 counters[],
                                            fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]))
NOT_HERE(fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, fmi3Float64 shifts[]))
NOT_HERE(fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, fmi3UInt64 counters[],
                                         fmi3UInt64 resolutions[]))
NOT_HERE(fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count,
                                           const fmi3Float64 intervals[]))
NOT_HERE(fmi3Status fmi3SetIntervalFraction(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count,
                                            const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]))
NOT_HERE(fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, const fmi3Float64 shifts[]))
NOT_HERE(fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, const fmi3UInt64 counters[],
                                         const fmi3UInt64 resolutions[]))
NOT_HERE(fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference vrs[], size_t count, const fmi3Int32 orders[],
                                             fmi3Float64 values[], size_t places))
NOT_HERE(fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clock, fmi3Float64 time))
