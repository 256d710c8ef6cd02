"""What is not wrong in a design but suspicious: one line each, for the report and the terminal."""

from collections.abc import Iterator
from contextlib import suppress
from math import inf, isfinite, pi, sqrt

from actuator_lti.design.checks_plant import as_one_constant
from actuator_lti.design.data_sheet import FROM
from actuator_lti.design.field import unit_on
from actuator_lti.design.loader import as_design
from actuator_lti.design.model import Design, Requirement
from actuator_lti.design.plant import no_load_speed, torque_per_command
from actuator_lti.design.reader import GAINS
from actuator_lti.design.writing import read_value
from actuator_lti.errors import InputError

_BACK_EMF = "back_emf_constant"
GRADES = {"", "A", "B", "C", "D", "X"}  # of a source, or several with "/" between


def warnings_of(design: Design) -> tuple[str, ...]:
    """Everything suspicious in a design, each as one line that begins with the key.

    >>> from actuator_lti.design import load_design
    >>> warnings_of(load_design("ilr33-amber"))
    ()
    """
    design = as_design(design)
    checks = (
        _sampling, _crossovers, _limits, _unseen, _loads, _asked_for, _pedigree, _encoder,
        elastic_warnings, kept_gains,
    )  # fmt: skip
    return tuple(line for check in checks for line in check(design))


def _periods(design: Design) -> dict[str, float]:
    return {stage: design.controller.period_of(stage) for stage in reversed(design.controller.stages)}


def _sampling(design: Design) -> Iterator[str]:
    for name, period in _periods(design).items():
        integral = getattr(design.controller, name).integral_time_s
        if integral is not None and integral < period:
            yield f"control.{name}.integral_time: {integral:g} s is shorter than the period, {period:g} s"
    current, resistance = design.controller.current, design.effective_motor.resistance_ohm
    if current is not None and current.integral_time_s is None and current.law is None and resistance:
        error = (1.0 - current.resistance_feedforward) / (1.0 + current.gain_V_A / resistance)
        if error >= 0.1:
            ratio = f"gain/R is {current.gain_V_A / resistance:.3g}"
            short = f"the current is {100.0 * error:.3g} % short at rest"
            yield f"control.current.integral_time: not given, and {ratio}: {short}"
    ticks = design.controller.computing_delay_s / design.controller.period_s
    if ticks > 2:
        yield f"control.computing_delay: {ticks:.3g} ticks is unusually long (1 to 2 are common)"


def _estimated_crossovers(design: Design) -> dict[str, float]:
    """First estimates of the loops' crossovers in rad/s, from the asymptotes; only for warnings."""
    control, motor = design.controller, design.effective_motor
    result: dict[str, float] = {}
    if control.current is not None and motor.inductance_H is not None:
        result["current"] = control.current.gain_V_A / motor.inductance_H
    if control.velocity is not None:
        result["velocity"] = control.velocity.gain * torque_per_command(design) / design.inertia_kgm2
        if control.position is not None:
            result["position"] = control.position.gain
    if control.own_law is not None:  # has no crossover that a gain tells
        result.pop(control.own_law[0], None)
    return result


def _crossovers(design: Design) -> Iterator[str]:
    crossovers = _estimated_crossovers(design)
    for name, period in _periods(design).items():
        nyquist = pi / period
        if crossovers.get(name, 0.0) > 0.4 * nyquist:
            near = f"crossover near {crossovers[name]:.3g} rad/s, too close to the loop's Nyquist frequency"
            yield f"control.{name}.gain: {near} of {nyquist:.3g} rad/s"
    for inner, outer in (("current", "velocity"), ("velocity", "position")):
        if crossovers.get(outer, 0.0) > crossovers.get(inner, inf):
            above = f"crossover near {crossovers[outer]:.3g} rad/s lies above that of the {inner} loop"
            yield f"control.{outer}.gain: {above} inside it, {crossovers[inner]:.3g} rad/s"
    own = design.controller.own_law
    if own is not None and (size := max(abs(own[1].poles), default=0.0)) > 1.0 + 1e-9:
        yield f"control.{own[0]}.law: unstable of itself, a pole of size {size:.6g}"


