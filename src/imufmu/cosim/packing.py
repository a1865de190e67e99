"""Pack a system into one .ssp file that any SSP 1.0 tool can load.

The values of each component, wherever the description binds them, become one parameter set inside the description, of
one name: libcosim applies the first set of a component only, and ecos the sets of the name that it is told. OMSimulator
refuses a system that does not name a master of its own, and takes the communication step from there: that is added.
"""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path
from typing import Any

from lxml import etree

from ..files.atomic import atomic_write, check_not_read
from .interface import representation, unit_of
from .settings import Setting
from .ssp.files import NAMESPACES, DescriptionError, Sources, read_bytes, read_root
from .ssp.flat import FMU_TYPE
from .ssp.packages import STRUCTURE
from .system import System

PARAMETER_SET = "parameters"  # name of the set of each component

_OMS = "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"  # namespace of OMSimulator
_OMS_ANNOTATION = "org.openmodelica"

_FIXED_TIME = (1980, 1, 1, 0, 0, 0)  # the earliest a zip can say: equal contents make equal bytes


def pack(ssd: str | Path, target: str | Path, *, native: bool = False) -> Path:
    """Write the system described by ``ssd`` to ``target``, its FMUs under ``resources/``, its parameters inside.

    native: as in System.read. Returns the path written. Raises what System.read raises, DescriptionError for a system
    that refers to other descriptions, and WriteError.
    """
    system = System.read(ssd, native=native)
    check_not_read(target, [ssd, *(part.fmu for part in system.parts)])
    described = system.description.path
    root = read_root(read_bytes(described), described, "SystemStructureDescription", [])
    members: dict[str, Path] = {}
    for bindings in root.findall(".//ssd:ParameterBindings", NAMESPACES):
        bindings.getparent().remove(bindings)
    for component in root.iterfind(".//ssd:Component", NAMESPACES):
        name = _full_name(component)
        if component.get("type", FMU_TYPE) != FMU_TYPE or component.get("source").startswith("#"):
            raise DescriptionError(f"{ssd}: {name} refers to another system; put that in its place to pack it")
        component.set("source", _member(next(part.fmu for part in system.parts if part.name == name), members))
        settings = [setting for setting in system.settings if setting.component == name]
        if settings:
            # The standard wants it behind these two.
            before = [component.find(f"ssd:{tag}", NAMESPACES) for tag in ("Connectors", "ElementGeometry")]
            component.insert(sum(element is not None for element in before), _bindings(settings))
    for dictionary in root.iterfind(".//ssd:SignalDictionary[@source]", NAMESPACES):
        content, path = Sources(described, None).content(dictionary, None)
        dictionary.append(read_root(content, path, "SignalDictionary", []))
        del dictionary.attrib["source"]
    if system.description.step is not None:
        _name_master(root.find("ssd:System", NAMESPACES), system.description.step)
    etree.indent(root)
    contents = {name: path.read_bytes() for name, path in members.items()}
    contents[STRUCTURE] = etree.tostring(root, xml_declaration=True, encoding="UTF-8")
    with atomic_write(target) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in sorted(contents.items()):
            entry = zipfile.ZipInfo(name, _FIXED_TIME)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, content)
    return Path(target)


def _full_name(component: Any) -> str:
    """Name of a component with those of the systems around it, without that of the whole."""
    around = [system.get("name") for system in component.iterancestors(f"{{{NAMESPACES['ssd']}}}System")]
    return ".".join([*reversed(around[:-1]), component.get("name")])


def _name_master(system: Any, step: float) -> None:
    """Tell OMSimulator of the step (s), unless the system tells it something already."""
    ssd, ssc, oms = f"{{{NAMESPACES['ssd']}}}", f"{{{NAMESPACES['ssc']}}}", f"{{{_OMS}}}"
    annotations = system.find("ssd:Annotations", NAMESPACES)
    if annotations is None:
        annotations = etree.SubElement(system, f"{ssd}Annotations")  # the last of its children
    if annotations.find(f"ssc:Annotation[@type='{_OMS_ANNOTATION}']", NAMESPACES) is not None:
        return
    annotation = etree.SubElement(annotations, f"{ssc}Annotation", type=_OMS_ANNOTATION)
    own = etree.SubElement(annotation, f"{oms}Annotations", nsmap={"oms": _OMS})  # it reads the prefix only
    master = etree.SubElement(etree.SubElement(own, f"{oms}SimulationInformation"), f"{oms}FixedStepMaster")
    size = f"{Decimal(repr(step)):f}"  # all digits, without an exponent
    for name, value in {"description": "oms-ma", "stepSize": size, "relativeTolerance": "0.0001"}.items():
        master.set(name, value)


def _bindings(settings: Sequence[Setting]) -> Any:
    """The element ParameterBindings with one set of these values."""
    ssd, ssv = (f"{{{NAMESPACES[prefix]}}}" for prefix in ("ssd", "ssv"))
    bindings = etree.Element(f"{ssd}ParameterBindings")
    values = etree.SubElement(etree.SubElement(bindings, f"{ssd}ParameterBinding"), f"{ssd}ParameterValues")
    own = {"ssv": NAMESPACES["ssv"]}  # some tools know it by this prefix only
    group = etree.SubElement(values, f"{ssv}ParameterSet", nsmap=own, version="1.0", name=PARAMETER_SET)
    parameters = etree.SubElement(group, f"{ssv}Parameters")
    for setting in settings:
        kind, unit = representation(setting.variable), unit_of(setting.variable)
        parameter = etree.SubElement(parameters, f"{ssv}Parameter", name=setting.variable.name)
        text = str(setting.value).lower() if kind == "Boolean" else str(setting.value)
        value = etree.SubElement(parameter, f"{ssv}{kind}", value=text)
        if kind == "Real" and unit:
            value.set("unit", unit)
    return bindings


def _member(path: Path, members: dict[str, Path]) -> str:
    """Name in the archive for a file; files of the same name in different folders get numbers."""
    name, number = f"resources/{path.name}", 1
    while members.setdefault(name, path) != path:
        number += 1
        name = f"resources/{path.stem}_{number}{path.suffix}"
    return name
