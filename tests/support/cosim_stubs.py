"""Small FMUs and system descriptions for tests of co-simulation."""

from __future__ import annotations

import sys
import zipfile
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import fmpy.fmi1
import pytest
from pythonfmu.builder import FmuBuilder

import imufmu
from imufmu import Result
from imufmu.cosim.slave import Slave
from imufmu.cosim.ssp.files import NAMESPACES
from support.places import built_once

Call = tuple[str, str, tuple[Any, ...]]

_HEAD = """
import math
import signal
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real
from pythonfmu.enums import Fmi2Status

IN, OUT, LOCAL = Fmi2Causality.input, Fmi2Causality.output, Fmi2Causality.local
PARAMETER, FIXED = Fmi2Causality.parameter, Fmi2Variability.fixed
DISCRETE = Fmi2Variability.discrete

class Stub(Fmi2Slave):
    def add(self, kind, name, causality, variability=None, start=0):
        setattr(self, name, start)
        self.register_variable(kind(name, causality=causality, variability=variability))

    def setup_experiment(self, start_time, stop_time=None, tolerance=None):
        self.t = start_time
"""

_BODIES = {
    # Continuous: y = end of the last step + u in force during it.
    "clock": """
class Clock(Stub):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.add(Real, "u", IN)
        self.add(Real, "y", OUT)
        self.add(Integer, "steps", OUT, DISCRETE)
        self.add(Boolean, "even", OUT, DISCRETE, True)
        self.add(Real, "offset", PARAMETER, FIXED)
        self.add(Integer, "start_steps", PARAMETER, FIXED)

    def exit_initialization_mode(self):
        self.y, self.steps = self.t + self.u + self.offset, self.start_steps
        self.even = self.steps % 2 == 0

    def do_step(self, t, h):
        self.y, self.steps = t + h + self.u + self.offset, self.steps + 1
        self.even = self.steps % 2 == 0
        return True
""",
    # Sampled: outputs equal inputs.
    "sampler": """
class Sampler(Stub):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.add(Real, "inside[1]", LOCAL, DISCRETE)
        self.add(Real, "inside[2]", LOCAL, DISCRETE)
        self.add(Real, "u", IN)
        self.add(Integer, "n", IN, DISCRETE)
        self.add(Boolean, "b", IN, DISCRETE, False)
        self.add(Real, "y", OUT, DISCRETE, -1.0)
        self.add(Integer, "m", OUT, DISCRETE)
        self.add(Boolean, "c", OUT, DISCRETE, False)
        self.add(Real, "sample_time", OUT, DISCRETE)
        self.add(Real, "sample_period", PARAMETER, FIXED, 0.25)

    def do_step(self, t, h):
        self.y, self.m, self.c, self.sample_time = self.u, self.n, self.b, t
        setattr(self, "inside[1]", 10 * t)
        setattr(self, "inside[2]", 20 * t)
        return True
""",
    # Continuous: y = u + 1, during initialisation too.
    "adder": """
class Adder(Stub):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u = 0.0
        self.register_variable(Real("u", causality=IN))
        self.register_variable(Real("y", causality=OUT, getter=lambda: self.u + 1))

    def do_step(self, t, h):
        return True
""",
    # Fails in the way that the parameter says, in the step from t = 0.5.
    "faulty": """
class Faulty(Stub):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.add(Real, "y", OUT)
        self.add(Integer, "fault", PARAMETER, FIXED)

    def exit_initialization_mode(self):
        if self.fault == 1:
            self.log("the fuse is blown", Fmi2Status.error)
            raise ValueError

    def do_step(self, t, h):
        now = t == 0.5
        if now and self.fault == 2:
            self.log("out of fuel", Fmi2Status.error)
            return False
        if now and self.fault == 3:
            raise ValueError
        if now and self.fault == 4:
            self.y = math.nan
        if self.fault == 5:
            self.log("oil is low", Fmi2Status.warning)
        if now and self.fault == 7:
            self.y = math.inf
        if now and self.fault == 6:
            signal.raise_signal(signal.SIGINT)
        return True
""",
    # An estimator that reports what it is given.
    "echo": """
class Echo(Stub):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        for i in (1, 2, 3):
            self.add(Real, f"gyro[{i}]", IN)
            self.add(Real, f"accel[{i}]", IN)
        for i in (1, 2, 3):
            self.add(Real, f"seen[{i}]", OUT, DISCRETE)
            self.add(Real, f"felt[{i}]", OUT, DISCRETE)

    def do_step(self, t, h):
        for i in (1, 2, 3):
            setattr(self, f"seen[{i}]", getattr(self, f"gyro[{i}]"))
            setattr(self, f"felt[{i}]", getattr(self, f"accel[{i}]"))
        return True
""",
    # An estimator that ends the run in the step from t = 0.5.
    "finite": """
class Finite(Stub):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        for i in (1, 2, 3):
            self.add(Real, f"gyro[{i}]", IN)
            self.add(Real, f"accel[{i}]", IN)
        self.add(Real, "y", OUT, DISCRETE)

    def do_step(self, t, h):
        self.y = t
        return t < 0.5
""",
    "stillborn": """
class Stillborn(Stub):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        raise ValueError

    def do_step(self, t, h):
        return True
""",
}


