#include "controller.h"
#include <stdio.h>
int main(void) /* ticks until the overload protection acts */
{
    drive_controller_state state;
    drive_controller_output out = {0};
    drive_controller_input in = {0};
    int32_t ticks = 0;
    drive_controller_start(&state, &in);
    in.motor_current_A = CURRENT;
    for (; (out.flags & DRIVE_CONTROLLER_FLAG_OVERLOAD) == 0 && ticks < 10000000; ticks += 1) {
        drive_controller_step(&state, &in, &out);
    }
    (void)printf("%ld", (long)ticks);
    return 0;
}
