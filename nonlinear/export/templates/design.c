/*
 * Parameters of the design @DESIGN@, SI, motor side.
 * @TITLE@
 */
#include "@prefix@design.h"

#include <math.h>

void @prefix@load_design(double *p)
{
    for (int j = 0; j < @PREFIX@P_LENGTH; j += 1) {
        p[j] = 0.0;
    }
@VALUES@
}