@cache
def stub(name: str) -> Path:
    """FMU of a stub, built once per test run."""
    return built_once(f"{name}.fmu", lambda path: _build(path, name))


def _build(path: Path, name: str) -> None:
    script = path.with_name(f"cosim_stub_{name}.py")
    if name != "stillborn":
        _build_as(path, script, _BODIES[name])
        return
    # The builder needs an instance: let it fail only later.
    _build_as(path, script, _BODIES[name].replace("raise ValueError", 'self.add(Real, "y", OUT)'))
    with zipfile.ZipFile(path) as archive:
        members = {member: archive.read(member) for member in archive.namelist()}
    members[f"resources/{script.name}"] = (_HEAD + _BODIES[name]).encode()
    write_zip(path, members)


def _build_as(path: Path, script: Path, body: str) -> None:
    script.write_text(_HEAD + body)
    before = list(sys.path)
    try:
        FmuBuilder.build_FMU(script, dest=path)
    finally:
        sys.modules.pop(script.stem, None)
        sys.path[:] = before


def edited_fmu(path: Path, fmu: Path, edit: Callable[[str], str]) -> Path:
    """A copy of an FMU with another model description."""
    with zipfile.ZipFile(fmu) as archive:
        members: dict[str, bytes | str] = {name: archive.read(name) for name in archive.namelist()}
    text = members["modelDescription.xml"]
    assert isinstance(text, bytes)
    members["modelDescription.xml"] = edit(text.decode())
    return write_zip(path, members)


def write_zip(path: Path, members: Mapping[str, bytes | str]) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return path


def variable(name: str, causality: str, kind: str = "Real", **attributes: str) -> str:
    """A ScalarVariable; the variability fits the causality."""
    changes = {"parameter": "fixed"}.get(causality, "continuous" if kind == "Real" else "discrete")
    if causality != "output":
        attributes = {"start": "false" if kind == "Boolean" else "0"} | attributes
    inner = " ".join(f'{key.rstrip("_")}="{value}"' for key, value in attributes.items())
    return (
        f'<ScalarVariable name="{name}" valueReference="REF" causality="{causality}" variability="{changes}">'
        f"<{kind} {inner}/></ScalarVariable>"
    )


