"""``modelDescription.xml`` of FMI 2.0 and 3.0 from one list of variables."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence

from actuator_lti.design.model import Design
from actuator_lti.design.units import parse_unit
from nonlinear.export.trace import LARGEST_INTEGER
from nonlinear.export.variables import INITIAL_ANGLE, Variable

TIME = 0  # value reference of the independent variable (FMI 3.0)
MODEL = "drive"  # name of the library and of its source folder
_BASE = {"[mass]": "kg", "[length]": "m", "[time]": "s", "[current]": "A", "[angle]": "rad",
         "[temperature]": "K", "[celsius]": "K"}  # fmt: skip


def description(
    design: Design, variables: Sequence[Variable], token: str, version: int, sources: Sequence[str], tool: str
) -> bytes:
    """The model description of FMI 2 or 3; ``sources`` are the C files of FMI 2, ``token`` its GUID."""
    root = _root(design, token, sources, version, tool)
    root.append(_units(variables, version))
    log = ET.SubElement(root, "LogCategories")
    ET.SubElement(log, "Category", name="logStatusError", description="reasons of errors")
    period = repr(design.controller.period_s)
    ET.SubElement(root, "DefaultExperiment", startTime="0", stopTime="1", stepSize=period)
    _variables(root, variables, version)
    _structure(root, variables, version)
    return _written(root)


def _written(root: ET.Element) -> bytes:
    ET.indent(root)
    return ET.tostring(root, encoding="UTF-8", xml_declaration=True)


def _root(design: Design, token: str, sources: Sequence[str], version: int, tool: str) -> ET.Element:
    of_token, state = ("guid", "FMUstate") if version == 2 else ("instantiationToken", "FMUState")
    about = {
        "fmiVersion": f"{version}.0",
        of_token: token,
        "modelName": design.name,
        "description": design.title,
        "version": design.revision or "1",
        "generationTool": tool,
        "variableNamingConvention": "structured",
    }
    root = ET.Element("fmiModelDescription", about)
    can = {"modelIdentifier": MODEL, f"canGetAndSet{state}": "true", f"canSerialize{state}": "true"}
    simulation = ET.SubElement(root, "CoSimulation", can, canHandleVariableCommunicationStepSize="true")
    if version == 3:
        simulation.set("fixedInternalStepSize", repr(design.controller.period_s))
        return root
    simulation.set("canNotUseMemoryManagementFunctions", "true")
    files = ET.SubElement(simulation, "SourceFiles")
    for name in sources:
        ET.SubElement(files, "File", name=name)
    return root


def _units(variables: Sequence[Variable], version: int) -> ET.Element:
    names = sorted({item.unit for item in variables if item.unit != "1"} | ({"s"} if version == 3 else set()))
    definitions = ET.Element("UnitDefinitions")
    for name in names:
        unit = ET.SubElement(definitions, "Unit", name=name)
        result = parse_unit(name)
        powers = {_BASE[part]: str(power) for part, power in result.dimension}
        if result.factor != 1.0:
            powers["factor"] = repr(result.factor)
        if "celsius" in str(result.dimension):
            powers["offset"] = "273.15"
        ET.SubElement(unit, "BaseUnit", powers)
        for shown in sorted({item.shown for item in variables if item.unit == name} - {""}):
            factor = parse_unit(name).factor / parse_unit(shown).factor
            ET.SubElement(unit, "DisplayUnit", name=shown, factor=repr(factor))
    return definitions


def _of_type(item: Variable) -> dict[str, str]:
    """Unit, range, size and start of a variable; an integer has a range alone."""
    if item.kind == "integer":
        result = {"min": str(int(item.low)), "max": str(int(min(item.high, LARGEST_INTEGER)))}
    else:
        numbers = {"min": item.low, "max": item.high, "nominal": item.nominal}
        known = {name: x for name, x in numbers.items() if x is not None and math.isfinite(x)}
        result = {name: repr(float(x)) for name, x in known.items()} if item.kind == "real" else {}
        if item.kind == "real" and item.unit != "1":
            shown = {"displayUnit": item.shown} if item.shown else {}
            result = {"unit": item.unit, **shown, **result}
    if item.start is None or isinstance(item.start, str):
        return result if item.start is None else {**result, "start": item.start}
    return {**result, "start": str(int(item.start)) if item.kind == "integer" else repr(float(item.start))}


def _common(item: Variable) -> dict[str, str]:
    about = {
        "name": item.name,
        "valueReference": str(item.reference),
        **{name: getattr(item, name) for name in ("description", "causality", "variability")},
    }
    if item.causality != "input":
        about["initial"] = "exact" if item.start is not None else "calculated"
    return about


_TYPES = {
    2: {"real": "Real", "integer": "Integer", "boolean": "Boolean", "string": "String"},
    3: {"real": "Float64", "integer": "Int32", "boolean": "Boolean", "string": "String"},
}


def _variables(root: ET.Element, variables: Sequence[Variable], version: int) -> None:
    listed = ET.SubElement(root, "ModelVariables")
    if version == 3:
        ET.SubElement(
            listed, "Float64", name="time", valueReference=str(TIME), causality="independent",
            variability="continuous", unit="s", description="simulation time",
        )  # fmt: skip
    for item in variables:
        kind, own = _TYPES[version][item.kind], _of_type(item)
        if version == 2:
            ET.SubElement(ET.SubElement(listed, "ScalarVariable", _common(item)), kind, own)
        elif item.kind == "string":
            ET.SubElement(ET.SubElement(listed, kind, _common(item)), "Start", value=str(item.start))
        else:
            ET.SubElement(listed, kind, {**_common(item), **own})


def _structure(root: ET.Element, variables: Sequence[Variable], version: int) -> None:
    """Outputs and what is unknown at the start, by place (FMI 2.0) or value reference (FMI 3.0)."""
    structure = ET.SubElement(root, "ModelStructure")
    place = {item.reference: n + 1 if version == 2 else item.reference for n, item in enumerate(variables)}
    for name in ("Output", "InitialUnknown"):
        part = ET.SubElement(structure, f"{name}s") if version == 2 else structure
        tag, key = ("Unknown", "index") if version == 2 else (name, "valueReference")
        for item in (item for item in variables if item.causality == "output"):
            started = name == "InitialUnknown" and item.name == "output.angle"
            known = {"dependencies": str(place[INITIAL_ANGLE]) if started else ""}
            if name == "InitialUnknown" and item.name == "motor.angle":
                known = {}  # not said: of every parameter, as the gears' ratios are
            ET.SubElement(part, tag, {key: str(place[item.reference]), **known})


def build_description(sources: Sequence[str]) -> bytes:
    """``sources/buildDescription.xml`` of FMI 3.0."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    build = ET.SubElement(root, "BuildConfiguration", modelIdentifier=MODEL)
    files = ET.SubElement(build, "SourceFileSet", language="C99", compilerOptions="-ffp-contract=off")
    for name in sources:
        ET.SubElement(files, "SourceFile", name=name)
    return _written(root)
