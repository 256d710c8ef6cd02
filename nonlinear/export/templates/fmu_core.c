/*
 * One drive as a co-simulation unit.  Its ticks lie at start + k Ts, counted in whole numbers, wherever the
 * host's communication points lie: a tick begins with the inputs that hold at its time, and the outputs are
 * the drive's at the communication point.
 */
#include "fmu_core.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double PART_OF_TICK = 1e-4; /* a communication point this close to a tick is at the tick */

static const char FAILED[] = "the drive failed: too many events in a tick, or the speed is not finite";
static const char STRUCTURE[] = "these parameters ask for another structure: export the changed design again";

void unit_reset(unit_core *m)
{
    unit_state *o = &m->state;

    (void)memset(m, 0, sizeof(*m));
    drive_load_design(o->p);
    for (size_t j = 0U; j < FMU_KEYS; j += 1U) {
        o->keys[j] = fmu_keys[j].value;
    }
    o->inputs[INPUT_SUPPLY] = FMU_SUPPLY_VOLTAGE;
    o->stop = UNIT_NO_END;
    o->phase = UNIT_INSTANTIATED;
}

const char *unit_in(const unit_core *m, int phases)
{
    if ((m->state.phase & phases) != 0) {
        return NULL;
    }
    switch (m->state.phase) {
    case UNIT_INSTANTIATED: return "not allowed before the initialization mode";
    case UNIT_INITIALIZING: return "not allowed in the initialization mode";
    case UNIT_STEPPING: return "not allowed after the initialization mode";
    case UNIT_TERMINATED: return "not allowed after termination";
    default: return "not allowed after the drive has failed";
    }
}

/* Parameters p that follow from the keys, with their lengths; not yet what is derived from them. */
static const char *follow(unit_core *m, const double *keys, double *p)
{
    if ((m->state.touched != 0) && (fmu_related(keys, m->why, sizeof(m->why)) == 0)) {
        return m->why;
    }
    if ((m->state.touched != 0) && (fmu_set_keys(keys, p) == 0)) {
        return STRUCTURE;
    }
    drive_prepare_sizes(p);
    if (!(p[DRIVE_STATE_SIZE] <= (double)(DRIVE_S_LENGTH + UNIT_SPARE)) ||
        !(p[DRIVE_PARAMETER_SIZE] <= (double)(DRIVE_P_LENGTH + FMU_SPARE_P))) {
        return STRUCTURE;
    }
    return NULL;
}

/* What a host reads, of a state and of the tick that led to it. */
static void show(unit_state *m, const double *s, const double *io)
{
    const double *p = m->p;
    const int elastic = (p[DRIVE_ELASTIC_DRIVE] > 0.0) ? 1 : 0;
    double *y = m->outputs;

    y[0] = (elastic != 0) ? s[DRIVE_S_OUTPUT] : (s[DRIVE_S_ANGLE] / p[DRIVE_RATIO]);
    y[1] = (elastic != 0) ? s[DRIVE_S_OUTPUT_SPEED] : (s[DRIVE_S_SPEED] / p[DRIVE_RATIO]);
    y[2] = s[DRIVE_S_CURRENT];
    y[3] = s[DRIVE_S_VOLTAGE];
    y[4] = (p[DRIVE_TORQUE_CONSTANT] * s[DRIVE_S_CURRENT]) + (p[DRIVE_SOURCE_GAIN] * s[DRIVE_S_HELD]);
    y[5] = s[DRIVE_S_ANGLE];
    y[6] = s[DRIVE_S_SPEED];
    y[7] = s[DRIVE_S_CURRENT_REFERENCE];
    y[8] = s[DRIVE_S_SPEED_REFERENCE];
    m->flags = (int32_t)io[DRIVE_IO_FLAGS];
}

/* The state at the start time. */
static const char *begin(unit_core *m)
{
    unit_state *o = &m->state;
    const char *failed;

    o->p[DRIVE_SPEED_START] = 0.0;
    failed = follow(m, o->keys, o->p);
    if (failed == NULL) {
        drive_derive(o->p, o->s);
        o->p[DRIVE_ANGLE_START] = o->initial_angle * o->p[DRIVE_RATIO];
        drive_init(o->p, o->s);
        o->changed = 0;
        show(o, o->s, o->io);
    }
    return failed;
}

