/*
 * The drive as a WebAssembly reactor: rows lie in the module's memory, the host reads and writes them there.
 * A loop is found by running a second drive, so that the first one goes on undisturbed.
 */
#include "drive.h"
#include "linear.h"

#include <math.h>

enum { P_MOST = 131072, S_MOST = 65536 };

static double p[P_MOST];
static double s[S_MOST];
static double io[DRIVE_IO_LENGTH];

#define EXPORT(name) __attribute__((export_name(name)))

EXPORT("p_at") double *p_at(void) { return p; }
EXPORT("s_at") double *s_at(void) { return s; }
EXPORT("io_at") double *io_at(void) { return io; }
EXPORT("p_most") int p_most(void) { return P_MOST; }
EXPORT("s_most") int s_most(void) { return S_MOST; }
EXPORT("io_length") int io_length(void) { return DRIVE_IO_LENGTH; }

/* Derives what follows from the parameters of a run in p and puts the drive at its start; 0 where it does not fit. */
EXPORT("start") int start(void)
{
    drive_prepare_sizes(p);
    if (!(p[DRIVE_STATE_SIZE] <= (double)S_MOST) || !(p[DRIVE_PARAMETER_SIZE] <= (double)P_MOST)) {
        return 0;
    }
    drive_derive(p, s);
    drive_init(p, s);
    return 1;
}

/* After a change of parameters that keeps the state: the drive goes on with the new ones. */
EXPORT("retune") int retune(void)
{
    const double before = p[DRIVE_STATE_SIZE];

    drive_prepare_sizes(p);
    if (!(p[DRIVE_STATE_SIZE] == before) || !(p[DRIVE_PARAMETER_SIZE] <= (double)P_MOST)) {
        return 0;
    }
    drive_derive(p, s);
    drive_retune(p, s);
    return 1;
}

/* One tick with what io holds; returns the status. */
EXPORT("tick") int tick(void) { return drive_tick(p, s, io); }

/* Ticks under a held command and moment; returns the number done well. */
EXPORT("run") int run(int ticks, double command, double moment)
{
    int done = 0;

    while (done < ticks) {
        io[DRIVE_IN_COMMAND] = command;
        io[DRIVE_IN_LOAD] = moment;
        if (drive_tick(p, s, io) != DRIVE_OK) {
            break;
        }
        done += 1;
    }
    return done;
}

enum { MOST_OUT = 16384 };

/* A loop: its states (0: there is none), period, matrices, feed-forward in front, figures. */
typedef struct {
    int n;
    double period;
    double lead;
    int doubtful;
    double a[MOST_STATES * MOST_STATES];
    double b[MOST_STATES];
    double c[MOST_STATES];
    double row[COLUMNS];
    double quoted[QUOTED];
} loop_t;

static loop_t loops[STAGES];
static double q[P_MOST];
static double other_s[S_MOST];
static double other_io[DRIVE_IO_LENGTH];
static double places[MOST];
static double seen[MOST_TICKS * SEEN * (MOST + 1)];
static double blocks[MOST_PHASES * BLOCK];
static double keep[2 * MOST_PHASES * MOST];
static double poles[4 * MOST_STATES];
static double points[POINTS];
static double stack[DEEPEST];
static double xs[CAPACITY];
static double rs[2 * CAPACITY];
static double ss[2 * CAPACITY];
static double work[2 * MOST_STATES * MOST_STATES + 2 * MOST_STATES];
static double state[2 * MOST_STATES];
static double exchanged[MOST_STATES];
static double real[MOST_STATES];
static double imaginary[MOST_STATES];
static double given_a[MOST_STATES * MOST_STATES];
static double given_b[MOST_STATES];
static double given_c[MOST_STATES];
static double x[MOST_OUT];
static double y[2 * MOST_OUT];

EXPORT("x_at") double *x_at(void) { return x; }
EXPORT("y_at") double *y_at(void) { return y; }
EXPORT("out_most") int out_most(void) { return MOST_OUT; }
EXPORT("figures_at") double *figures_at(int stage) { return loops[stage].quoted; }
EXPORT("row_at") double *row_at(int stage) { return loops[stage].row; }
EXPORT("period_of") double period_of(int stage) { return loops[stage].period; }
/* Whether rounding decides the figures of a loop that was computed. */
EXPORT("doubtful") int doubtful(int stage) { return loops[stage].doubtful; }

/* Updates of the signal at a cut within one period of the drive in p; 0 where there is no such loop. */
EXPORT("phases_of") int phases_of(int stage)
{
    const int every = drive_interval(p, stage);

    return (every > 0) ? drive_repeats(p, stage) / every : 0;
}

