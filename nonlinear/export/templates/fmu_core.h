/*
 * One drive as a co-simulation unit, without anything of a version of FMI.
 */
#ifndef FMU_CORE_H
#define FMU_CORE_H

#include "drive.h"
#include "drive_design.h"
#include "fmu_design.h"

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
    double p[DRIVE_P_LENGTH];
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

void unit_reset(unit_state *m);
int unit_begin(unit_state *m); /* end of the initialisation: the state at the start time */
int unit_advance(unit_state *m, double until); /* all ticks that begin before a time */

/* By value reference; 0 where there is no such variable, or a value is not allowed. */
int unit_get_real(unit_state *m, unsigned int reference, double *value);
int unit_set_real(unit_state *m, unsigned int reference, double value);
int unit_get_boolean(const unit_state *m, unsigned int reference, int *value);
const char *unit_get_string(unsigned int reference);
const char *unit_message(int result);

#endif
