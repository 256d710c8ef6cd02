#include "controller.h"
#include <stdio.h>
int main(void)
{
    printf("state %zu bytes, input %zu bytes, output %zu bytes.", sizeof(drive_controller_state),
           sizeof(drive_controller_input), sizeof(drive_controller_output));
    return 0;
}
