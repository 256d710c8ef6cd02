/*
 * One drive as a co-simulation unit, without anything of a version of FMI.
 */
#ifndef FMU_CORE_H
#define FMU_CORE_H

#include "drive.h"
#include "drive_design.h"
#include "fmu_design.h"

#include <float.h>
#include <stddef.h>
#include <stdint.h>

#define UNIT_INPUTS 3U
#define UNIT_SPARE 1024
#define UNIT_NO_END DBL_MAX /* stop time where the host gives none */
enum { INPUT_COMMAND = 0, INPUT_MOMENT = 1, INPUT_SUPPLY = 2 };
enum { FIRST_OUTPUT = 10, UNIT_OUTPUTS = 9 };

/* Where a unit stands in the order of calls that the standard asks for. */
enum {
    UNIT_INSTANTIATED = 1,
    UNIT_INITIALIZING = 2,
    UNIT_STEPPING = 4,
    UNIT_TERMINATED = 8,
    UNIT_FAILED = 16 /* the drive itself: too many events in a tick, or no number any more */
};

/* All that changes: copying it is saving the state. */
typedef struct {
    double p[DRIVE_P_LENGTH + FMU_SPARE_P];
    double s[DRIVE_S_LENGTH + UNIT_SPARE]; /* at the last tick boundary */
    double io[DRIVE_IO_LENGTH]; /* of the tick under way: what it holds from its beginning */
    double keys[FMU_KEYS + 1];
    double inputs[UNIT_INPUTS];
    double outputs[UNIT_OUTPUTS]; /* at the communication point */
    double initial_angle; /* output side */
    double start; /* time of tick 0, s */
    double now; /* the communication point */
    double stop; /* no step goes past it */
    int64_t ticks; /* ticks done */
    int32_t under_way; /* 1: the next tick has begun, with the inputs that held then */
    int32_t changed; /* 1: a key has another value than p knows; the next tick begins with it */
    int32_t touched; /* 1: some key has another value than the design's */
    int32_t flags; /* limiters, at the communication point */
    int32_t phase;
} unit_state;

/* The state, and work space that nothing is kept in from call to call. */
typedef struct {
    unit_state state;
    double q[DRIVE_P_LENGTH + FMU_SPARE_P];
    double view[DRIVE_S_LENGTH + UNIT_SPARE];
    double keys[FMU_KEYS + 1];
    char why[256]; /* the last refusal of keys that do not go together */
} unit_core;

#ifdef _WIN32
#define UNIT_EXPORT __declspec(dllexport)
#else
#define UNIT_EXPORT __attribute__((visibility("default")))
#endif

/* The functions below that return text return NULL where all went well, else the reason; the state is then
 * what it was, except where the drive itself failed. */

void unit_reset(unit_core *m);
const char *unit_in(const unit_core *m, int phases); /* whether a call is allowed now */
const char *unit_set_times(unit_core *m, double start, double stop);
const char *unit_enter_initialization(unit_core *m);
const char *unit_exit_initialization(unit_core *m);
const char *unit_terminate(unit_core *m);

/* From the communication point now to now + step.  A tick that begins in between, or at now, takes the inputs as
 * they are at this call; the outputs are those at now + step. */
const char *unit_step(unit_core *m, double now, double step);

/* By value reference. */
const char *unit_get_reals(unit_core *m, const unsigned int *references, size_t n, double *values);
const char *unit_set_reals(unit_core *m, const unsigned int *references, size_t n, const double *values);
const char *unit_get_integers(unit_core *m, const unsigned int *references, size_t n, int32_t *values);
const char *unit_set_integers(unit_core *m, const unsigned int *references, size_t n, const int32_t *values);
const char *unit_get_boolean(unit_core *m, unsigned int reference, int *value);
const char *unit_get_strings(const unit_core *m, const unsigned int *references, size_t n, const char **values);

/* Copies of the whole state; *kept is NULL or a copy made before. */
const char *unit_keep(const unit_state *m, void **kept);
const char *unit_restore(unit_core *m, const void *kept);
void unit_drop(void **kept);
const char *unit_write(const void *kept, void *bytes, size_t size);
const char *unit_read(const void *bytes, size_t size, void **kept);

#endif
