/*
 * One drive as a co-simulation unit, without anything of a version of FMI.
 */
#ifndef FMU_CORE_H
#define FMU_CORE_H

#include "drive.h"
#include "drive_design.h"
#include "fmu_design.h"

#include <stddef.h>
#include <stdint.h>

#define UNIT_INPUTS 3U
#define UNIT_SPARE 1024
enum { INPUT_COMMAND = 0, INPUT_MOMENT = 1, INPUT_SUPPLY = 2 };
enum {
    UNIT_OK = 0,
    UNIT_TICK_FAILED = 1, /* the drive's status says why */
    UNIT_STRUCTURE = 2, /* parameters that ask for another structure than the exported one */
    UNIT_TIME = 3 /* a communication point before the last one, or not finite */
};

/* All that changes: copying it is saving the state. */
typedef struct {
    double p[DRIVE_P_LENGTH + FMU_SPARE_P];
    double s[DRIVE_S_LENGTH + UNIT_SPARE];
    double io[DRIVE_IO_LENGTH];
    double keys[FMU_KEYS + 1];
    double inputs[UNIT_INPUTS];
    double initial_angle; /* output side */
    double start; /* time of tick 0, s */
    int64_t ticks; /* ticks done */
    int32_t changed; /* 1: a key has another value than p knows */
    int32_t touched; /* 1: some key has another value than the design's */
    int32_t status; /* of the drive */
    int32_t phase;
} unit_state;

#ifdef _WIN32
#define UNIT_EXPORT __declspec(dllexport)
#else
#define UNIT_EXPORT __attribute__((visibility("default")))
#endif

/* The functions below that return text return NULL where all went well, else the reason. */

void unit_reset(unit_state *m);
const char *unit_set_start(unit_state *m, double start);
const char *unit_ready(unit_state *m); /* before the run: works out the state at the start time */
const char *unit_step(unit_state *m, double now, double step); /* all ticks that begin before now + step */

/* By value reference. */
const char *unit_get_reals(unit_state *m, const unsigned int *references, size_t n, double *values);
const char *unit_set_reals(unit_state *m, const unsigned int *references, size_t n, const double *values);
const char *unit_get_boolean(const unit_state *m, unsigned int reference, int *value);
const char *unit_get_strings(const unsigned int *references, size_t n, const char **values);

/* Copies of the whole state; *kept is NULL or a copy made before. */
const char *unit_keep(const unit_state *m, void **kept);
void unit_drop(void **kept);
const char *unit_write(const void *kept, void *bytes, size_t size);
const char *unit_read(const void *bytes, size_t size, void **kept);

#endif
