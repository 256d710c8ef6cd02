/*
 * Parameters of the design @DESIGN@.
 */
#ifndef @PREFIX@DESIGN_H
#define @PREFIX@DESIGN_H

#include "drive.h"

#define @PREFIX@DESIGN_NAME @NAME@
#define @PREFIX@DESIGN_REVISION @REVISION@
#define @PREFIX@DESIGN_HASH "@DESIGN_HASH@" /* SHA-256 of its values */
#define @PREFIX@SOURCE_HASH "@HASH@" /* SHA-256 of drive.h and drive.c in double precision */
#define @PREFIX@EXPORTER_VERSION "@VERSION@"

enum {
    @PREFIX@P_LENGTH = @P@, /* of the row p of this design */
    @PREFIX@S_LENGTH = @S@ /* of the row s of this design */
};

/* Copies the parameters of the design into p, @PREFIX@P_LENGTH numbers; the derived ones become 0. */
void @prefix@load_design(double *p);

#endif
