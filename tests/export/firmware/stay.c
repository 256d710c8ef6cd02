#include "controller.h"
int main(void)
{
    drive_controller_state state;
    drive_controller_output out = {0};
    drive_controller_input in = {0};
    in.output_angle_rad = 0.5f;
    in.output_counts = 41722; /* floor(0.5 * 524288/(2 pi)) */
    in.motor_counts = 1234; /* an incremental encoder: of another zero */
    in.command_rad = 0.5f;
    drive_controller_start(&state, &in);
    for (int k = 0; k < 400; k += 1) {
        drive_controller_step(&state, &in, &out);
        if (out.speed_command_rad_s > 0.5f || out.speed_command_rad_s < -0.5f) {
            return 1;
        }
    }
    return 0;
}