/* The keys that were set since the last tick; they have been found to be allowed then. */
static void retune(unit_core *m)
{
    unit_state *o = &m->state;

    (void)follow(m, o->keys, o->p);
    drive_derive(o->p, o->s);
    drive_retune(o->p, o->s);
    if (o->p[DRIVE_OVERLOAD] <= 0.0) {
        o->s[DRIVE_S_CURRENT_LIMIT] = o->p[DRIVE_CURRENT_LIMIT];
    }
    o->changed = 0;
}

/* The next tick, with the keys and the inputs that hold now. */
static void begin_tick(unit_core *c)
{
    unit_state *m = &c->state;

    if (m->changed != 0) {
        retune(c);
    }
    m->io[DRIVE_IN_COMMAND] = m->inputs[INPUT_COMMAND];
    m->io[DRIVE_IN_LOAD] = m->inputs[INPUT_MOMENT];
    if (m->p[DRIVE_SUPPLY] > 0.0) {
        m->p[DRIVE_SUPPLY_VOLTAGE] = m->inputs[INPUT_SUPPLY];
    } else {
        m->s[DRIVE_S_VOLTAGE_LIMIT] = m->inputs[INPUT_SUPPLY];
    }
    m->under_way = 1;
}

/* The tick under way up to tau seconds behind its beginning, to look at; it is run as a whole later. */
static int look(unit_core *m, double tau)
{
    unit_state *o = &m->state;
    double io[DRIVE_IO_LENGTH];
    int status;

    (void)memcpy(m->q, o->p, sizeof(m->q));
    (void)memcpy(m->view, o->s, sizeof(m->view));
    (void)memcpy(io, o->io, sizeof(io));
    status = drive_part_of_tick(o->p, m->q, m->view, io, tau);
    show(o, m->view, io);
    return status;
}

static int advance(unit_core *m, double until, int64_t target, double tau)
{
    unit_state *o = &m->state;
    int status = DRIVE_OK;

    while ((o->ticks < target) && (status == DRIVE_OK)) {
        if (o->under_way == 0) {
            begin_tick(m);
        }
        status = drive_tick(o->p, o->s, o->io);
        o->under_way = 0;
        o->ticks += 1;
    }
    if ((status == DRIVE_OK) && (tau > 0.0)) {
        if (o->under_way == 0) {
            begin_tick(m);
        }
        status = look(m, tau);
    } else {
        show(o, o->s, o->io);
    }
    o->now = until;
    return status;
}

/* A key or a constant of the design, where it is of this type. */
static int get_key(const unit_state *m, unsigned int reference, int whole, double *value)
{
    const unsigned int key = reference - FMU_FIRST_KEY;
    const unsigned int constant = reference - FMU_FIRST_CONSTANT;

    if ((reference >= FMU_FIRST_KEY) && (key < FMU_KEYS) && (fmu_keys[key].whole == whole)) {
        *value = m->keys[key];
        return 1;
    }
    if ((reference >= FMU_FIRST_CONSTANT) && (constant < FMU_CONSTANTS) && (fmu_constants[constant].whole == whole)) {
        *value = fmu_constants[constant].value;
        return 1;
    }
    return 0;
}

static int get_real(const unit_state *m, unsigned int reference, double *value)
{
    if (get_key(m, reference, 0, value) != 0) {
        return 1;
    }
    if ((reference >= FIRST_OUTPUT) && (reference < FIRST_OUTPUT + UNIT_OUTPUTS)) {
        *value = m->outputs[reference - FIRST_OUTPUT];
        return 1;
    }
    switch (reference) {
    case 0U: *value = m->now; break;
    case 1U: *value = m->inputs[INPUT_COMMAND]; break;
    case 2U: *value = m->inputs[INPUT_MOMENT]; break;
    case 3U: *value = m->inputs[INPUT_SUPPLY]; break;
    case 90U: *value = m->initial_angle; break;
    default: return 0;
    }
    return 1;
}

