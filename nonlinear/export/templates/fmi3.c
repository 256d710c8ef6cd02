/*
 * The functions of FMI 3.0 for co-simulation, over the drive of fmu_core.c.
 */
#include "fmu_core.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef double fmi3Float64;
typedef bool fmi3Boolean;
typedef const char *fmi3String;
typedef uint8_t fmi3Byte;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);

typedef struct {
    unit_core core;
    fmi3LogMessageCallback logger;
    fmi3InstanceEnvironment environment;
    int quiet; /* 1: the host does not want to be told */
} unit;

static fmi3Status say(const unit *m, fmi3Status status, const char *text)
{
    if ((m->logger != NULL) && (m->quiet == 0)) {
        m->logger(m->environment, status, "logStatusError", text);
    }
    return status;
}

/* What a function of the core has said. */
static fmi3Status told(const unit *m, const char *failed)
{
    return (failed == NULL) ? fmi3OK : say(m, fmi3Error, failed);
}

UNIT_EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

UNIT_EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String names[])
{
    unit *m = (unit *)c;
    for (size_t j = 0U; j < n; j += 1U) {
        if (strcmp(names[j], "logStatusError") != 0) {
            return say(m, fmi3Error, "there is no such category; allowed: logStatusError");
        }
    }
    m->quiet = (on != 0) ? 0 : 1;
    return fmi3OK;
}

UNIT_EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference required[], size_t count,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger, void *intermediate)
{
    unit *m;

    (void)resources;
    (void)visible;
    (void)logging;
    (void)events;
    (void)early;
    (void)required;
    (void)count;
    (void)intermediate;
    if ((name == NULL) || (name[0] == '\0') || (token == NULL) || (strcmp(token, FMU_TOKEN) != 0)) {
        if (logger != NULL) {
            logger(environment, fmi3Error, "logStatusError", "wrong name or instantiation token");
        }
        return NULL;
    }
    m = (unit *)calloc(1U, sizeof(unit));
    if (m != NULL) {
        m->logger = logger;
        m->environment = environment;
        unit_reset(&m->core);
    }
    return m;
}

UNIT_EXPORT fmi3Instance fmi3InstantiateModelExchange(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger)
{
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)environment;
    (void)logger;
    return NULL;
}

UNIT_EXPORT fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger, void *clock, void *lock, void *unlock)
{
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)environment;
    (void)logger;
    (void)clock;
    (void)lock;
    (void)unlock;
    return NULL;
}

UNIT_EXPORT void fmi3FreeInstance(fmi3Instance c) { free(c); }

UNIT_EXPORT fmi3Status fmi3EnterInitializationMode(
    fmi3Instance c, fmi3Boolean tolerant, fmi3Float64 tolerance, fmi3Float64 start, fmi3Boolean ends, fmi3Float64 stop)
{
    unit *m = (unit *)c;
    const char *failed = unit_set_times(&m->core, start, (ends != 0) ? stop : UNIT_NO_END);
    (void)tolerant;
    (void)tolerance;
    return told(m, (failed == NULL) ? unit_enter_initialization(&m->core) : failed);
}

UNIT_EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    unit *m = (unit *)c;
    return told(m, unit_exit_initialization(&m->core));
}

UNIT_EXPORT fmi3Status fmi3Terminate(fmi3Instance c)
{
    unit *m = (unit *)c;
    return told(m, unit_terminate(&m->core));
}

UNIT_EXPORT fmi3Status fmi3Reset(fmi3Instance c)
{
    unit_reset(&((unit *)c)->core);
    return fmi3OK;
}

UNIT_EXPORT fmi3Status fmi3GetFloat64(
    fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 value[], size_t count)
{
    unit *m = (unit *)c;
    return told(m, (count < n) ? "fewer values than variables" : unit_get_reals(&m->core, vr, n, value));
}

UNIT_EXPORT fmi3Status fmi3SetFloat64(
    fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 value[], size_t count)
{
    unit *m = (unit *)c;
    return told(m, (count < n) ? "fewer values than variables" : unit_set_reals(&m->core, vr, n, value));
}

UNIT_EXPORT fmi3Status fmi3GetInt32(
    fmi3Instance c, const fmi3ValueReference vr[], size_t n, int32_t value[], size_t count)
{
    unit *m = (unit *)c;
    return told(m, (count < n) ? "fewer values than variables" : unit_get_integers(&m->core, vr, n, value));
}

UNIT_EXPORT fmi3Status fmi3SetInt32(
    fmi3Instance c, const fmi3ValueReference vr[], size_t n, const int32_t value[], size_t count)
{
    unit *m = (unit *)c;
    return told(m, (count < n) ? "fewer values than variables" : unit_set_integers(&m->core, vr, n, value));
}

