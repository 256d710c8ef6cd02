#include "controller.h"
#include <math.h>
float sqrtf(float x)
{
    float result;
    __asm__("vsqrt.f32 %0, %1" : "=t"(result) : "t"(x));
    return result;
}
float floorf(float x)
{
    const float whole = (float)(int)x;
    return (whole > x) ? whole - 1.0f : whole;
}
static drive_controller_state state;
volatile drive_controller_input measured;
volatile drive_controller_output put_out;
void _start(void)
{
    drive_controller_input in = measured;
    drive_controller_output out;
    drive_controller_start(&state, &in);
    for (;;) {
        in = measured;
        drive_controller_step(&state, &in, &out);
        put_out = out;
    }
}
