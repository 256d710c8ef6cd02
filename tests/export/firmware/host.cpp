#include "one/controller.hpp"
#include "two/controller.hpp"
#include <cstdio>
int main()
{
    const one::Controller::Input at_rest = one::Controller::Input();
    one::Controller first(at_rest), second(at_rest);
    two::Controller other((two::Controller::Input()));
    one::Controller::Input in = at_rest;
    in.command_rad = 0.1f;
    for (int k = 0; k < 50; k += 1) { (void)first.step(in); }
    second.restore(first.state());
    const bool same = first.step(in).voltage_V == second.step(in).voltage_V;
    std::printf("%d|%d|%s|%s", (int)same, ONE_CONTROLLER_FLAG_VOLTAGE, ONE_CONTROLLER_DESIGN_HASH,
                TWO_CONTROLLER_DESIGN);
    return other.step(two::Controller::Input()).flags;
}
