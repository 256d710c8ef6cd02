"""Servo drives as data, and their linear loops, margins and bandwidths.

Start with a design: a shipped name, or the path of a design file (``actuator-lti init`` writes one).
From it come the loops, from these the margins:

>>> from actuator_lti import assemble_loops, load_design, stability_margins
>>> design = load_design("ilr33-amber")
>>> loops = assemble_loops(design)
>>> margins = stability_margins(loops.position.open_loop)
>>> margins.stable, round(margins.phase_margin_deg, 1)
(True, 78.4)

Change a value in its own unit and look again:

>>> faster = design.with_values({"control.position.gain": "200 1/s"})
>>> round(stability_margins(assemble_loops(faster).position.open_loop).phase_margin_deg, 1)
68.6

``loops.position.plot_bode()`` draws it, `nonlinear.simulate` moves it, `analyses` asks it questions, and
every loop is a python-control system: ``control.bode_plot(loops.position.open_loop)``.

The public names are loaded on first use, so that ``import actuator_lti`` costs nothing.
"""

from actuator_lti.start.on_first_use import on_first_use

_PUBLIC = {
    "InputError": "actuator_lti.errors",
    "NumericalError": "actuator_lti.errors",
    "Design": "actuator_lti.design.model",
    "load_design": "actuator_lti.design",
    "read_design_text": "actuator_lti.design",
    "write_design": "actuator_lti.design",
    "sweep": "actuator_lti.design",
    "SweepPoint": "actuator_lti.design",
    "assemble_loops": "actuator_lti.loops",
    "plant": "actuator_lti.loops.bare_plant",
    "Loop": "actuator_lti.loops",
    "Loops": "actuator_lti.loops",
    "DelaySystem": "actuator_lti.systems.delay_system",
    "onset": "actuator_lti.loops.limiters",
    "delay_budget": "actuator_lti.loops.delay_budget",
    "stability_margins": "actuator_lti.margins",
    "StabilityMargins": "actuator_lti.margins",
    "closed_loop_bandwidth": "actuator_lti.bandwidth",
    "step_figures": "actuator_lti.step",
    "unwrapped_phase_deg": "actuator_lti.systems.phase",
}

__getattr__, __dir__ = on_first_use(__name__, _PUBLIC)
