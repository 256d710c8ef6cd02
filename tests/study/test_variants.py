"""Study files as data, and variants against their base."""

import json
import math
from dataclasses import replace

import pytest

from actuator_lti import assemble_loops, load_design, onset
from actuator_lti.batch import Population
from actuator_lti.design import with_overrides, with_values
from actuator_lti.design.model import Design, Requirement
from analyses.comparison.found import LargeSignal, figure_names
from analyses.comparison.variants import changes, compare
from analyses.monte_carlo.task import StepCheck, step_columns
from analyses.specification.capability import drive_figures
from analyses.specification.requirements import evaluate_requirements
from analyses.specification.result import step_times
from analyses.specification.sensitivity import sensitivities
from analyses.studies.study import Study, Variant, load_study, study_of, study_or_design
from reports.sections.compare import batches, brief, predictions, section
from reports.sections.compare_best import section as best_section
from reports.sections.compare_figures import tornadoes
from reports.verdict_summary import walk
from tests.changed import changed
from tests.refusals import refused

HEAD = '[study]\nname = "s"\nbase = "ilr33-amber"\n'


def study(tmp_path, text):
    """A study file of the baseline that goes on with a text."""
    path = tmp_path / "s.toml"
    path.write_text(HEAD + text)
    return path


def test_variants_sweeps_and_grids_are_listed_in_order(tmp_path):
    path = study(tmp_path, """
[[variant]]
name = "slow"
override = { "gear.worm.ratio" = 50 }
[[sweep]]
parameter = "motor.resistance"
from = "50 mohm"
to = "60 mohm"
points = 3
[[grid]]
axes = [{ parameter = "limits.voltage", values = ["11 V", "13 V"] },
        { parameter = "gear.worm.ratio", values = [30, 40] }]
[monte_carlo]
samples = 50
""")  # fmt: skip
    result = load_study(path)
    assert study_or_design(path) == result
    assert study_or_design("emps") == load_design("emps")
    assert [v.name for v in result.variants][:2] == ["slow", "motor.resistance = 0.05 ohm"]
    assert [v.design.motor.resistance_ohm for v in result.variants[1:4]] == [0.05, 0.055, 0.06]
    assert [(v.design.limits.voltage_V, v.design.total_ratio) for v in result.variants[4:]] == [
        (11, 66 * 30), (11, 66 * 40), (13, 66 * 30), (13, 66 * 40)]  # fmt: skip
    assert result.monte_carlo.samples == 50
    assert len({v.slug for v in result.all}) == len(result.all)


def test_another_motor_file_and_requirements_of_the_same_id_replace_those_of_the_base(tmp_path):
    motor = (
        'rotor_inertia = "9.2 g*cm^2"\nresistance = "0.22 ohm"\ninductance = "24 uH"\n'
        'torque_constant = "11.8 mN*m/A"\nback_emf_constant = "11.8 mV*s/rad"\n'
    )
    (tmp_path / "m.toml").write_text("[motor]\n" + motor)
    variant = 'name = "24 V winding"\nmotor = "m.toml"\noverride = { "limits.voltage" = "24 V" }\n'
    result = load_study(study(tmp_path, f"[[variant]]\n{variant}"))
    assert result.variants[0].design.motor.inductance_H == pytest.approx(24e-6)
    harder = 'id = "gain-margin"\nquantity = "gain_margin"\nloop = "every"\nminimum = "10 dB"\n'
    result = load_study(study(tmp_path, f"[[requirement]]\n{harder}"))
    limits = {r.id: r.minimum for r in result.base.design.requirements}
    assert (limits["gain-margin"], limits["phase-margin"]) == (10.0, 45.0)


