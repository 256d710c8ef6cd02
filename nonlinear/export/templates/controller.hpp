// The controller of @NAME@ for C++11: no exception, no allocation.
#ifndef @PREFIX@CONTROLLER_HPP
#define @PREFIX@CONTROLLER_HPP

#include "controller.h"

namespace @namespace@ {

class Controller {
public:
    using Input = @prefix@controller_input;
    using Output = @prefix@controller_output;
    using State = @prefix@controller_state;

    explicit Controller(const Input &measured) noexcept : state_() { restart(measured); }

    // At rest at the measured angle.
    void restart(const Input &measured) noexcept { @prefix@controller_start(&state_, &measured); }

    // One tick; call it every @PREFIX@CONTROLLER_PERIOD_S.
    Output step(const Input &measured) noexcept
    {
        Output out = Output();
        @prefix@controller_step(&state_, &measured, &out);
        return out;
    }

    const State &state() const noexcept { return state_; }
    void restore(const State &state) noexcept { state_ = state; }

private:
    State state_;
};

} // namespace @namespace@

#endif
