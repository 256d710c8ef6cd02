/*
 * The functions of FMI 2.0 for co-simulation, over the drive of fmu_core.c.
 */
#include "fmu_core.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

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
    unit_state state;
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
    char *name;
} unit;

static fmi2Status say(const unit *m, fmi2Status status, const char *text)
{
    if (m->logger != NULL) {
        m->logger(m->environment, m->name, status, "logStatusError", "%s", text);
    }
    return status;
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[])
{
    (void)c;
    (void)on;
    (void)n;
    (void)names;
    return fmi2OK;
}

EXPORT fmi2Component fmi2Instantiate(
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
    unit_reset(&m->state);
    return m;
}

EXPORT void fmi2FreeInstance(fmi2Component c)
{
    unit *m = (unit *)c;
    if (m != NULL) {
        free(m->name);
        free(m);
    }
}

EXPORT fmi2Status fmi2SetupExperiment(
    fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance, fmi2Real start, fmi2Boolean ends, fmi2Real stop)
{
    unit *m = (unit *)c;
    (void)tolerant;
    (void)tolerance;
    (void)ends;
    (void)stop;
    if (!isfinite(start)) {
        return say(m, fmi2Error, "the start time is not finite");
    }
    m->state.start = start;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

/* Outputs may be asked for before the initialisation ends: the start is worked out then. */
static fmi2Status ready(unit *m)
{
    const int result = ((m->state.phase == 0) ? unit_begin(&m->state) : UNIT_OK);
    return (result == UNIT_OK) ? fmi2OK : say(m, fmi2Error, unit_message(result));
}

EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    unit *m = (unit *)c;
    const fmi2Status status = ready(m);
    m->state.phase = 1;
    return status;
}

EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    unit_reset(&((unit *)c)->state);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    unit *m = (unit *)c;
    if (ready(m) != fmi2OK) {
        return fmi2Error;
    }
    for (size_t j = 0U; j < n; j += 1U) {
        if (unit_get_real(&m->state, vr[j], &value[j]) == 0) {
            return say(m, fmi2Error, "there is no such real variable");
        }
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Boolean value[])
{
    unit *m = (unit *)c;
    for (size_t j = 0U; j < n; j += 1U) {
        if (unit_get_boolean(&m->state, vr[j], &value[j]) == 0) {
            return say(m, fmi2Error, "there is no such Boolean variable");
        }
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[])
{
    (void)vr;
    (void)value;
    return (n == 0U) ? fmi2OK : say((unit *)c, fmi2Error, "there are no integer variables");
}

EXPORT fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String value[])
{
    for (size_t j = 0U; j < n; j += 1U) {
        value[j] = unit_get_string(vr[j]);
        if (value[j] == NULL) {
            return say((unit *)c, fmi2Error, "there is no such string variable");
        }
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    unit *m = (unit *)c;
    for (size_t j = 0U; j < n; j += 1U) {
        if (unit_set_real(&m->state, vr[j], value[j]) == 0) {
            return say(m, fmi2Error, "no such input or parameter, not now, or a value that is not allowed");
        }
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[])
{
    (void)vr;
    (void)value;
    return (n == 0U) ? fmi2OK : say((unit *)c, fmi2Error, "there are no integer variables");
}

EXPORT fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Boolean value[])
{
    (void)vr;
    (void)value;
    return (n == 0U) ? fmi2OK : say((unit *)c, fmi2Error, "no Boolean variable can be set");
}

EXPORT fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String value[])
{
    (void)vr;
    (void)value;
    return (n == 0U) ? fmi2OK : say((unit *)c, fmi2Error, "no string variable can be set");
}

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (*state == NULL) {
        *state = calloc(1U, sizeof(unit_state));
    }
    if (*state == NULL) {
        return say((unit *)c, fmi2Error, "no memory");
    }
    *(unit_state *)*state = ((unit *)c)->state;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    ((unit *)c)->state = *(unit_state *)state;
    return fmi2OK;
}

EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c;
    (void)state;
    *size = sizeof(unit_state);
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    if (size < sizeof(unit_state)) {
        return say((unit *)c, fmi2Error, "too few bytes for the state");
    }
    (void)memcpy(bytes, state, sizeof(unit_state));
    return fmi2OK;
}

EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    if (size != sizeof(unit_state)) {
        return say((unit *)c, fmi2Error, "this is no state of this unit");
    }
    if (*state == NULL) {
        *state = calloc(1U, sizeof(unit_state));
    }
    if (*state == NULL) {
        return say((unit *)c, fmi2Error, "no memory");
    }
    (void)memcpy(*state, bytes, size);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetDirectionalDerivative(
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

EXPORT fmi2Status fmi2SetRealInputDerivatives(
    fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[], const fmi2Real value[])
{
    (void)vr;
    (void)n;
    (void)order;
    (void)value;
    return say((unit *)c, fmi2Error, "inputs are held: no derivatives");
}

EXPORT fmi2Status fmi2GetRealOutputDerivatives(
    fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[], fmi2Real value[])
{
    (void)vr;
    (void)n;
    (void)order;
    (void)value;
    return say((unit *)c, fmi2Error, "no derivatives of outputs");
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real now, fmi2Real step, fmi2Boolean final)
{
    unit *m = (unit *)c;
    int result;
    (void)final;
    if (!(step >= 0.0)) {
        return say(m, fmi2Error, "a step that is negative or not a number");
    }
    result = unit_advance(&m->state, now + step);
    return (result == UNIT_OK) ? fmi2OK : say(m, fmi2Error, unit_message(result));
}

EXPORT fmi2Status fmi2CancelStep(fmi2Component c) { return say((unit *)c, fmi2Error, "no step is pending"); }

EXPORT fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)c;
    (void)kind;
    *value = fmi2OK;
    return fmi2Discard;
}

EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    const unit_state *m = &((unit *)c)->state;
    if (kind != fmi2LastSuccessfulTime) {
        return fmi2Discard;
    }
    *value = m->start + ((double)m->ticks * m->p[DRIVE_PERIOD]);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)c;
    (void)kind;
    *value = 0;
    return fmi2Discard;
}

EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    *value = (((unit *)c)->state.status != DRIVE_OK) ? 1 : 0;
    return (kind == fmi2Terminated) ? fmi2OK : fmi2Discard;
}

EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)c;
    (void)kind;
    *value = "";
    return fmi2Discard;
}