@pytest.mark.parametrize(("text", "message"), [
    ("[study]\nname = 's'\n", "study.base"),
    (HEAD.replace('"s"', '""'), "study.name = ''"),
    (HEAD + "[[varient]]\n", 'did you mean "variant"'),
    (HEAD + "[[variant]]\nname = 'a'\n[[variant]]\nname = 'a'\n", "twice"),
    (HEAD + "[[variant]]\nname = 'a'\noverride = { 'motor.resistence' = '1 ohm' }\n", "resistence"),
    (HEAD + "[[variant]]\nname = 'a'\noverride = { 'motor.resistance' = '1 V' }\n", "motor.resistance"),
    (HEAD + "[[sweep]]\nparameter = 'motor.resistance'\nvalues = []\n", "values"),
    (HEAD + "[[grid]]\naxes = [{ parameter = 'limits.voltage', from='1 V', to='9 V', points=0}]\n", "points"),
    (HEAD + "[monte_carlo]\nsamples = 0\n", "samples"),
])  # fmt: skip
def test_bad_studies_are_refused_in_one_line(tmp_path, text, message):
    path = tmp_path / "s.toml"
    path.write_text(text)
    refused(load_study, path, words=("s.toml", message))


def test_a_refused_variant_is_kept_where_others_shall_go_on(tmp_path):
    path = study(tmp_path, "[[variant]]\nname = 'bad'\noverride = { 'motor.resistance' = '-1 ohm' }\n"
                 "[[variant]]\nname = 'good'\n")  # fmt: skip
    refused(load_study, path, words="bad")
    result = load_study(path, keep_going=True)
    assert [v.design is None for v in result.variants] == [True, False]
    assert "motor.resistance" in result.variants[0].error


@pytest.fixture(scope="module")
def compared(tmp_path_factory):
    path = study(tmp_path_factory.mktemp("v"), """
[[variant]]
name = "same"
override = { "motor.resistance" = "0.055 ohm" }
[[variant]]
name = "half the velocity gain"
override = { "control.velocity.gain" = "0.06 A*s/rad" }
[[variant]]
name = "two changes"
override = { "control.velocity.gain" = "0.06 A*s/rad", "control.current.gain" = "10 mohm" }
[[variant]]
name = "slower gear"
override = { "gear.worm.ratio" = 50 }
""")  # fmt: skip
    return compare(load_study(path))


def test_variants_differ_by_what_was_changed_and_by_nothing_else(compared):
    same = compared.variants[0]
    assert (same.differences, same.figures) == ({}, compared.base.figures)
    half = compared.variants[1]
    assert half.differences["velocity.gain_margin"] == pytest.approx(20 * math.log10(2))
    assert [p.path for p in half.moved_by["velocity.gain_margin"]] == ["control.velocity.gain"]
    assert "current.gain_margin" not in half.differences
    table = brief(replace(compared, variants=(half,))).blocks[1]
    rows = {row["figure"]: row["d1"] for row in table["rows"]}
    assert "(+6.02)" in rows["Velocity loop: gain margin"]
    assert not any(name.startswith("Current") for name in rows)
    both = compared.variants[2]
    current = both.moved_by["current.gain_margin"]
    assert [p.path for p in current] == ["control.current.gain"]
    assert current[0].amount == pytest.approx(both.differences["current.gain_margin"], rel=1e-6)
    shares = {p.path: p.amount for p in both.moved_by["position.phase_margin"]}
    alone = compared.variants[1].differences["position.phase_margin"]
    assert shares["control.velocity.gain"] == pytest.approx(alone, rel=1e-6)
    tables = [block for part in section(compared) for block in walk(part) if block["kind"] == "table"]
    shown = {cell for one in tables for row in one["rows"] for key, cell in row.items() if key == "unit"}
    assert {"N m/rad", "deg/s", ""} <= shown
    assert not any("*" in unit or "^" in unit for unit in shown)  # as everywhere else
    ends = {name.key: compared.ends(name) for name in compared.names}
    best, worst = ends["velocity.gain_margin"]
    assert best > worst
    best, worst = ends["velocity.sensitivity_peak"]
    assert best < worst
    assert [v.id for v in compared.variants[3].verdicts if v.verdict == "not met"] == ["output-rate"]


def test_nothing_is_best_or_worst_where_all_show_the_same_digits(tmp_path) -> None:
    """Of a gain 0.04 % higher some figures move in a digit that is shown, most in one that is not."""
    change = '[[variant]]\nname = "near"\noverride = { "control.velocity.gain" = "0.12005 A*s/rad" }\n'
    found = compare(load_study(study(tmp_path, change)), validation=False)
    rows = brief(found).blocks[1]["rows"]
    pairs = [[row[key].partition(" ")[::2] for key in ("d0", "d1")] for row in rows]
    assert {base[0] == near[0] for base, near in pairs} == {True, False}
    for (base, of_base), (near, of_near) in pairs:
        assert sorted(mark for mark in of_base + of_near if mark in "▲▽") == ["▲", "▽"] * (base != near)
    best = best_section(found)["blocks"][1]["rows"]
    assert not [row for row in best if row["worst"].endswith(f": {row['value']}")]


