/* Ticks of the simulator: state before, what the controller saw, output, state behind it. */
#include <stddef.h>
#include "controller.h"

typedef struct {
    const char *name;
    size_t at;
    int count;
    int whole; /* 1: a whole number */
    double bound; /* of the difference */
} check;

enum { VECTORS = @VECTORS@, OUT_CHECKS = @OUT_CHECKS@, STATE_CHECKS = @STATE_CHECKS@ };

@CHECKS@

static const struct {
    @prefix@controller_state before;
    @prefix@controller_input in;
    @prefix@controller_output out;
    @prefix@controller_state after;
} vectors[] = {
@ROWS@
};