const char *unit_set_times(unit_core *m, double start, double stop)
{
    const char *failed = unit_in(m, UNIT_INSTANTIATED);

    if ((failed == NULL) && (!isfinite(start) || !(stop >= start))) {
        failed = "the start time is not finite, or the stop time before it";
    }
    if (failed == NULL) {
        m->state.start = start;
        m->state.now = start;
        m->state.stop = stop;
    }
    return failed;
}

const char *unit_enter_initialization(unit_core *m)
{
    const char *failed = unit_in(m, UNIT_INSTANTIATED);

    if (failed == NULL) {
        m->state.phase = UNIT_INITIALIZING;
    }
    return failed;
}

const char *unit_exit_initialization(unit_core *m)
{
    const char *failed = unit_in(m, UNIT_INITIALIZING);

    if (failed == NULL) {
        failed = begin(m);
    }
    if (failed == NULL) {
        m->state.phase = UNIT_STEPPING;
    }
    return failed;
}

const char *unit_terminate(unit_core *m)
{
    const char *failed = unit_in(m, UNIT_STEPPING);

    if (failed == NULL) {
        m->state.phase = UNIT_TERMINATED;
    }
    return failed;
}

const char *unit_step(unit_core *m, double now, double step)
{
    unit_state *o = &m->state;
    const double period = o->p[DRIVE_PERIOD];
    const double until = now + step;
    const double ticks = (until - o->start) / period;
    const double whole = floor(ticks + PART_OF_TICK);
    const double near = (PART_OF_TICK * period) + (4.0 * DBL_EPSILON * fabs(until)); /* rounding of the host */
    const char *failed = unit_in(m, UNIT_STEPPING);

    if (failed != NULL) {
        return failed;
    }
    if (!isfinite(until) || !(step > 0.0) || !(whole < 9e15)) {
        return "the communication step is not above 0, or not finite";
    }
    if (!(fabs(now - o->now) <= near)) {
        return "the communication step does not begin where the last one ended";
    }
    if (until - o->stop > near) {
        return "the communication step goes past the stop time";
    }
    if (advance(m, until, (int64_t)whole, (ticks - whole > PART_OF_TICK) ? ((ticks - whole) * period) : 0.0) != DRIVE_OK) {
        o->phase = UNIT_FAILED;
        return FAILED;
    }
    return NULL;
}

/* Whether values may be read; in the initialization mode they are worked out. */
static const char *readable(unit_core *m)
{
    const char *failed = unit_in(m, ~UNIT_INSTANTIATED);

    if ((failed == NULL) && (m->state.phase == UNIT_INITIALIZING)) {
        failed = begin(m);
    }
    return failed;
}

const char *unit_get_reals(unit_core *m, const unsigned int *references, size_t n, double *values)
{
    const char *failed = readable(m);

    for (size_t j = 0U; (j < n) && (failed == NULL); j += 1U) {
        if (get_real(&m->state, references[j], &values[j]) == 0) {
            failed = "there is no such real variable";
        }
    }
    return failed;
}

const char *unit_get_integers(unit_core *m, const unsigned int *references, size_t n, int32_t *values)
{
    const char *failed = readable(m);

    for (size_t j = 0U; (j < n) && (failed == NULL); j += 1U) {
        double value = 0.0;
        if (get_key(&m->state, references[j], 1, &value) == 0) {
            failed = "there is no such integer variable";
        }
        values[j] = (int32_t)value;
    }
    return failed;
}

static int is_key(unsigned int reference)
{
    return ((reference >= FMU_FIRST_KEY) && (reference < FMU_FIRST_KEY + FMU_KEYS)) ? 1 : 0;
}

/* Whether a variable may have this value now. */
static int allowed(const unit_state *m, unsigned int reference, double value)
{
    const int before = ((m->phase & (UNIT_INSTANTIATED | UNIT_INITIALIZING)) != 0) ? 1 : 0;

    if (!isfinite(value)) {
        return 0;
    }
    if (is_key(reference) != 0) {
        const fmu_key *key = &fmu_keys[reference - FMU_FIRST_KEY];
        return ((value >= key->low) && (value <= key->high) && ((key->fixed == 0) || (before != 0))) ? 1 : 0;
    }
    if (reference == 90U) {
        return before;
    }
    return ((reference >= 1U) && (reference <= UNIT_INPUTS) && ((reference != 3U) || (value >= 0.0))) ? 1 : 0;
}

