"""The description (SSP 1.0) of a plant with IMU and estimators."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from lxml import etree

from ..devices import DeviceValue
from ..ssp.files import NAMESPACES
from ..ssp.flat import FMU_TYPE
from ..truth import Told

_ANNOTATION = "org.imufmu"


@dataclass(frozen=True)
class Part:
    """A component: an FMU where it lies, or the name of one of ours; values by parameter."""

    name: str
    source: Path
    values: Mapping[str, DeviceValue]
    description: str = ""


@dataclass(frozen=True)
class Wire:
    """input = factor * output, in the units of the two FMUs."""

    source: str
    output: str
    target: str
    input: str
    factor: float


def written(
    name: str,
    parts: Sequence[Part],
    wires: Sequence[Wire],
    truth: Sequence[Told],
    times: tuple[float, float, float],
    folder: Path,
) -> bytes:
    """The XML. times: start, stop, step (s). folder: where it will lie; paths in it are relative to that."""
    root = etree.Element(
        _name("ssd:SystemStructureDescription"),
        nsmap={prefix: NAMESPACES[prefix] for prefix in ("ssd", "ssc", "ssv", "imufmu")},
        version="1.0",
        name=name,
        generationTool="imufmu",
    )
    system = etree.SubElement(root, _name("ssd:System"), name=name)
    elements = etree.SubElement(system, _name("ssd:Elements"))
    for part in parts:
        _component(elements, part, wires, folder)
    if wires:
        connections = etree.SubElement(system, _name("ssd:Connections"))
        for wire in wires:
            _connection(connections, wire)
    start, stop, step = (f"{time:.17g}" for time in times)
    experiment = etree.SubElement(root, _name("ssd:DefaultExperiment"), startTime=start, stopTime=stop)
    annotations = etree.SubElement(experiment, _name("ssd:Annotations"))
    annotation = etree.SubElement(annotations, _name("ssc:Annotation"), type=_ANNOTATION)
    etree.SubElement(annotation, _name("imufmu:Communication"), stepSize=step)
    if truth:  # an annotation has one element
        _truth(etree.SubElement(annotations, _name("ssc:Annotation"), type=f"{_ANNOTATION}.truth"), truth)
    etree.indent(root)
    return bytes(etree.tostring(root, xml_declaration=True, encoding="UTF-8"))


def _component(elements: Any, part: Part, wires: Iterable[Wire], folder: Path) -> None:
    ends = [("input", wire.input) for wire in wires if wire.target == part.name]
    ends += [("output", wire.output) for wire in wires if wire.source == part.name]
    attributes = {"name": part.name, "source": _address(part.source, folder), "type": FMU_TYPE}
    attributes |= {"description": part.description} if part.description else {}
    component = etree.SubElement(elements, _name("ssd:Component"), attributes)
    if ends:
        connectors = etree.SubElement(component, _name("ssd:Connectors"))
        for kind, name in dict.fromkeys(ends):
            connector = etree.SubElement(connectors, _name("ssd:Connector"), name=name, kind=kind)
            etree.SubElement(connector, _name("ssc:Real"))  # its unit is the FMU's, or what the user knows better
    if part.values:
        bindings = etree.SubElement(component, _name("ssd:ParameterBindings"))
        binding = etree.SubElement(bindings, _name("ssd:ParameterBinding"))
        values = etree.SubElement(binding, _name("ssd:ParameterValues"))
        group = etree.SubElement(values, _name("ssv:ParameterSet"), version="1.0", name="parameters")
        parameters = etree.SubElement(group, _name("ssv:Parameters"))
        for name, value in part.values.items():
            parameter = etree.SubElement(parameters, _name("ssv:Parameter"), name=name)
            in_unit = {"unit": value.unit} if value.unit else {}
            etree.SubElement(parameter, _name(f"ssv:{value.kind}"), {"value": value.text} | in_unit)


def _connection(connections: Any, wire: Wire) -> None:
    connection = etree.SubElement(
        connections,
        _name("ssd:Connection"),
        startElement=wire.source,
        startConnector=wire.output,
        endElement=wire.target,
        endConnector=wire.input,
        suppressUnitConversion="true",  # it is in the factor: right in tools that do not convert, too
    )
    if wire.factor != 1.0:
        etree.SubElement(connection, _name("ssc:LinearTransformation"), factor=f"{wire.factor:.17g}")


def _truth(annotation: Any, truth: Sequence[Told]) -> None:
    element = etree.SubElement(annotation, _name("imufmu:Truth"))
    for told in truth:
        form = {"form": told.form} if told.form else {}
        quantity = etree.SubElement(element, _name("imufmu:Quantity"), {"name": told.quantity} | form)
        for name, factor in zip(told.variables, told.factors, strict=True):
            etree.SubElement(quantity, _name("imufmu:Variable"), name=name, factor=f"{factor:.17g}")


def _address(source: Path, folder: Path) -> str:
    """Relative to the folder where that is possible."""
    if not source.is_absolute():
        return quote(source.as_posix())
    try:
        return quote(Path(os.path.relpath(source, folder.resolve())).as_posix())
    except ValueError:  # another drive on Windows
        return quote(source.as_posix())


def _name(tag: str) -> str:
    prefix, _, local = tag.partition(":")
    return f"{{{NAMESPACES[prefix]}}}{local}"