def _limits(design: Design) -> Iterator[str]:
    peak, resistance = design.limits.peak_current_A, design.effective_motor.resistance_ohm
    stall = inf if resistance is None else design.limits.voltage_V / resistance
    if stall < peak < inf:
        digits = next(n for n in range(3, 18) if float(f"{stall:.{n}g}") < float(f"{peak:.{n}g}"))
        only = f"the supply gives only {stall:.{digits}g} A at stall"
        yield f"limits.peak_current: {peak:.{max(digits, 6)}g} A, but {only}"
    speed, top = design.limits.speed_rad_s, no_load_speed(design)
    if top < speed < inf and design.controller.velocity is not None:
        unit = unit_on(design.axis, "{angle}/s")
        turns = "" if design.axis == "linear" else f" ({top * 30.0 / pi:.5g} rpm)"
        volts, kE = design.limits.voltage_V, design.effective_motor.back_emf_constant_Vs_rad
        only = f"U/kE = {volts:.4g} V/({kE:.4g} V/({unit})) = {top:.4g} {unit}{turns}"
        yield f"limits.speed: {speed:.4g} {unit}, but the supply reaches only {only}"
    if isfinite(peak) and design.controller.current is None:
        yield "limits.peak_current: clamps nothing, the design has no current loop"
    for key, value in (("speed", speed), ("acceleration", design.limits.acceleration_rad_s2)):
        if design.controller.velocity is None and isfinite(value):
            yield f"limits.{key}: clamps nothing, the design has no velocity loop"
    if design.friction.law == "tanh" and design.friction.breakaway_ratio != 1.0:
        yield "friction.breakaway_ratio: not used by the tanh law"


def _unseen(design: Design) -> Iterator[str]:
    """Counts that were set, and are not only quoted of a data sheet, where no loop sees them."""
    control, ideal = design.controller, design.encoder.speed == "ideal"
    if control.own_law is not None:  # takes the angles that it likes
        return
    speed = None if control.velocity is None or ideal else control.velocity.sensor
    unseen = {"encoder": speed != "motor", "output_encoder": speed != "output"}
    unseen["output_encoder"] &= control.position is None or control.position.sensor != "output"
    for sensor in (name for name in unseen if unseen[name]):
        counts = design.parameters.get(f"{sensor}.counts_per_rev")
        if counts is not None and counts.source[:7] in ("", "changed"):
            why = "encoder.speed is ideal" if ideal else "the speed is not made of them"
            why = why if sensor == "encoder" else "no loop has this sensor"
            yield f"{sensor}.counts_per_rev: acts on nothing, {why}"


def _loads(design: Design) -> Iterator[str]:
    from actuator_lti.drive.facts import stall_torque_Nm

    for gear in design.gears if design.total_ratio < 1.0 else ():
        if gear.ratio < 1.0:
            faster = f"{gear.ratio:.4g} turns the output faster than the motor"
            yield f'gear.{gear.name}.ratio: {faster}; a reduction is written "{1.0 / gear.ratio:.6g}:1"'
    largest, given = design.load.moment_max_Nm, stall_torque_Nm(design)
    unit, holding = unit_on(design.axis, "{torque}"), given * design.total_ratio
    losses = design.parameters.get("friction.load_coefficient")
    if losses is not None and losses.source.startswith(FROM) and design.load.path == "self-locking":
        lost = losses.value * design.total_ratio
        if 0.0 < lost < 2.0:
            gears = f"gears of {100 / lost:.3g} % are not (only below 50 %)"
            yield f'load.path: self-locking, which {gears}; load.path = "back-drivable"?'
    if design.load.path == "back-drivable" and largest > holding:
        most = f"{holding:.3g} {unit} at its peak current without losses"
        yield f"load.moment_max: {largest:g} {unit} is more than the drive can hold, {most}"
    needed = max(design.friction.dry_Nm(largest, direction) for direction in (1, -1))
    if design.load.path != "back-drivable" and needed > given:
        more = f"its friction at the motor, {needed:.3g} {unit}, is more than the motor gives"
        yield f"load.moment_max: {largest:g} {unit} holds the drive fast: {more}, {given:.3g} {unit}"
    asked = [("validation.loads", load) for load in design.validation.loads_Nm]
    asked += [(f"requirement.{item.id}.load", item.load_Nm or 0.0) for item in design.requirements]
    for key, load in asked:
        yield from beyond_largest(design, key, load)


def beyond_largest(design: Design, key: str, load_Nm: float) -> Iterator[str]:
    """What is said of a load that is asked for and lies above the largest one of the design."""
    largest, unit = design.load.moment_max_Nm, unit_on(design.axis, "{torque}")
    if abs(load_Nm) > largest:
        stated = f"= {largest:g} {unit}" if largest else "of 0: the largest load is not stated"
        yield f"{key}: {load_Nm:g} {unit} lies above load.moment_max {stated}"


