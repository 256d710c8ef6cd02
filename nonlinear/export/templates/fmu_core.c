/*
 * One drive as a co-simulation unit.  Ticks are counted in whole numbers from the start time, so that
 * communication steps of any length neither drift nor fail.
 */
#include "fmu_core.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double PART_OF_TICK = 1e-4; /* a communication point this close to a tick is at the tick */

void unit_reset(unit_state *m)
{
    (void)memset(m, 0, sizeof(*m));
    drive_load_design(m->p);
    for (size_t j = 0U; j < FMU_KEYS; j += 1U) {
        m->keys[j] = fmu_keys[j].value;
    }
    m->inputs[INPUT_SUPPLY] = FMU_SUPPLY_VOLTAGE;
}

/* Writes the keys into p and derives what follows from them. */
static int derive(unit_state *m)
{
    if ((m->touched != 0) && (fmu_set_keys(m->keys, m->p) == 0)) {
        return UNIT_STRUCTURE;
    }
    drive_prepare_sizes(m->p);
    if (!(m->p[DRIVE_STATE_SIZE] <= (double)(DRIVE_S_LENGTH + UNIT_SPARE)) ||
        !(m->p[DRIVE_PARAMETER_SIZE] <= (double)(DRIVE_P_LENGTH + FMU_SPARE_P))) {
        return UNIT_STRUCTURE;
    }
    drive_derive(m->p, m->s);
    m->changed = 0;
    return UNIT_OK;
}

static int begin(unit_state *m)
{
    int result;

    m->p[DRIVE_SPEED_START] = 0.0;
    result = derive(m);
    if (result == UNIT_OK) {
        m->p[DRIVE_ANGLE_START] = m->initial_angle * m->p[DRIVE_RATIO];
        drive_init(m->p, m->s);
        m->ticks = 0;
        m->status = DRIVE_OK;
    }
    return result;
}

/* Parameters that were changed between two ticks. */
static int retune(unit_state *m)
{
    const int result = derive(m);

    if (result == UNIT_OK) {
        drive_retune(m->p, m->s);
        if (m->p[DRIVE_OVERLOAD] <= 0.0) {
            m->s[DRIVE_S_CURRENT_LIMIT] = m->p[DRIVE_CURRENT_LIMIT];
        }
    }
    return result;
}

static void supply(unit_state *m)
{
    if (m->p[DRIVE_SUPPLY] > 0.0) {
        m->p[DRIVE_SUPPLY_VOLTAGE] = m->inputs[INPUT_SUPPLY];
    } else {
        m->s[DRIVE_S_VOLTAGE_LIMIT] = m->inputs[INPUT_SUPPLY];
    }
}

static int advance(unit_state *m, double until)
{
    const double ticks = floor(((until - m->start) / m->p[DRIVE_PERIOD]) + PART_OF_TICK);
    int64_t target;

    if (!(ticks >= 0.0) || !(ticks < 9e15)) {
        return UNIT_TIME;
    }
    target = (int64_t)ticks;
    if (m->changed != 0) {
        const int result = retune(m);
        if (result != UNIT_OK) {
            return result;
        }
    }
    m->io[DRIVE_IN_COMMAND] = m->inputs[INPUT_COMMAND];
    m->io[DRIVE_IN_LOAD] = m->inputs[INPUT_MOMENT];
    while ((m->ticks < target) && (m->status == DRIVE_OK)) {
        supply(m);
        m->status = drive_tick(m->p, m->s, m->io);
        m->ticks += 1;
    }
    return (m->status == DRIVE_OK) ? UNIT_OK : UNIT_TICK_FAILED;
}

static int get_real(unit_state *m, unsigned int reference, double *value)
{
    const double *p = m->p;
    const double *s = m->s;
    const int elastic = (p[DRIVE_ELASTIC_DRIVE] > 0.0) ? 1 : 0;

    if ((reference >= FMU_FIRST_KEY) && (reference < FMU_FIRST_KEY + FMU_KEYS)) {
        *value = m->keys[reference - FMU_FIRST_KEY];
        return 1;
    }
    if ((reference >= FMU_FIRST_CONSTANT) && (reference < FMU_FIRST_CONSTANT + FMU_CONSTANTS)) {
        *value = fmu_constants[reference - FMU_FIRST_CONSTANT];
        return 1;
    }
    switch (reference) {
    case 0U: *value = m->start + ((double)m->ticks * p[DRIVE_PERIOD]); break;
    case 1U: *value = m->inputs[INPUT_COMMAND]; break;
    case 2U: *value = m->inputs[INPUT_MOMENT]; break;
    case 3U: *value = m->inputs[INPUT_SUPPLY]; break;
    case 10U: *value = (elastic != 0) ? s[DRIVE_S_OUTPUT] : (s[DRIVE_S_ANGLE] / p[DRIVE_RATIO]); break;
    case 11U: *value = (elastic != 0) ? s[DRIVE_S_OUTPUT_SPEED] : (s[DRIVE_S_SPEED] / p[DRIVE_RATIO]); break;
    case 12U: *value = s[DRIVE_S_CURRENT]; break;
    case 13U: *value = s[DRIVE_S_VOLTAGE]; break;
    case 14U:
        *value = (p[DRIVE_TORQUE_CONSTANT] * s[DRIVE_S_CURRENT]) + (p[DRIVE_SOURCE_GAIN] * s[DRIVE_S_HELD]);
        break;
    case 15U: *value = s[DRIVE_S_ANGLE]; break;
    case 16U: *value = s[DRIVE_S_SPEED]; break;
    case 17U: *value = s[DRIVE_S_CURRENT_REFERENCE]; break;
    case 18U: *value = s[DRIVE_S_SPEED_REFERENCE]; break;
    case 90U: *value = m->initial_angle; break;
    default: return 0;
    }
    return 1;
}

