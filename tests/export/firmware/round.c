#include "controller.h"
#include <stdio.h>
int main(void)
{
    drive_controller_state states[2];
    drive_controller_output out[2];
    for (int k = 0; k < 400; k += 1) {
        const uint32_t begin[2] = {0U, 0x7ffff000U}; /* the second goes round after 4096 counts */
        for (int n = 0; n < 2; n += 1) {
            drive_controller_input in = {0};
            in.command_rad = 0.3f;
            in.motor_angle_rad = (float)k * 0.05f;
            in.motor_counts = (int32_t)(begin[n] + 33U * (uint32_t)k);
            if (k == 0) {
                drive_controller_start(&states[n], &in);
            }
            drive_controller_step(&states[n], &in, &out[n]);
        }
        if (out[0].voltage_V != out[1].voltage_V || out[0].flags != out[1].flags) {
            (void)printf("tick %d: %g, %g", k, (double)out[0].voltage_V, (double)out[1].voltage_V);
            return 1;
        }
    }
    return (out[0].voltage_V == 0.0f) ? 2 : 0;
}