UNIT_EXPORT fmi3Status fmi3GetBoolean(
    fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Boolean value[], size_t count)
{
    unit *m = (unit *)c;
    const char *failed = (count < n) ? "fewer values than variables" : NULL;
    for (size_t j = 0U; (j < n) && (failed == NULL); j += 1U) {
        int found = 0;
        failed = unit_get_boolean(&m->core, vr[j], &found);
        value[j] = (found != 0);
    }
    return told(m, failed);
}

UNIT_EXPORT fmi3Status fmi3GetString(
    fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3String value[], size_t count)
{
    return told((unit *)c, (count < n) ? "fewer values than variables" : unit_get_strings(&((unit *)c)->core, vr, n, value));
}

UNIT_EXPORT fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state)
{
    return told((unit *)c, unit_keep(&((unit *)c)->core.state, state));
}

UNIT_EXPORT fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state)
{
    unit *m = (unit *)c;
    return told(m, unit_restore(&m->core, state));
}

UNIT_EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state)
{
    (void)c;
    unit_drop(state);
    return fmi3OK;
}

UNIT_EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    (void)c;
    (void)state;
    *size = sizeof(unit_state);
    return fmi3OK;
}

UNIT_EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    return told((unit *)c, unit_write(state, bytes, size));
}

UNIT_EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    return told((unit *)c, unit_read(bytes, size, state));
}

UNIT_EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance c)
{
    (void)c;
    return fmi3OK;
}

UNIT_EXPORT fmi3Status fmi3DoStep(
    fmi3Instance c, fmi3Float64 now, fmi3Float64 step, fmi3Boolean final, fmi3Boolean *event,
    fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last)
{
    unit *m = (unit *)c;
    const char *failed = unit_step(&m->core, now, step);
    (void)final;
    *event = false;
    *terminate = false;
    *early = false;
    *last = (failed == NULL) ? (now + step) : now;
    return told(m, failed);
}

/* What this unit does not have: the caller is told so by fmi3Error. */
#define ABSENT(name) \
    UNIT_EXPORT fmi3Status name(fmi3Instance c); \
    UNIT_EXPORT fmi3Status name(fmi3Instance c) { return say((unit *)c, fmi3Error, #name " is not supported"); }

ABSENT(fmi3GetFloat32)
ABSENT(fmi3GetInt8)
ABSENT(fmi3GetUInt8)
ABSENT(fmi3GetInt16)
ABSENT(fmi3GetUInt16)
ABSENT(fmi3GetUInt32)
ABSENT(fmi3GetInt64)
ABSENT(fmi3GetUInt64)
ABSENT(fmi3GetBinary)
ABSENT(fmi3GetClock)
ABSENT(fmi3SetFloat32)
ABSENT(fmi3SetInt8)
ABSENT(fmi3SetUInt8)
ABSENT(fmi3SetInt16)
ABSENT(fmi3SetUInt16)
ABSENT(fmi3SetUInt32)
ABSENT(fmi3SetInt64)
ABSENT(fmi3SetUInt64)
ABSENT(fmi3SetBoolean)
ABSENT(fmi3SetString)
ABSENT(fmi3SetBinary)
ABSENT(fmi3SetClock)
ABSENT(fmi3GetNumberOfVariableDependencies)
ABSENT(fmi3GetVariableDependencies)
ABSENT(fmi3GetDirectionalDerivative)
ABSENT(fmi3GetAdjointDerivative)
ABSENT(fmi3EnterConfigurationMode)
ABSENT(fmi3ExitConfigurationMode)
ABSENT(fmi3EnterEventMode)
ABSENT(fmi3GetIntervalDecimal)
ABSENT(fmi3GetIntervalFraction)
ABSENT(fmi3GetShiftDecimal)
ABSENT(fmi3GetShiftFraction)
ABSENT(fmi3SetIntervalDecimal)
ABSENT(fmi3SetIntervalFraction)
ABSENT(fmi3SetShiftDecimal)
ABSENT(fmi3SetShiftFraction)
ABSENT(fmi3EvaluateDiscreteStates)
ABSENT(fmi3UpdateDiscreteStates)
ABSENT(fmi3EnterContinuousTimeMode)
ABSENT(fmi3CompletedIntegratorStep)
ABSENT(fmi3SetTime)
ABSENT(fmi3SetContinuousStates)
ABSENT(fmi3GetContinuousStateDerivatives)
ABSENT(fmi3GetEventIndicators)
ABSENT(fmi3GetContinuousStates)
ABSENT(fmi3GetNominalsOfContinuousStates)
ABSENT(fmi3GetNumberOfEventIndicators)
ABSENT(fmi3GetNumberOfContinuousStates)
ABSENT(fmi3GetOutputDerivatives)
ABSENT(fmi3ActivateModelPartition)