static int set_real(unit_state *m, unsigned int reference, double value)
{
    if (!isfinite(value)) {
        return 0;
    }
    if ((reference >= FMU_FIRST_KEY) && (reference < FMU_FIRST_KEY + FMU_KEYS)) {
        const fmu_key *key = &fmu_keys[reference - FMU_FIRST_KEY];
        if ((value < key->low) || (value > key->high) || ((key->fixed != 0) && (m->phase != 0))) {
            return 0;
        }
        m->keys[reference - FMU_FIRST_KEY] = value;
        m->changed = 1;
        m->touched = 1;
        return 1;
    }
    if ((reference == 90U) && (m->phase == 0)) {
        m->initial_angle = value;
        return 1;
    }
    if ((reference < 1U) || (reference > UNIT_INPUTS) || ((reference == 3U) && (value < 0.0))) {
        return 0;
    }
    m->inputs[reference - 1U] = value;
    return 1;
}

static const char *message(int result)
{
    switch (result) {
    case UNIT_TICK_FAILED: return "the drive failed: too many events in a tick, or the speed is not finite";
    case UNIT_STRUCTURE: return "these parameters ask for another structure: export the changed design again";
    case UNIT_TIME: return "the communication point lies before the last one, or is not finite";
    default: return NULL;
    }
}

const char *unit_set_start(unit_state *m, double start)
{
    if (!isfinite(start)) {
        return "the start time is not finite";
    }
    m->start = start;
    return NULL;
}

const char *unit_ready(unit_state *m)
{
    return (m->phase == 0) ? message(begin(m)) : NULL;
}

const char *unit_step(unit_state *m, double now, double step)
{
    return (step >= 0.0) ? message(advance(m, now + step)) : "a step that is negative or not a number";
}

const char *unit_get_reals(unit_state *m, const unsigned int *references, size_t n, double *values)
{
    const char *failed = unit_ready(m);

    for (size_t j = 0U; (j < n) && (failed == NULL); j += 1U) {
        if (get_real(m, references[j], &values[j]) == 0) {
            failed = "there is no such real variable";
        }
    }
    return failed;
}

const char *unit_set_reals(unit_state *m, const unsigned int *references, size_t n, const double *values)
{
    for (size_t j = 0U; j < n; j += 1U) {
        if (set_real(m, references[j], values[j]) == 0) {
            return "no such input or parameter, not now, or a value that is not allowed";
        }
    }
    return NULL;
}

const char *unit_get_boolean(const unit_state *m, unsigned int reference, int *value)
{
    static const int bits[] = {@BITS@};
    const unsigned int count = (unsigned int)(sizeof(bits) / sizeof(bits[0]));

    if ((reference < 30U) || (reference >= 30U + count)) {
        return "there is no such Boolean variable";
    }
    *value = (((int)m->io[DRIVE_IO_FLAGS] & bits[reference - 30U]) != 0) ? 1 : 0;
    return NULL;
}

const char *unit_get_strings(const unsigned int *references, size_t n, const char **values)
{
    for (size_t j = 0U; j < n; j += 1U) {
        if ((references[j] < FMU_FIRST_TEXT) || (references[j] >= FMU_FIRST_TEXT + FMU_TEXTS)) {
            return "there is no such string variable";
        }
        values[j] = fmu_texts[references[j] - FMU_FIRST_TEXT];
    }
    return NULL;
}

const char *unit_keep(const unit_state *m, void **kept)
{
    if (*kept == NULL) {
        *kept = calloc(1U, sizeof(unit_state));
    }
    if (*kept == NULL) {
        return "no memory";
    }
    (void)memcpy(*kept, m, sizeof(unit_state));
    return NULL;
}

void unit_drop(void **kept)
{
    if (kept != NULL) {
        free(*kept);
        *kept = NULL;
    }
}

const char *unit_write(const void *kept, void *bytes, size_t size)
{
    if (size < sizeof(unit_state)) {
        return "too few bytes for the state";
    }
    (void)memcpy(bytes, kept, sizeof(unit_state));
    return NULL;
}

const char *unit_read(const void *bytes, size_t size, void **kept)
{
    return (size == sizeof(unit_state)) ? unit_keep((const unit_state *)bytes, kept) : "this is no state of this unit";
}