def test_a_changed_key_is_named_as_an_override_names_it():
    base = load_design("ilr33-amber").add_filter("velocity", kind="lowpass", frequency="400 Hz")
    for key, text in {"control.velocity.filter.1.frequency": "500 Hz", "gear.worm.ratio": "50"}.items():
        assert [(c.path, c.text) for c in changes(base, with_overrides(base, {key: text}))] == [(key, text)]


def test_requirements_are_rows_and_designs_are_columns_of_tables_that_fit_a_screen(compared):
    made = {part["id"]: part for part in section(compared)}
    table = made["verdicts"]["blocks"][0]
    labels = [column["label"] for column in table["columns"]]
    names = ["ilr33-amber", "same", "half the velocity gain", "two changes", "slower gear"]
    assert labels == ["Requirement", "Limit", *names]
    assert len(table["rows"]) == len(compared.base.verdicts)
    rate = next(row for row in table["rows"] if row["what"].startswith("Drive: output rate"))
    assert [rate[f"d{k}"]["status"] for k in range(5)] == ["pass"] * 4 + ["fail"]
    count = 5 * len(compared.base.verdicts)
    wanted = f"{count - 1} of {count} requirements met, 1 not met, over 5 designs. "
    assert made["verdicts"]["result"] == f"{wanted}Not met: slower gear, Drive: output rate at 8 N m."
    many = replace(compared, variants=compared.variants * 3)
    tables = batches(many)
    assert all(table[0] is compared.base and len(table) <= 5 for table in tables)
    assert sum(len(table) - 1 for table in tables) == 12


def test_one_page_says_which_variant_is_best_for_what_and_what_it_gives_up(compared):
    made = best_section(compared)
    assert made["result"].startswith("4 of 5 designs meet every requirement;")
    designs, best = (block["rows"] for block in made["blocks"])
    half = next(row for row in designs if row["design"] == "half the velocity gain")
    # at -1/(2 g) instead of -1/g, against a limit of 6 dB: at -10^(-6/20)
    g = 10.0 ** (compared.base.figures["velocity.gain_margin"] / 20.0)
    gained = 100.0 * (0.5 / g) / (1.0 - 10.0 ** (-6.0 / 20.0))
    assert f"Velocity loop: gain margin +{gained:.1f} %" in half["gains"]
    assert "Position loop" in half["gives"]
    margin = next(row for row in best if row["what"] == "Velocity loop: gain margin")
    most = max(compared.all, key=lambda one: one.figures["velocity.gain_margin"])
    assert margin["best"] == most.variant.name != "ilr33-amber"
    assert next(row for row in designs if row["design"] == "slower gear")["_status"] == "fail"
    rate = next(row for row in best if row["what"].startswith("Drive: output rate"))
    assert rate["worst"].startswith("slower gear")
    assert rate["best"] == "ilr33-amber; 3 equal"  # a difference that no digit shows makes none the best


def test_slopes_are_those_of_closed_forms_and_boxes_lie_about_the_value_of_the_design():
    """Gain margin falls 0.0864 dB per percent of the loop's own gain (20 log10 1.01)."""
    result = sensitivities(load_design("ilr33-amber"), ["control.velocity.gain"])
    entry = next(e for e in result.entries if e.figure == "velocity.gain_margin")
    assert entry.per_percent == pytest.approx(-20 * math.log10(math.e) / 100, rel=1e-5)
    assert entry.low - entry.high == pytest.approx(20 * math.log10(1.1 / 0.9), rel=1e-9)
    design = load_design("ilr33-amber")
    changed = replace(design, motor=replace(design.motor, resistance_ohm=0.11))
    result = sensitivities(changed, ["motor.resistance"])
    assert all(e.low_value < 0.11 < e.high_value for e in result.entries)


