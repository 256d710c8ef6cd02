/*
 * The controller of @NAME@, @PRECISION@ precision, cut out of the tick of actuator-lti @VERSION@.
 * @TITLE@
 */
#ifndef @PREFIX@CONTROLLER_H
#define @PREFIX@CONTROLLER_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define @PREFIX@CONTROLLER_DESIGN @C_NAME@
#define @PREFIX@CONTROLLER_REVISION @C_REVISION@
#define @PREFIX@CONTROLLER_DESIGN_HASH "@DESIGN_HASH@" /* SHA-256 of the design's values */
#define @PREFIX@CONTROLLER_SOURCE_HASH "@SOURCE_HASH@" /* SHA-256 of the controller's C in double precision */
#define @PREFIX@CONTROLLER_EXPORTER "actuator-lti @VERSION@"
@CONSTANTS@

/* Bits of flags */
typedef enum {
@FLAGS@
} @prefix@controller_flag;

@STRUCTS@

/* Design, revision and hashes, to be found in a binary. */
extern const char @prefix@controller_version[];

@DECLARATIONS@

#ifdef __cplusplus
}
#endif

#endif
