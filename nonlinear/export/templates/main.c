/*
 * Example: the drive answers a small step of its command; one line a tick, in comma-separated columns.
 *
 *     cc -std=c99 -O2 -ffp-contract=off main.c drive.c @prefix@design.c -lm -o drive
 *     ./drive 1000 0.01
 */
#include "drive.h"
#include "@prefix@design.h"

#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv)
{
    static @REAL@ p[@PREFIX@P_LENGTH];
    static @REAL@ s[@PREFIX@S_LENGTH];
    static @REAL@ io[DRIVE_IO_LENGTH];
    const long ticks = (argc > 1) ? strtol(argv[1], NULL, 10) : 1000L;
    const @REAL@ command = (@REAL@)((argc > 2) ? strtod(argv[2], NULL) : 0.01);
    int status = DRIVE_OK;

    @prefix@load_design(p);
    drive_prepare_sizes(p);
    drive_derive(p, s);
    drive_init(p, s);
    (void)printf("time_s,output_angle,motor_speed_rad_s,current_A,voltage_V,flags\n");
    for (long k = 0; (k < ticks) && (status == DRIVE_OK); k += 1) {
        io[DRIVE_IN_COMMAND] = command; /* held over the tick */
        io[DRIVE_IN_LOAD] = (@REAL@)0; /* hinge moment beside that of the design */
        io[DRIVE_IN_TORQUE] = (@REAL@)0; /* extra torque at the motor shaft */
        status = drive_tick(p, s, io);
        (void)printf("%.17g,%.17g,%.17g,%.17g,%.17g,%d\n", (double)k * (double)p[DRIVE_PERIOD],
                     (double)io[DRIVE_IO_OUTPUT], (double)io[DRIVE_IO_SPEED], (double)io[DRIVE_IO_CURRENT],
                     (double)io[DRIVE_IO_VOLTAGE], (int)io[DRIVE_IO_FLAGS]);
    }
    return (status == DRIVE_OK) ? EXIT_SUCCESS : EXIT_FAILURE;
}