def elastic_warnings(design: Design) -> Iterator[str]:
    """A rigid self-locking drive that cannot lock its load, and a spring that nothing damps."""
    behind, load, coupling = design.load.friction, design.load, design.coupling
    rubs = behind is not None and behind.dry_torque_Nm > 0.0
    viscous = behind is not None and behind.viscous_Nms_rad > 0.0
    free, damped = not (rubs or viscous), load.moment_damping_Nms_rad > 0.0
    unit = unit_on(design.axis, "{torque}*s/{angle}")
    if coupling is not None and not (viscous or damped) and coupling.damping_Nms_rad == 0.0:
        least = 0.02 * sqrt(coupling.stiffness_Nm_rad * design.load_side_inertia_kgm2)  # 2 zeta sqrt(k J)
        but = " (its dry friction is in no linear loop)" if rubs else ""
        yield (
            "coupling.damping: 0, and no load.friction.viscous: with the motor at rest the load keeps ringing"
            f"{but}; {least:.3g} {unit} damps it by 1 %"
        )
    elif free and coupling is not None and coupling.play_rad > 0.0 and not damped:
        yield "coupling.play: in the gap nothing stops a load without load.friction, it may never rest"
    least, coefficient = 1.0 / design.total_ratio, design.friction.load_coefficient
    if coupling is None and load.path == "self-locking" and coefficient < least * (1 - 1e-12):
        held = 'self-locking drive cannot hold its load; or is load.path = "back-drivable"?'
        less = f"{coefficient:g} is less than 1/N = {least:g}"
        bare = 'which a drive without gears is not; load.path = "back-drivable"?'
        yield (
            f"friction.load_coefficient: {less}: the friction of a {held}"
            if design.gears or "load.path" in design.written
            else f"load.path: self-locking is assumed, {bare}"
        )


def _asked_for(design: Design) -> Iterator[str]:
    """Angles that decide the sign of a stiffness; requirements beyond what the command's profile asks for."""
    said = design.parameters
    if design.motor.cogging_Nm != 0.0 and "motor.cogging_phase" not in said:
        drives = "at angle 0 cogging drives the motor away; 180 deg: it holds"
        yield f"motor.cogging_phase: not given, 0 assumed: {drives}"
    if design.load.gravity is not None and "load.gravity.offset" not in said:
        drives = "at angle 0 the mass stands upright, and gravity drives it away; 180 deg: it hangs"
        yield f"load.gravity.offset: not given, 0 assumed: {drives}"
    for one in design.requirements:
        if one.minimum is not None and (reason := beyond_profile(design, one, one.minimum)):
            yield f"requirement {one.id}: at least {one.minimum:.4g} {one.unit}, but {reason}"


def beyond_profile(design: Design, requirement: Requirement, value: float) -> str:
    """What the command's profile says to a required rate or acceleration; empty where it asks for as much."""
    command, turned = design.command, 180.0 / pi if design.axis == "rotary" else 1.0
    rate, acceleration = command.rate_rad_s * turned, command.acceleration_rad_s2 * turned
    most = {"output_rate": ("rate", rate), "acceleration": ("acceleration", acceleration)}
    key, asked = most.get(requirement.quantity, ("", inf))
    unit = requirement.unit
    return f"command.{key} lets no command ask for more than {asked:.4g} {unit}" if value > asked else ""


def _pedigree(design: Design) -> Iterator[str]:
    if "validation.full_deflection" not in design.parameters:
        yield "validation.full_deflection: not given, 10 deg (linear axis: 0.01 m) assumed"
    plant = ("motor.", "gear.", "load.", "friction.")
    for path, item in design.parameters.items():
        if not set(item.grade.split("/")) <= GRADES:
            yield f"{path}: grade {item.grade[:20]!r} is none of A, B, C, D, X"
        if item.grade == "X" and item.tolerance is None and path.startswith(plant):
            yield f"{path}: an assumed value (grade X) without a tolerance"


def kept_gains(design: Design) -> Iterator[str]:
    """Gains read from what they did with the drive as it was (model.md section 11) and do no more."""
    for path in GAINS:
        item = design.parameters.get(path)
        if item is None or not item.source.startswith("from "):
            continue
        said = item.source.partition("; ")[0].removeprefix("from ")
        with suppress(InputError):  # of a source that a user wrote
            now, unit = read_value(design, path, said), item.text.partition(" ")[2]
            if abs(now - item.value) > 1e-9 * item.value:
                kept = f"keeps {item.value:.4g} {unit}, which was {said} before a change"
                yield f"{path}: {kept}; {said} would now be {now:.4g} {unit}"


def _encoder(design: Design) -> Iterator[str]:
    """Counts that are coarse; a back-EMF constant that is taken: nothing tells a wrong convention."""
    quantum, encoder, top = design.angle_quantum_rad, design.encoder, design.limits.speed_rad_s
    if encoder.speed == "difference" and quantum is not None and design.controller.velocity is not None:
        step = quantum / (encoder.difference_samples * design.controller.period_of("velocity"))
        if isfinite(top) and step > 0.05 * top:
            unit = unit_on(design.axis, "{angle}/s")
            yield f"encoder.counts_per_rev: one count is {step:.3g} {unit}, more than 5 % of limits.speed"
    if design.motor.back_emf_constant_Vs_rad is None and (same := as_one_constant(_BACK_EMF, design)):
        yield f"motor.{_BACK_EMF}: not given; {same}: a wrong motor.constants would not show"
