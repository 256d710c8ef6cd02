/*
 * Keys of the design as parameters of the unit, and how the drive's parameters follow from them.
 */
#include "fmu_design.h"

#include <math.h>
#include <stdio.h>

const fmu_key fmu_keys[FMU_KEYS + 1U] = {
@KEYS@
    {0.0, 0.0, 0.0, 0, 0}
};

const fmu_constant fmu_constants[FMU_CONSTANTS + 1U] = {
@CONSTANTS@
    {0.0, 0}
};

const char *const fmu_texts[FMU_TEXTS + 1U] = {
@TEXTS@
    NULL
};

int fmu_set_keys(const double *k, double *p)
{
@LINES@
    return 1;
}

@RELATIONS@