/* The keys as they would be are tried in the work space; none of them is changed. */
static const char *tried(unit_core *m, const unsigned int *references, size_t n, const double *values)
{
    unit_state *o = &m->state;
    const int32_t touched = o->touched;
    const char *failed;

    (void)memcpy(m->keys, o->keys, sizeof(m->keys));
    (void)memcpy(m->q, o->p, sizeof(m->q));
    for (size_t j = 0U; j < n; j += 1U) {
        if (is_key(references[j]) != 0) {
            m->keys[references[j] - FMU_FIRST_KEY] = values[j];
            o->touched = 1;
        }
    }
    failed = follow(m, m->keys, m->q);
    o->touched = touched;
    return failed;
}

static void set_real(unit_state *m, unsigned int reference, double value)
{
    if (is_key(reference) != 0) {
        m->keys[reference - FMU_FIRST_KEY] = value;
        m->changed = 1;
        m->touched = 1;
    } else if (reference == 90U) {
        m->initial_angle = value;
    } else {
        m->inputs[reference - 1U] = value;
    }
}

/* Values of one type; all of them are set, or none. */
static const char *set(unit_core *m, const unsigned int *references, size_t n, const double *values, int whole)
{
    const char *failed = unit_in(m, UNIT_INSTANTIATED | UNIT_INITIALIZING | UNIT_STEPPING);
    int keys = 0;

    for (size_t j = 0U; (j < n) && (failed == NULL); j += 1U) {
        const int key = is_key(references[j]);
        const int type = (key != 0) ? fmu_keys[references[j] - FMU_FIRST_KEY].whole : 0;
        if ((type != whole) || (allowed(&m->state, references[j], values[j]) == 0)) {
            failed = "no such input or parameter of this type, not now, or a value that is not allowed";
        }
        keys |= key;
    }
    if ((failed == NULL) && (keys != 0) && (m->state.phase == UNIT_STEPPING)) {
        failed = tried(m, references, n, values);
    }
    for (size_t j = 0U; (j < n) && (failed == NULL); j += 1U) {
        set_real(&m->state, references[j], values[j]);
    }
    return failed;
}

const char *unit_set_reals(unit_core *m, const unsigned int *references, size_t n, const double *values)
{
    return set(m, references, n, values, 0);
}

const char *unit_set_integers(unit_core *m, const unsigned int *references, size_t n, const int32_t *values)
{
    double numbers[FMU_KEYS + 1U];

    for (size_t j = 0U; (j < n) && (n <= FMU_KEYS); j += 1U) {
        numbers[j] = (double)values[j];
    }
    return (n <= FMU_KEYS) ? set(m, references, n, numbers, 1) : "more values than there are integer variables";
}

const char *unit_get_boolean(unit_core *m, unsigned int reference, int *value)
{
    static const int bits[] = {@BITS@};
    const unsigned int count = (unsigned int)(sizeof(bits) / sizeof(bits[0]));
    const char *failed = readable(m);

    if ((failed == NULL) && ((reference < 30U) || (reference >= 30U + count))) {
        failed = "there is no such Boolean variable";
    }
    if (failed == NULL) {
        *value = ((m->state.flags & bits[reference - 30U]) != 0) ? 1 : 0;
    }
    return failed;
}

const char *unit_get_strings(const unit_core *m, const unsigned int *references, size_t n, const char **values)
{
    const char *failed = unit_in(m, ~UNIT_INSTANTIATED);

    for (size_t j = 0U; (j < n) && (failed == NULL); j += 1U) {
        if ((references[j] < FMU_FIRST_TEXT) || (references[j] >= FMU_FIRST_TEXT + FMU_TEXTS)) {
            failed = "there is no such string variable";
        } else {
            values[j] = fmu_texts[references[j] - FMU_FIRST_TEXT];
        }
    }
    return failed;
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

const char *unit_restore(unit_core *m, const void *kept)
{
    if (kept == NULL) {
        return "there is no state to go back to";
    }
    (void)memcpy(&m->state, kept, sizeof(unit_state));
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
