"""Read a system description: SSP 1.0 (System Structure and Parameterization), one flat system of FMUs.

The schemas come from fmpy. Its object model drops what the checks need (types and units of connectors, inline
mappings, transformations, the default experiment), so the elements are read here.

The communication step size, for which SSP 1.0 has no place, is an annotation of the default experiment:

    <ssd:DefaultExperiment startTime="0" stopTime="20">
      <ssd:Annotations>
        <ssc:Annotation type="org.imufmu">
          <imufmu:Communication xmlns:imufmu="urn:imufmu:ssp" stepSize="0.01"/>
        </ssc:Annotation>
      </ssd:Annotations>
    </ssd:DefaultExperiment>
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlparse

from lxml import etree

from ..files.archives import LARGEST_READ, listed, parse_xml

SSP = "http://ssp-standard.org/SSP1/"
NAMESPACES = {
    "ssd": f"{SSP}SystemStructureDescription",
    "ssc": f"{SSP}SystemStructureCommon",
    "ssv": f"{SSP}SystemStructureParameterValues",
    "imufmu": "urn:imufmu:ssp",
}
FMU_TYPE = "application/x-fmu-sharedlibrary"
PARAMETER_SET_TYPE = "application/x-ssp-parameter-set"
ANNOTATION_TYPE = "org.imufmu"


class DescriptionError(ValueError):
    """A system description cannot be used; the message names the file, the line and the reason."""


@dataclass(frozen=True)
class Connector:
    """A declared connector of a component; type and unit are None where the description leaves them open."""

    kind: str
    type: str | None
    unit: str | None
    line: int


@dataclass(frozen=True)
class ParameterValue:
    """One value of a parameter set: text as written, its SSP type, and where it stands."""

    name: str
    type: str
    value: str
    unit: str | None
    where: str


@dataclass(frozen=True)
class Component:
    """One FMU of the system; values in order of increasing precedence."""

    name: str
    description: str
    source: Path
    connectors: dict[str, Connector]
    values: tuple[ParameterValue, ...]
    line: int


@dataclass(frozen=True)
class Connection:
    """Two ends (component, connector) whose kinds say which is the source; "" is the boundary of the system.

    target = factor * source + offset.
    """

    start: tuple[str, str]
    end: tuple[str, str]
    factor: float
    offset: float
    same_units: bool  # False: the author takes care of units (suppressUnitConversion)
    line: int


@dataclass(frozen=True)
class Description:
    """A system as written: paths absolute, nothing checked against the FMUs."""

    path: Path
    name: str
    description: str
    components: tuple[Component, ...]
    connections: tuple[Connection, ...]
    values: tuple[ParameterValue, ...]  # of the whole system, named component.parameter
    start_time: float | None
    stop_time: float | None
    step: float | None


def read_description(path: Path, inside: Path | None = None) -> Description:
    """Read an .ssd file; ``inside``: the folder that its sources must not leave.

    Raises DescriptionError, and ArchiveError for XML that is unsafe or not well-formed.
    """
    files = Sources(path, inside)
    root = read_xml(path, "SystemStructureDescription")
    system = root.find("ssd:System", NAMESPACES)
    experiment = root.find("ssd:DefaultExperiment", NAMESPACES)
    for unsupported in ("System", "SignalDictionaryReference"):
        for element in system.iterfind(f"ssd:Elements/ssd:{unsupported}", NAMESPACES):
            raise DescriptionError(
                f"{path}, line {element.sourceline}: {unsupported} {element.get('name')!r} inside a system is not "
                "supported; describe one flat system of FMUs"
            )
    step = None
    for communication in root.iterfind(
        f"ssd:DefaultExperiment/ssd:Annotations/ssc:Annotation[@type='{ANNOTATION_TYPE}']/imufmu:Communication",
        NAMESPACES,
    ):
        step = _number(communication, "stepSize", path)
    return Description(
        path,
        name=root.get("name"),
        description=system.get("description") or root.get("description") or "",
        components=tuple(_component(c, files) for c in system.iterfind("ssd:Elements/ssd:Component", NAMESPACES)),
        connections=tuple(_connection(c, path) for c in system.iterfind("ssd:Connections/ssd:Connection", NAMESPACES)),
        values=_bound_values(system, files),
        start_time=None if experiment is None else _number(experiment, "startTime", path),
        stop_time=None if experiment is None else _number(experiment, "stopTime", path),
        step=step,
    )


@dataclass(frozen=True)
class Sources:
    """Files that a description refers to, relative to itself."""

    ssd: Path
    inside: Path | None  # the folder they must not leave

    def __call__(self, element: Any) -> Path:
        """Path that the ``source`` attribute of an element means. Raises DescriptionError."""
        source = element.get("source")
        address = urlparse(source)
        path = (self.ssd.parent / unquote(address.path)).resolve()
        where = f"{self.ssd}, line {element.sourceline}: source {source!r}"
        if address.scheme or address.netloc or address.fragment or not address.path:
            raise DescriptionError(f"{where}: expected a path relative to the description")
        if self.inside and not path.is_relative_to(self.inside):
            raise DescriptionError(f"{where}: leaves the archive")
        return path


def read_xml(path: Path, schema: str) -> Any:
    """Root element of an SSP file that follows the schema. Raises DescriptionError and ArchiveError."""
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_READ + 1)
    except OSError as error:
        raise DescriptionError(f"{path}: cannot be read: {error.strerror or error}") from error
    root = parse_xml(content, str(path))
    _validate(root, schema, path)
    return root


def _validate(root: Any, schema: str, path: Path) -> None:
    rules = _schema(schema)
    if not rules.validate(root):
        problems = [f"line {entry.line}: {entry.message}" for entry in rules.error_log]
        raise DescriptionError(f"{path}: not a valid {schema}: {listed(problems)}")


@lru_cache
def _schema(name: str) -> Any:
    found = find_spec("fmpy")  # to import it takes longer than to read a description
    assert found and found.origin
    return etree.XMLSchema(file=str(Path(found.origin).parent / "ssp" / "schema" / f"{name}.xsd"))


def _component(element: Any, files: Sources) -> Component:
    path, name, line = files.ssd, element.get("name"), element.sourceline
    if element.get("type", FMU_TYPE) != FMU_TYPE:
        raise DescriptionError(f"{path}, line {line}: component {name!r} is no FMU; only FMUs are supported")
    if element.get("implementation") == "ModelExchange":
        raise DescriptionError(f"{path}, line {line}: component {name!r}: only co-simulation is supported")
    return Component(
        name,
        element.get("description", ""),
        files(element),
        {c.get("name"): _connector(c) for c in element.iterfind("ssd:Connectors/ssd:Connector", NAMESPACES)},
        _bound_values(element, files),
        line,
    )


def _connector(element: Any) -> Connector:
    declared = _first_child(element, "ssc")
    return Connector(
        element.get("kind"),
        None if declared is None else etree.QName(declared).localname,
        None if declared is None else declared.get("unit"),
        element.sourceline,
    )


def _connection(element: Any, path: Path) -> Connection:
    linear = _first_child(element, "ssc")
    if linear is not None and etree.QName(linear).localname != "LinearTransformation":
        raise DescriptionError(f"{path}, line {linear.sourceline}: only a LinearTransformation is supported")
    factor = offset = None
    if linear is not None:
        factor, offset = _number(linear, "factor", path), _number(linear, "offset", path)
    return Connection(
        (element.get("startElement", ""), element.get("startConnector")),
        (element.get("endElement", ""), element.get("endConnector")),
        1.0 if factor is None else factor,
        0.0 if offset is None else offset,
        element.get("suppressUnitConversion") not in ("true", "1"),
        element.sourceline,
    )


def _bound_values(element: Any, files: Sources) -> tuple[ParameterValue, ...]:
    """Values bound to a component or system, prefix included, later ones taking precedence."""
    path = files.ssd
    values: list[ParameterValue] = []
    for binding in element.iterfind("ssd:ParameterBindings/ssd:ParameterBinding", NAMESPACES):
        where = f"{path}, line {binding.sourceline}"
        if binding.get("type", PARAMETER_SET_TYPE) != PARAMETER_SET_TYPE or binding.get("sourceBase") == "component":
            raise DescriptionError(f"{where}: only parameter sets (.ssv) beside the description are supported")
        if binding.find("ssd:ParameterMapping", NAMESPACES) is not None:
            raise DescriptionError(f"{where}: a ParameterMapping is not supported; use the names of the FMU")
        prefix = binding.get("prefix", "")
        if binding.get("source") is not None:
            file = files(binding)
            values += _parameter_set(read_xml(file, "SystemStructureParameterValues"), file, prefix)
        for inline in binding.iterfind("ssd:ParameterValues/ssv:ParameterSet", NAMESPACES):
            _validate(inline, "SystemStructureParameterValues", path)
            values += _parameter_set(inline, path, prefix)
    return tuple(values)


def _parameter_set(element: Any, path: Path, prefix: str) -> list[ParameterValue]:
    values = []
    for parameter in element.iterfind("ssv:Parameters/ssv:Parameter", NAMESPACES):
        value = _first_child(parameter, "ssv")
        where = f"{path}, line {parameter.sourceline}"
        kind = etree.QName(value).localname
        values.append(
            ParameterValue(prefix + parameter.get("name"), kind, value.get("value"), value.get("unit"), where)
        )
    return values


def _first_child(element: Any, namespace: str) -> Any:
    return next(element.iterchildren(f"{{{NAMESPACES[namespace]}}}*"), None)


def _number(element: Any, attribute: str, path: Path) -> float | None:
    text = element.get(attribute)
    if text is None:
        return None
    try:
        return float(text)
    except ValueError:
        where = f"{path}, line {element.sourceline}"
        raise DescriptionError(f"{where}: {attribute}={text!r} is not a number") from None