/* Where the response is that bandwidth and step of a loop are taken of; the closed loop itself where no other is. */
static int answering(int stage)
{
    return !(stage < COMMAND && isnan(loops[stage].lead)) ? stage : (stage == POSITION) ? COMMAND : ANSWER;
}

/* Matrices and figures of one loop; its states, or why there are none. */
static int one(int stage, double lead, int timed)
{
    loop_t *const it = &loops[stage];

    it->n = 0;
    for (int k = 0; k < COLUMNS; k += 1) {
        it->row[k] = NAN;
    }
    const int n = drive_assembled(
        p, q, other_s, other_io, stage, blocks, places, keep, seen, it->a, it->b, it->c);
    if (n <= 0) {
        return n;
    }
    for (int k = 0; k < n * n; k += 1) {
        given_a[k] = it->a[k];
    }
    for (int k = 0; k < n; k += 1) {
        given_b[k] = it->b[k];
        given_c[k] = it->c[k];
    }
    it->lead = lead;
    it->period = drive_interval(q, stage) * q[DRIVE_PERIOD];
    const int scanned = drive_figures(n, it->a, it->b, it->c, lead, timed, it->row, poles, points, stack, xs, rs, ss,
        work, state, exchanged, real, imaginary);
    if (scanned <= 0) {
        return scanned;
    }
    if (timed != 0) {
        for (int k = 0; k < n; k += 1) {
            it->a[k * n + k] -= 1.0;
        }
    }
    it->doubtful = !isnan(lead)
        && drive_rounding_decides(n, given_a, given_b, given_c, poles, it->row, work, state, exchanged);
    drive_quoted(it->row, it->period, it->quoted);
    it->n = n;
    return n;
}

/* A loop and its figures, the command of the drive in p going to its response as it is. */
static int answered(int stage, int timed)
{
    const double lead = (stage < COMMAND) ? drive_lead_of(p, stage) : 0.0;
    const int n = isnan(lead) ? one(stage, 0.0, 0) : one(stage, lead, timed);

    if (n > 0 && isnan(lead)) {
        loop_t *const own = &loops[stage];

        own->lead = NAN;
        const loop_t *const whole = &loops[answering(stage)];
        if (one(answering(stage), NAN, timed) <= 0) {
            return 0;
        }
        for (int k = FIRST_CLOSED; k <= LAST_CLOSED; k += 1) {
            own->row[k] = whole->row[k];
        }
        drive_quoted(own->row, own->period, own->quoted);
    }
    return n;
}

/*
 * A loop and its figures; its states, 0 where the drive has no such loop, less where it cannot be had. Figures of
 * a closed position loop are from command to output, behind mean and filter of a command with a mean, those of a
 * stage with a law of one's own from its command, as in actuator_lti.batch.
 */
EXPORT("loop") int loop(int stage, int timed)
{
    const double filters = p[DRIVE_COMMAND_FILTERS];

    if (stage == POSITION && p[DRIVE_PROFILE_SAMPLES] > 1.0) {
        p[DRIVE_COMMAND_FILTERS] = 0.0;
    }
    const int n = answered(stage, timed);
    p[DRIVE_COMMAND_FILTERS] = filters;
    return n;
}

/* Response of a loop that was computed, at count angles per sample in x, as pairs in y. */
EXPORT("respond") int respond(int stage, int count)
{
    const loop_t *const it = &loops[stage];

    if (it->n <= 0 || count > MOST_OUT) {
        return 0;
    }
    drive_responded(it->n, it->a, it->b, it->c, count, x, y, work, state, exchanged);
    return count;
}

/* Step response of the closed loop, or of what answers its command, at count samples, in y. */
EXPORT("step_of") int step_of(int stage, int count)
{
    const loop_t *const it = &loops[answering(stage)];

    if (it->n <= 0 || count > MOST_OUT) {
        return 0;
    }
    drive_stepped(it->n, it->a, it->b, it->c, it->lead, count, y, state, work);
    return count;
}

static double whole_a[MOST * MOST];
static double whole_b[MOST];
static double whole_c[MOST];

/*
 * Gains from the command to speed command, current command and voltage, in front of their limits, at count angles
 * per interval of the command in x: three rows of count numbers in y, then three of their changes per second.
 * Its states, or why there are none.
 */
EXPORT("limiters") int limiters(int count)
{
    if (2 * SHOWN * count > 2 * MOST_OUT) {
        return 0;
    }
    const int n = drive_limiters_assembled(
        p, q, other_s, other_io, blocks, places, keep, seen, whole_a, whole_b, whole_c);
    if (n <= 0) {
        return n;
    }
    drive_limiter_sizes(q, n, whole_a, whole_b, seen, drive_interval(q, COMMAND), count, x, y, work, state);
    return n;
}