@pytest.mark.parametrize(("changes", "unit", "per_si"), [
    ({}, "deg/s", 180.0 / math.pi), ({"axis": "linear"}, "mm/s", 1e3),
    ({"position": True}, "deg", 180.0 / math.pi),
])  # fmt: skip
def test_an_amplitude_is_in_the_unit_of_the_command(changes, unit, per_si):
    """Of a speed drive a speed; it was shown in degrees."""
    design = load_design("ilr33-amber")
    if "position" not in changes:
        design = replace(design, controller=replace(design.controller, position=None), **changes)
    loops = assemble_loops(design)
    own = LargeSignal.plan(design)
    found = replace(own, frequencies_hz=(5.0,), loads_Nm=()).figures(design, loops)
    of_a_current_drive = replace(own, command=("rotary", "current"), step=1e-9)
    assert of_a_current_drive.figures(design, loops) == own.figures(design, loops)
    assert found["large.onset@5"] == pytest.approx(per_si * onset(loops, [10.0 * math.pi]).amplitude_rad[0])
    (name,) = figure_names([(found, design)])
    assert name.unit == unit


@pytest.mark.parametrize(("path", "value", "settled_s"), [
    ("control.position.gain", 1.0, math.log(50.0)), ("command.rate", 0.05, 0.175 / 0.05),
])  # fmt: skip
def test_steps_of_a_slow_drive_are_followed_until_they_have_settled(path, value, settled_s):
    """A lag of 1 s, and a slow profile; compared, sampled and specified steps ended before."""
    slow = with_values(load_design("ilr33-amber"), {path: value})
    full = slow.validation.full_deflection_rad
    found = LargeSignal.plan(slow).figures(slow, assemble_loops(slow))
    sampled = step_columns(StepCheck(full), Population(slow, {}, 1))["nonlinear.settling_time"]
    specified = [one.settling_time_s for one in step_times(slow) if one.fraction == 1.0]
    times = [found["large.settling_time@0"], found["large.settling_time@8"], *sampled, *specified]
    assert times == pytest.approx([settled_s] * 5, rel=0.03)


def test_designs_of_another_kind_stand_beside_the_base_in_their_own_units_and_on_their_own_loops():
    """Beside a rotary speed drive: m/s of a linear one, no difference of bandwidths of two loops."""

    def drive(design: str, loop: str, **more) -> Design:
        asked = {"id": "bw", "quantity": "bandwidth", "loop": loop, "minimum": "1 Hz"}
        return with_overrides(load_design(design), {"requirement": [asked], **more})

    speed = drive("ilr33-amber", "velocity", **{"control.position": None})
    turning, sliding = (drive(name, "position") for name in ("ilr33-amber", "ballscrew"))
    designs = {"speed": speed, "turns": turning, "slides": sliding}
    base, *others = (Variant(name, name, design, {}) for name, design in designs.items())
    made = compare(Study("s", "s", "", "s", base, tuple(others)))
    units, (turns, slides) = {name.key: name.unit for name in made.names}, made.variants
    rate = drive_figures(sliding).output_rate_rad_s
    (key,) = [key for key in slides.figures if key.startswith("drive.output_rate@0")]
    assert (slides.figures[key], units[key]) == (pytest.approx(rate), "m/s")
    assert units["drive.output_rate@0"] == "deg/s"
    paired = {key for key in slides.differences if key.startswith(("drive.", "large."))}
    assert paired == {"drive.motor_current@0", "drive.torque_margin@0"}  # A and ratios, without a load in N
    current = made.base.figures["drive.motor_current@0"] + slides.differences["drive.motor_current@0"]
    assert current == pytest.approx(drive_figures(sliding).motor_current_A)
    assert not any(key.startswith("large.") for key in turns.differences)
    sizes = {units[key] for one in made.all for key in one.figures if key.startswith("large.onset@1")}
    assert sizes == {"deg/s", "deg", "mm"}
    each, best = (block["rows"] for block in best_section(made)["blocks"])
    assert [row["gains"] for row in each] == ["the base", "nothing", "nothing"]
    assert (best[0]["best"], best[0].get("worst", "")) == ("speed", "")
    rows = {row["figure"]: [row[f"d{k}"] for k in range(3)] for row in brief(made).blocks[1]["rows"]}
    assert rows["Position loop: bandwidth"][0] is None
    assert None not in rows["Position loop: bandwidth"][1:]