def model_description(
    variables: Iterable[str] = (), *, identifier: str = "Fake", once: bool = False, types: str = ""
) -> str:
    """XML of a valid model description."""
    numbered = [v.replace("REF", str(i)) for i, v in enumerate(variables)]
    outputs = "".join(f'<Unknown index="{i}"/>' for i, v in enumerate(numbered, 1) if 'causality="output"' in v)
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Fake" guid="1">
<CoSimulation modelIdentifier="{identifier}" canBeInstantiatedOnlyOncePerProcess="{str(once).lower()}"/>
{types}<DefaultExperiment stepSize="0.125"/>
<ModelVariables>{"".join(numbered)}</ModelVariables>
<ModelStructure>{f"<Outputs>{outputs}</Outputs>" if outputs else ""}</ModelStructure>
</fmiModelDescription>"""


LIBRARY = f"binaries/{fmpy.platform}/Fake{fmpy.sharedLibraryExtension}"


def fake_fmu(path: Path, variables: Iterable[str], **options: Any) -> Path:
    """An FMU that can be read but not run."""
    return write_zip(path, {"modelDescription.xml": model_description(variables, **options), LIBRARY: b""})


def parameter_set(values: Mapping[str, tuple[str, Any, str | None]]) -> str:
    """An ssv:ParameterSet; values by name: (type, value, unit)."""
    lines = []
    for name, (kind, value, unit) in values.items():
        attribute = f'unit="{unit}"' if unit else ""
        lines.append(f'<ssv:Parameter name="{name}"><ssv:{kind} value="{value}" {attribute}/></ssv:Parameter>')
    return (
        f'<ssv:ParameterSet xmlns:ssv="{NAMESPACES["ssv"]}" version="1.0" name="values">\n'
        f"<ssv:Parameters>{chr(10).join(lines)}</ssv:Parameters></ssv:ParameterSet>"
    )


def binding(values: Mapping[str, tuple[str, Any, str | None]]) -> str:
    """An inline binding of parameter values."""
    inline = f"<ssd:ParameterValues>{parameter_set(values)}</ssd:ParameterValues>"
    return f"<ssd:ParameterBinding>{inline}</ssd:ParameterBinding>"


def write_ssd(
    path: Path,
    components: Mapping[str, Path | str],
    connections: Iterable[str] = (),
    *,
    bindings: Mapping[str, str] | None = None,
    connectors: Mapping[str, str] | None = None,
    stop: float | None = 1.0,
    step: float | None = 0.25,
) -> Path:
    """Write a system. connections: "a.y -> b.u", after which may come attributes and, behind a |, an element.

    bindings: XML by component, "" for the system. connectors: XML by component.variable in place of the plain one.
    """
    kinds: dict[str, dict[str, str]] = {name: {} for name in components}
    wires = []
    for connection in connections:
        ends, _, transformation = connection.partition("|")
        start, _, end = ends.partition(" -> ")
        end, _, attributes = end.partition(" ")
        for text, kind in ((start, "output"), (end, "input")):
            component, _, name = text.partition(".")
            kinds.setdefault(component, {})[name] = f'<ssd:Connector name="{name}" kind="{kind}"/>'
        (a, x), (b, y) = start.split("."), end.split(".")
        wires.append(
            f'<ssd:Connection startElement="{a}" startConnector="{x}" endElement="{b}" endConnector="{y}" {attributes}>'
            f"{transformation}</ssd:Connection>"
        )
    for name, text in (connectors or {}).items():
        component, _, connector = name.partition(".")
        kinds[component][connector] = text

    def bound(name: str) -> str:
        text = (bindings or {}).get(name)
        return f"<ssd:ParameterBindings>{text}</ssd:ParameterBindings>" if text else ""

    parts = [
        f'<ssd:Component name="{name}" source="{source}">'
        + (f"<ssd:Connectors>{''.join(kinds[name].values())}</ssd:Connectors>" if kinds[name] else "")
        + bound(name)
        + "</ssd:Component>"
        for name, source in components.items()
    ]
    annotation = (
        f'<ssd:Annotations><ssc:Annotation type="org.imufmu"><imufmu:Communication stepSize="{step}"/></ssc:Annotation>'
        "</ssd:Annotations>"
    )
    lines = [
        "<ssd:SystemStructureDescription "
        + " ".join(f'xmlns:{prefix}="{uri}"' for prefix, uri in NAMESPACES.items())
        + ' version="1.0" name="test">',
        '<ssd:System name="test">',
        bound(""),
        "<ssd:Elements>",
        *parts,
        "</ssd:Elements>",
        *(["<ssd:Connections>", *wires, "</ssd:Connections>"] if wires else []),
        "</ssd:System>",
        "<ssd:DefaultExperiment" + ("" if stop is None else f' stopTime="{stop}"') + ">",
        annotation if step else "",
        "</ssd:DefaultExperiment>",
        "</ssd:SystemStructureDescription>",
    ]
    path.write_text("\n".join(lines))
    return path


def simulate(*args: Any, **options: Any) -> Result:
    """imufmu.simulate with the stubs in this process, where their calls can be watched and no start is paid for."""
    return imufmu.simulate(*args, in_process=True, **options)


def recorded_calls(monkeypatch: pytest.MonkeyPatch) -> list[Call]:
    """(instance, function, arguments) of every FMI call from now on, through FMPy's methods or of the C function."""
    made: list[Call] = []
    through_fmpy, plain = fmpy.fmi1._FMU._call, Slave._function

    def call(self: Any, name: str, *args: Any) -> Any:
        made.append((self.instanceName, name, args))
        return through_fmpy(self, name, *args)

    def function(self: Slave, name: str) -> Callable[..., int]:
        def called(*args: Any) -> int:
            made.append((self.name, name, args))
            return plain(self, name)(*args)

        return called

    monkeypatch.setattr(fmpy.fmi1._FMU, "_call", call)
    monkeypatch.setattr(Slave, "_function", function)
    return made
