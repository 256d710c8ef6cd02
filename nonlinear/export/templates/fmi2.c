/*
 * The functions of FMI 2.0 for co-simulation, over the drive of fmu_core.c.
 */
#include "fmu_core.h"

#include <stdlib.h>
#include <string.h>

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef const fmi2Char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef void (*fmi2CallbackLogger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
typedef struct {
    fmi2CallbackLogger logger;
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment environment;
} fmi2CallbackFunctions;

typedef struct {
    unit_core core;
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
    char *name;
    int quiet; /* 1: the host does not want to be told */
} unit;

static fmi2Status say(const unit *m, fmi2Status status, const char *text)
{
    if ((m->logger != NULL) && (m->quiet == 0)) {
        m->logger(m->environment, m->name, status, "logStatusError", "%s", text);
    }
    return status;
}

/* What a function of the core has said. */
static fmi2Status told(const unit *m, const char *failed)
{
    return (failed == NULL) ? fmi2OK : say(m, fmi2Error, failed);
}

UNIT_EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
UNIT_EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

UNIT_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[])
{
    unit *m = (unit *)c;
    for (size_t j = 0U; j < n; j += 1U) {
        if (strcmp(names[j], "logStatusError") != 0) {
            return say(m, fmi2Error, "there is no such category; allowed: logStatusError");
        }
    }
    m->quiet = (on != 0) ? 0 : 1;
    return fmi2OK;
}

UNIT_EXPORT fmi2Component fmi2Instantiate(
    fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
    const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    const fmi2CallbackLogger logger = (functions != NULL) ? functions->logger : NULL;
    const fmi2ComponentEnvironment environment = (functions != NULL) ? functions->environment : NULL;
    const char *named = (name != NULL) ? name : "";
    unit *m;

    (void)resources;
    (void)visible;
    (void)logging;
    if ((type != fmi2CoSimulation) || (guid == NULL) || (strcmp(guid, FMU_TOKEN) != 0) || (named[0] == '\0')) {
        if (logger != NULL) {
            logger(environment, named, fmi2Error, "logStatusError", "%s", "wrong type, name or GUID");
        }
        return NULL;
    }
    m = (unit *)calloc(1U, sizeof(unit));
    if (m == NULL) {
        return NULL;
    }
    m->name = (char *)calloc(strlen(named) + 1U, 1U);
    if (m->name == NULL) {
        free(m);
        return NULL;
    }
    (void)memcpy(m->name, named, strlen(named));
    m->logger = logger;
    m->environment = environment;
    unit_reset(&m->core);
    return m;
}

UNIT_EXPORT void fmi2FreeInstance(fmi2Component c)
{
    unit *m = (unit *)c;
    if (m != NULL) {
        free(m->name);
        free(m);
    }
}

UNIT_EXPORT fmi2Status fmi2SetupExperiment(
    fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance, fmi2Real start, fmi2Boolean ends, fmi2Real stop)
{
    unit *m = (unit *)c;
    (void)tolerant;
    (void)tolerance;
    return told(m, unit_set_times(&m->core, start, (ends != 0) ? stop : UNIT_NO_END));
}

UNIT_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    unit *m = (unit *)c;
    return told(m, unit_enter_initialization(&m->core));
}

UNIT_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    unit *m = (unit *)c;
    return told(m, unit_exit_initialization(&m->core));
}

UNIT_EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    unit *m = (unit *)c;
    return told(m, unit_terminate(&m->core));
}

UNIT_EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    unit_reset(&((unit *)c)->core);
    return fmi2OK;
}

UNIT_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    unit *m = (unit *)c;
    return told(m, unit_get_reals(&m->core, vr, n, value));
}

UNIT_EXPORT fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Boolean value[])
{
    unit *m = (unit *)c;
    const char *failed = NULL;
    for (size_t j = 0U; (j < n) && (failed == NULL); j += 1U) {
        failed = unit_get_boolean(&m->core, vr[j], &value[j]);
    }
    return told(m, failed);
}

UNIT_EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[])
{
    unit *m = (unit *)c;
    return told(m, unit_get_integers(&m->core, vr, n, value));
}

UNIT_EXPORT fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String value[])
{
    return told((unit *)c, unit_get_strings(&((unit *)c)->core, vr, n, value));
}

UNIT_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    unit *m = (unit *)c;
    return told(m, unit_set_reals(&m->core, vr, n, value));
}

UNIT_EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[])
{
    unit *m = (unit *)c;
    return told(m, unit_set_integers(&m->core, vr, n, value));
}

UNIT_EXPORT fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Boolean value[])
{
    (void)vr;
    (void)value;
    return (n == 0U) ? fmi2OK : say((unit *)c, fmi2Error, "no Boolean variable can be set");
}

UNIT_EXPORT fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String value[])
{
    (void)vr;
    (void)value;
    return (n == 0U) ? fmi2OK : say((unit *)c, fmi2Error, "no string variable can be set");
}

UNIT_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    return told((unit *)c, unit_keep(&((unit *)c)->core.state, state));
}

UNIT_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    unit *m = (unit *)c;
    return told(m, unit_restore(&m->core, state));
}

UNIT_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    unit_drop(state);
    return fmi2OK;
}

UNIT_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c;
    (void)state;
    *size = sizeof(unit_state);
    return fmi2OK;
}

UNIT_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    return told((unit *)c, unit_write(state, bytes, size));
}

UNIT_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    return told((unit *)c, unit_read(bytes, size, state));
}

UNIT_EXPORT fmi2Status fmi2GetDirectionalDerivative(
    fmi2Component c, const fmi2ValueReference u[], size_t nu, const fmi2ValueReference k[], size_t nk,
    const fmi2Real du[], fmi2Real dk[])
{
    (void)u;
    (void)nu;
    (void)k;
    (void)nk;
    (void)du;
    (void)dk;
    return say((unit *)c, fmi2Error, "no directional derivatives");
}

UNIT_EXPORT fmi2Status fmi2SetRealInputDerivatives(
    fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[], const fmi2Real value[])
{
    (void)vr;
    (void)n;
    (void)order;
    (void)value;
    return say((unit *)c, fmi2Error, "inputs are held: no derivatives");
}

UNIT_EXPORT fmi2Status fmi2GetRealOutputDerivatives(
    fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[], fmi2Real value[])
{
    (void)vr;
    (void)n;
    (void)order;
    (void)value;
    return say((unit *)c, fmi2Error, "no derivatives of outputs");
}

UNIT_EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real now, fmi2Real step, fmi2Boolean final)
{
    unit *m = (unit *)c;
    (void)final;
    return told(m, unit_step(&m->core, now, step));
}

UNIT_EXPORT fmi2Status fmi2CancelStep(fmi2Component c) { return say((unit *)c, fmi2Error, "no step is pending"); }

UNIT_EXPORT fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)c;
    (void)kind;
    *value = fmi2OK;
    return fmi2Discard;
}

UNIT_EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    const unit_state *m = &((unit *)c)->core.state;
    if (kind != fmi2LastSuccessfulTime) {
        return fmi2Discard;
    }
    *value = m->now;
    return fmi2OK;
}

UNIT_EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)c;
    (void)kind;
    *value = 0;
    return fmi2Discard;
}

UNIT_EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    *value = (((unit *)c)->core.state.phase == UNIT_FAILED) ? 1 : 0;
    return (kind == fmi2Terminated) ? fmi2OK : fmi2Discard;
}

UNIT_EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)c;
    (void)kind;
    *value = "";
    return fmi2Discard;
}