def test_a_requirement_at_a_load_in_newtons_is_not_that_at_one_in_newton_metres() -> None:
    asked = {"id": "start", "quantity": "torque_margin", "minimum": 1.0}
    turning, sliding, *free = (
        evaluate_requirements(with_overrides(load_design(name), {"requirement": [asked | at]}))[0].figure
        for name, at in (("ilr33-amber", {"load": "8 N*m"}), ("ballscrew", {"load": "8 N"}),
                         ("ilr33-amber", {}), ("ballscrew", {}))
    )  # fmt: skip
    assert (turning == sliding, free[0] == free[1]) == (False, True)


def test_the_page_escapes_names_and_has_every_figure(cli, tmp_path):
    gain = 'override = { "control.position.gain" = "90 1/s" }'
    path = study(tmp_path, f'[[variant]]\nname = "<script>alert(1)</script>"\n{gain}\n')
    cli.text("compare", path, "--out", tmp_path / "o", "--quiet")
    page = (tmp_path / "o" / "compare.html").read_text()
    assert (page.count("<script>alert"), "&lt;script&gt;alert" in page) == (0, True)
    made = json.loads((tmp_path / "o" / "compare.json").read_text())
    there = {p.name for p in (tmp_path / "o").iterdir()}
    assert there == {"compare.html", "compare.json", "compare.csv", "designs"}
    kinds = [b["figure"] for s in made["sections"] for b in s["blocks"] if b["kind"] == "figure"]
    assert kinds.count("overlay") == 9
    assert "tornado" in kinds


def test_the_checks_of_every_design_stands_side_by_side(tmp_path):
    change = 'override = { "control.velocity.gain" = "0.2 A*s/rad" }\n'
    path = study(tmp_path, '[[variant]]\nname = "faster"\n' + change)
    result = compare(load_study(path), validation=True)
    assert len(result.base.checks) == len(result.variants[0].checks) > 20
    (made,) = predictions(result)
    assert made["status"] == "pass"
    first = made["blocks"][0]
    assert [column["label"] for column in first["columns"]] == ["Prediction", "Unit", "ilr33-amber", "faster"]
    assert first["rows"][0]["d0"]["status"] == first["rows"][0]["d1"]["status"] == "pass"
    assert predictions(compare(study_of(load_design("ilr33-amber")))) == []


def test_the_printed_example_is_a_study_and_23_s_stand_in_a_row_of_seconds(cli, tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(cli.text("compare", "--example"))
    assert len(load_study(path).variants) == 10
    assert "--example" in cli.refused("compare")
    # a position gain of 0.17 1/s alone settles to 2 % in ln(50)/0.17 s, the base in some 30 ms
    slow = ("--set", "control.position.gain=0.17 1/s", "--no-validate", "--quiet", "--out", tmp_path)
    said = cli("compare", "ilr33-amber", *slow).out
    row = next(line.split() for line in said.splitlines() if "settling time" in line)
    assert row[row.index("time") + 1] == "s"
    assert float(row[-3]) == pytest.approx(math.log(50.0) / 0.17, abs=0.01)
    assert float(row[-5]) == pytest.approx(0.033, abs=0.001)


MARGINS = {f"{name} margin: each parameter alone at both its ends." for name in ("gain", "phase")}


@pytest.mark.parametrize("asked", ["overshoot", "rise_time", "settling_time", ""])
def test_what_has_no_slope_has_no_tornado(asked):
    """Figures of the step; and those of the response to a command behind the mean of a limited jerk."""
    needs = [Requirement(id=asked, quantity=asked, unit="s", loop="position", maximum=9.0)] if asked else []
    profile = {"rate_rad_s": 1.0, "acceleration_rad_s2": 50.0, "jerk_rad_s3": 2000.0}
    design = changed(load_design("ilr33-amber"), requirements=tuple(needs), command=profile)
    made = tornadoes(compare(study_of(design)))
    shown = [block["caption"] for block in walk(made) if block["kind"] == "figure"]
    assert {words.partition(" loop")[0] for words in shown} == {"Current", "Velocity", "Position"}
    assert {words.partition(": ")[2] for words in shown if words.startswith("Position")} <= MARGINS
