/*
 * Keys of the design as parameters of the unit.
 */
#ifndef FMU_DESIGN_H
#define FMU_DESIGN_H

#include <stddef.h>

#define FMU_TOKEN "@TOKEN@"
#define FMU_SPARE_P @SPARE@ /* room for a stiffer coupling than the design's */
#define FMU_KEYS @KEYS@U
#define FMU_CONSTANTS @CONSTANTS@U
#define FMU_TEXTS @TEXTS@U
#define FMU_FIRST_KEY @FIRST_KEY@U
#define FMU_FIRST_CONSTANT @FIRST_CONSTANT@U
#define FMU_FIRST_TEXT @FIRST_TEXT@U
#define FMU_SUPPLY_VOLTAGE @SUPPLY_VOLTAGE@

typedef struct {
    double value; /* of the design, SI */
    double low; /* allowed, both inclusive */
    double high;
    int fixed; /* 1: only before the run */
    int whole; /* 1: a count, an integer variable */
} fmu_key;

typedef struct {
    double value;
    int whole;
} fmu_constant;

extern const fmu_key fmu_keys[FMU_KEYS + 1U];
extern const fmu_constant fmu_constants[FMU_CONSTANTS + 1U];
extern const char *const fmu_texts[FMU_TEXTS + 1U];

/* Works out the parameters p from the keys; 0 where they ask for another structure than the exported one. */
int fmu_set_keys(const double *k, double *p);

/* Whether the keys go together, as a design file has to have them; 0, and the reason, where they do not. */
int fmu_related(const double *k, char *why, size_t size);

#endif
