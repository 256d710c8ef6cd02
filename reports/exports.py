"""The drive outside of Python: the running one as C99 or as an FMU, the linear one as state spaces.

The compiled code is measured.
"""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from actuator_lti.asked.verdict import Verdict
from actuator_lti.design import write_design
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.files.atomic import write_bytes, write_together
from analyses.linear.code_check import CodeCheck, check_code
from nonlinear.export import PLATFORMS, c_export, controller_export, fmu_bytes, refuse_unknown
from reports.cli.options import folder_for_results, refuse_existing
from reports.cli.output import note_if_slow
from reports.export_requests import AskedC, AskedController, AskedFmu, AskedLinear
from reports.html import environment, page
from reports.linear_models import FORMS, SUFFIXES, linear_models, written_models
from reports.model_picture import model_png
from reports.provenance import package_version
from reports.sections.validation import loop_name, quantity_name


@dataclass(frozen=True)
class Exported:
    """What was written, in words too, and what the check of the compiled code has found, if asked for."""

    files: tuple[str, ...]
    words: str
    check: CodeCheck | None = None

    @property
    def verdict(self) -> Verdict | None:
        """Of the compiled code; ``None`` where it was not measured."""
        return None if self.check is None or self.check.reason else Verdict.of(not self.check.failed)

    def __str__(self) -> str:
        return "\n".join([self.words, *([summary(self.check)] if self.check else [])])


def export_c(design: Design, asked: AskedC) -> Exported:
    """Write what `AskedC` says; refused where there are such files already, or the prefix is no name."""
    folder_for_results(asked.target)
    texts = c_export(design, single_precision=asked.single, prefix=asked.prefix)
    _refuse_any(asked, texts)
    check = _checked(design) if asked.check else None
    texts["README.md"] += "\n" + check_text(check, single_precision=asked.single)
    return _put(asked.target, texts, check)


def export_controller(design: Design, asked: AskedController) -> Exported:
    """Write what `AskedController` says; refused as by `export_c`."""
    folder_for_results(asked.target)
    texts = controller_export(design, single_precision=asked.number == "float", prefix=asked.prefix)
    _refuse_any(asked, texts)
    return _put(asked.target, texts)


def export_fmu(design: Design, asked: AskedFmu) -> Exported:
    """Write what `AskedFmu` says; refused where there is such a file, for an unknown version or platform."""
    target = asked.target or Path(f"{design.name}.fmu")
    refuse_existing(target, asked.force)
    platforms = tuple(dict.fromkeys(asked.platform or PLATFORMS))
    refuse_unknown(asked.version, platforms)
    check = _checked(design) if asked.check and not asked.plain else None
    data = fmu_bytes(
        design,
        asked.version,  # type: ignore[arg-type]
        platforms,
        documents={} if asked.plain else export_documents(design, check),
        picture=model_png(design),
        tool=f"actuator-lti {package_version()}",
    )
    write_bytes(target, data)
    words = f"{target}: FMI {asked.version}.0 co-simulation, {', '.join(platforms)}, {len(data)} bytes"
    return Exported((str(target),), words, check)


def export_linear(design: Design, asked: AskedLinear) -> Exported:
    """Write what `AskedLinear` says; refused where there is such a file already."""
    suffix = SUFFIXES[asked.to]
    target = asked.target or Path(f"{design.name}-linear{suffix}")
    if target.suffix.lower() in {*SUFFIXES.values()} - {suffix}:
        raise InputError(f"target = '{target}': --to is {asked.to}; allowed: a name that ends in {suffix}")
    refuse_existing(target, asked.force)
    tree = linear_models(design)
    data = written_models(tree, asked.to)
    write_bytes(target, data)
    forms = [form for form in FORMS if form in tree]
    named = [*tree["sampled"]["loops"], *tree["sampled"]["break_points"], *tree["sampled"]["responses"]]
    behind = tree["sampled"]["responses"].get("command", {}).get("behind_mean_of_samples", 1)
    mean = f" (behind the mean of {behind} samples of the command, which limits its jerk)" * (behind > 1)
    said = f"{target}: {', '.join(named)}{mean}, {' and '.join(forms)}, {len(data)} bytes"
    return Exported((str(target),), said)


def _refuse_any(asked: AskedC | AskedController, names: Iterable[str]) -> None:
    for name in names:
        refuse_existing(asked.target / name, asked.force)


def _put(folder: Path, texts: Mapping[str, str], check: CodeCheck | None = None) -> Exported:
    write_together({folder / name: text.encode() for name, text in texts.items()})
    return Exported(tuple(str(folder / name) for name in texts), f"{folder}: {', '.join(texts)}", check)


def _checked(design: Design) -> CodeCheck:
    with note_if_slow("measuring the margins of the compiled code (--no-check leaves it out)"):
        return check_code(design)


def export_documents(design: Design, check: CodeCheck | None = None) -> dict[str, bytes]:
    """Files by name: the margin report, the margins measured on the code, the design as TOML, the licence."""
    from reports.build import design_report

    return {
        "index.html": page(design_report(design)).encode(),
        "compiled_code.md": check_text(check).encode(),
        f"{design.name}.toml": write_design(design).encode(),
        "licenses/license.txt": licence_text().encode(),
    }


def licence_text() -> str:
    """The licence of this package, under which the exported sources stand too."""
    beside = Path(__file__).resolve().parent.parent / "LICENSE"
    if beside.is_file():
        return beside.read_text(encoding="utf-8")
    with suppress(PackageNotFoundError):
        return distribution("actuator-lti").read_text("licenses/LICENSE") or "MIT"
    return "MIT"


GROUPS = (
    ("response", "(relative)", ("response",)),
    ("gain margin", "(factor)", ("gain_margin", "gain_margin_up", "gain_margin_down")),
    ("phase margin", "deg", ("phase_margin",)),
    ("delay margin", "s", ("delay_margin",)),
)


def check_text(check: CodeCheck | None, *, single_precision: bool = False) -> str:
    """The section of a README, as Markdown; without a check it was not asked for.

    What is measured is the code in double precision, also where the files are in single.
    """
    words = {"summary": summary, "loop_name": loop_name, "quantity_name": quantity_name}
    template = environment().get_template("compiled_code.md.j2")
    return template.render(check=check, single_precision=single_precision, **words)


def summary(check: CodeCheck) -> str:
    """One sentence: how many predictions are met, and the largest differences of the margins."""
    if check.reason:
        return f"margins of the compiled code: not measured ({check.reason})"
    worst = [(name, unit, check.largest(*quantities)) for name, unit, quantities in GROUPS]
    words = [f"{name} {of.error:.2g} {unit} ({loop_name(of.loop)})" for name, unit, of in worst if of]
    ends = f"; largest difference: {', '.join(words)}" if words else ""
    met = f"{len(check.entries) - len(check.failed)} of {len(check.entries)}"
    return f"{met} predictions of the linear loops are met by the compiled code{ends}."
