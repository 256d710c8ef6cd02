"""`actuator-lti export fmu`: the drive as a co-simulation unit, sources and binaries in one file."""

import hashlib
import io
import math
import uuid
import zipfile
from collections.abc import Mapping, Sequence
from typing import Literal

from actuator_lti.compiled.compiler import compile_files
from actuator_lti.compiled.kinds import c_float
from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from nonlinear.export import variables as of
from nonlinear.export.c_files import c_export, exported_row, spare_parameters
from nonlinear.export.model_description import MODEL, build_description, description
from nonlinear.export.program import c_text, filled, template
from nonlinear.export.relations import relation_functions
from nonlinear.export.trace import KeyTrace, trace_keys
from nonlinear.native import parameters

Version = Literal[2, 3]
_BUILDS = {  # folder of FMI 3.0 (that of FMI 2.0 is the platform), library, flags of the compiler
    "linux64": ("x86_64-linux", f"{MODEL}.so", ("-shared", "-fPIC", "-fvisibility=hidden", "-s")),
    "win64": ("x86_64-windows", f"{MODEL}.dll", ("-shared", "-fvisibility=hidden", "-s")),
}
PLATFORMS = (*_BUILDS,)


def fmu_bytes(
    design: AnyDesign,
    version: Version = 2,
    platforms: Sequence[str] = PLATFORMS,
    *,
    documents: Mapping[str, bytes] | None = None,
    picture: bytes | None = None,
    tool: str = "actuator-lti",
) -> bytes:
    """The unit as one file; the same input gives the same bytes with the same compilers.

    ``version``: of FMI, 2 or 3.
    ``platforms``: binaries to compile; ziglang's compiler is needed for those of another system.
    ``documents``: files of the documentation folder, by name.
    ``picture``: PNG of the model: ``model.png`` (FMI 2.0), ``documentation/diagram.png`` (FMI 3.0).
    ``tool``: name and version for the model description.

    Raises `InputError`: for an unknown version or platform, or without a compiler.
    """
    design = as_design(design)
    refuse_unknown(version, platforms)
    trace = trace_keys(design)
    variables = of.variables_of(design, trace)
    texts = _sources(design, trace, version)
    names = [name for name in texts if name.endswith(".c")]
    digest = hashlib.sha256("".join([*texts.values(), repr(variables)]).encode()).digest()
    token = f"{{{uuid.UUID(bytes=digest[:16])}}}"  # another program or other variables change it
    files = {"modelDescription.xml": description(design, variables, token, version, names, tool)}
    texts["fmu_design.h"] = texts["fmu_design.h"].replace("@TOKEN@", token)
    for platform in platforms:
        folder, library, flags = _BUILDS[platform]
        place = f"binaries/{platform if version == 2 else folder}/{library}"
        files[place] = compile_files(texts, library, platform, flags)
    files |= {f"sources/{name}": text.encode() for name, text in texts.items()}
    if version == 3:
        files["sources/buildDescription.xml"] = build_description(names)
    files |= {f"documentation/{name}": data for name, data in (documents or {}).items()}
    if picture is not None:
        files["model.png" if version == 2 else "documentation/diagram.png"] = picture
    return _zipped(files)


def refuse_unknown(version: int, platforms: Sequence[str]) -> None:
    """Refuse a version or a platform that there is not, by an `InputError` that says what is allowed."""
    if version not in (2, 3):
        raise InputError(f"fmi = {version}: allowed: 2 or 3")
    for platform in platforms:
        if platform not in PLATFORMS:
            raise InputError(f"platform = {platform!r}: allowed: {', '.join(PLATFORMS)}")


def _sources(design: Design, trace: KeyTrace, version: Version) -> dict[str, str]:
    texts = c_export(design)
    sizes: dict[str, int | str] = {
        "SPARE": spare_parameters(parameters(exported_row(design))[0]),
        "KEYS": len(trace.keys),
        "CONSTANTS": len(trace.constants),
        "TEXTS": len(of.texts_of(design)),
        **{name: getattr(of, name) for name in ("FIRST_KEY", "FIRST_CONSTANT", "FIRST_TEXT")},
        "SUPPLY_VOLTAGE": c_float(of.supply_voltage(design)),
    }
    return {
        **{name: texts[name] for name in ("drive.h", "drive.c", "drive_design.h", "drive_design.c")},
        "fmu_design.h": filled("fmu_design.h", {name: str(value) for name, value in sizes.items()}),
        "fmu_design.c": filled("fmu_design.c", _source_values(design, trace)),
        "fmu_core.h": template("fmu_core.h"),
        "fmu_core.c": filled("fmu_core.c", {"BITS": ", ".join(map(str, of.FLAG_BITS))}),
        f"fmi{version}.c": template(f"fmi{version}.c"),
    }


def _source_values(design: Design, trace: KeyTrace) -> dict[str, str]:
    """What stands for the words of ``fmu_design.c``."""
    keys = [
        f"    {{{c_float(key.value)}, {c_float(key.low)}, {c_float(key.high)}, {int(key.fixed)}, "
        f"{int(key.whole)}}}, /* {key.path} */"
        for key in trace.keys
    ]
    numbers = [(key, key.value if math.isfinite(key.value) else 0.0) for key in trace.constants]
    constants = [f"    {{{c_float(value)}, {int(key.whole)}}}, /* {key.path} */" for key, value in numbers]
    texts = [f"    {c_text(value)}, /* {path} */" for path, value, _ in of.texts_of(design)]
    lines = [f"    {line}" for line in trace.lines]
    parts = {"KEYS": keys, "CONSTANTS": constants, "TEXTS": texts, "LINES": lines}
    relations = _relations_text(relation_functions(design, trace.keys))
    return {name: "\n".join(each) for name, each in parts.items()} | {"RELATIONS": relations.rstrip("\n")}


def _relations_text(relations: Sequence[Sequence[str]]) -> str:
    """One function a check, and one that calls them."""
    arguments, calls, texts = "const double *k, char *why, size_t size", "", []
    for number, lines in enumerate(relations):
        body = "\n".join(f"    {line}" for line in lines)
        texts.append(f"static int related_{number}({arguments})\n{{\n{body}\n}}\n")
        calls += f" && (related_{number}(k, why, size) != 0)"
    texts.append(f"int fmu_related({arguments})\n{{\n    return ((size > 0U){calls}) ? 1 : 0;\n}}\n")
    return "\n".join(texts)


def _zipped(files: Mapping[str, bytes]) -> bytes:
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(entry, data)
    return held.getvalue()
