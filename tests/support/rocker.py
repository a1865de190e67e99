"""FMUs of one rocking platform: FMI 3.0 for both kinds of simulation, FMI 3.0 and 2.0 for model exchange only.

Without a push the angle is 0.5 cos(sqrt(10) t) rad. Co-simulation solves it exactly, and ends the run beyond ``limit``;
in model exchange the platform bounces there, and is kicked at ``kick_time`` if that is positive.
"""

from __future__ import annotations

import subprocess
from itertools import product
from pathlib import Path

import fmpy
from fmpy import fmi2, fmi3

from support.cosim_stubs import write_zip
from support.optional import skip_without
from support.places import built_once

KINDS = ("3_cs", "3_me", "2_me")

# Name, reference, causality, size, start, unit.
_REALS = [
    ("angle", 1, "local", (), "0.5", "rad"),
    ("rate", 2, "local", (), "0", "rad/s"),
    ("der(angle)", 3, "local", (), None, "rad/s"),
    ("der(rate)", 4, "local", (), None, ""),
    ("stiffness", 5, "parameter", (), "10", ""),
    ("limit", 6, "parameter", (), "10", "rad"),
    ("kick_time", 7, "parameter", (), "0", "s"),
    ("push", 10, "input", (2,), "0 0", ""),
    ("angular_velocity", 12, "output", (3,), None, "rad/s"),
    ("specific_force", 15, "output", (3,), None, "m/s2"),
    ("vertical", 18, "output", (3,), None, "1"),
    ("attitude", 21, "output", (4,), None, "1"),
    ("dcm", 25, "output", (3, 3), None, "1"),
]
_UNITS = "".join(f'<Unit name="{name}"/>' for name in ("rad", "rad/s", "m/s2", "s", "1"))


def rocker(kind: str) -> Path:
    """The FMU of one of KINDS; skips the test where there is no compiler for it."""
    skip_without("POSIX", "cc")

    def build(path: Path) -> None:
        version = int(kind[0])
        library, source = path.with_suffix(".library"), Path(__file__).with_name("rocker.c")
        unused = path.with_suffix(".unused") / "unused.h"
        unused.parent.mkdir()
        unused.write_text("\n".join(f"X({name})" for name in _unused(version, source.read_text())))
        flags = [f"-DFMI={version}", "-shared", "-fPIC", "-w", "-O1", f"-I{unused.parent}"]
        subprocess.run(["cc", *flags, "-o", str(library), str(source), "-lm"], check=True)
        folder = fmpy.platform if version == 2 else fmpy.platform_tuple
        description = _description_2() if version == 2 else _description_3("cs" in kind)
        binary = f"binaries/{folder}/rocker{fmpy.sharedLibraryExtension}"
        write_zip(path, {"modelDescription.xml": description, binary: library.read_bytes()})

    return built_once(f"rocker_{kind}.fmu", build)


def _unused(version: int, source: str) -> list[str]:
    """Functions that FMPy loads and the source does not have."""
    classes = (fmi2.FMU2Model,) if version == 2 else (fmi3.FMU3Model, fmi3.FMU3Slave)
    names = {name for some in classes for name in dir(some) if name.startswith(f"fmi{version}")}
    own = {f"fmi{version}{part.split(')')[0]}" for part in source.split("F(")[1:]}
    return sorted(name for name in names - own if f"{name}(" not in source)


def _description_3(co_simulation: bool) -> str:
    lines = ['<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>']
    for name, reference, causality, shape, start, unit in _REALS:
        changes = "fixed" if causality == "parameter" else "continuous"
        more = f' start="{start}"' if start else ""
        more += f' unit="{unit}"' if unit else ""
        more += ' initial="exact"' if causality == "local" and start else ""
        more += {"der(angle)": ' derivative="1"', "der(rate)": ' derivative="2"'}.get(name, "")
        inside = "".join(f'<Dimension start="{size}"/>' for size in shape)
        lines.append(
            f'<Float64 name="{name}" valueReference="{reference}" causality="{causality}" '
            f'variability="{changes}"{more}>{inside}</Float64>'
        )
    lines += [
        '<Float32 name="small" valueReference="40" causality="output"/>',
        '<Int64 name="hits" valueReference="100" causality="output"/>',
        '<Int64 name="hits_before" valueReference="101" causality="parameter" variability="fixed" start="0"/>',
        '<UInt8 name="steps" valueReference="102" causality="output"/>',
        '<UInt8 name="steps_before" valueReference="106" causality="parameter" variability="fixed" start="0"/>',
        '<Boolean name="lifted" valueReference="103" causality="output"/>',
        '<String name="label" valueReference="104" causality="parameter" variability="fixed">'
        '<Start value=""/></String>',
        '<Boolean name="calm" valueReference="105" causality="input" start="false"/>',
        '<Binary name="picture" valueReference="107" causality="output"/>',
    ]
    outputs = [12, 15, 18, 21, 25, 40, 100, 102, 103, 107]
    structure = "".join(f'<Output valueReference="{reference}"/>' for reference in outputs)
    structure += "".join(f'<ContinuousStateDerivative valueReference="{reference}"/>' for reference in (3, 4))
    structure += "".join(f'<InitialUnknown valueReference="{reference}"/>' for reference in [*outputs, 3, 4])
    lines.append('<Float64 name="room" valueReference="50" causality="local"/>')
    structure += '<EventIndicator valueReference="50"/>'
    kinds = '<ModelExchange modelIdentifier="rocker"/>'
    kinds += '<CoSimulation modelIdentifier="rocker"/>' if co_simulation else ""
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="rocker" instantiationToken="1">
{kinds}<UnitDefinitions>{_UNITS}</UnitDefinitions>
<DefaultExperiment startTime="0" stopTime="2" stepSize="0.01"/>
<ModelVariables>{"".join(lines)}</ModelVariables><ModelStructure>{structure}</ModelStructure>
</fmiModelDescription>"""


def _description_2() -> str:
    lines: list[str] = []
    outputs: list[int] = []
    for name, reference, causality, shape, start, unit in _REALS:
        starts = (start or "").split()
        for i, index in enumerate(product(*(range(1, size + 1) for size in shape))):
            full = f"{name}[{','.join(map(str, index))}]" if index else name
            changes = "fixed" if causality == "parameter" else "continuous"
            more = f' start="{starts[i]}"' if starts else ""
            more += f' unit="{unit}"' if unit else ""
            more += {"der(angle)": ' derivative="1"', "der(rate)": ' derivative="2"'}.get(name, "")
            initial = ' initial="exact"' if causality == "local" and starts else ""
            lines.append(
                f'<ScalarVariable name="{full}" valueReference="{reference + i}" causality="{causality}" '
                f'variability="{changes}"{initial}><Real{more}/></ScalarVariable>'
            )
            outputs += [len(lines)] if causality == "output" else []
    lines.append(
        '<ScalarVariable name="hits" valueReference="100" causality="output" variability="discrete"><Integer/>'
    )
    lines.append("</ScalarVariable>")
    outputs.append(len(lines) - 1)
    unknown = "".join(f'<Unknown index="{index}"/>' for index in outputs)
    derivatives = '<Unknown index="3"/><Unknown index="4"/>'
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="rocker" guid="1" numberOfEventIndicators="1">
<ModelExchange modelIdentifier="rocker"/><UnitDefinitions>{_UNITS}</UnitDefinitions>
<DefaultExperiment startTime="0" stopTime="2" stepSize="0.01"/>
<ModelVariables>{"".join(lines)}</ModelVariables>
<ModelStructure><Outputs>{unknown}</Outputs><Derivatives>{derivatives}</Derivatives>
<InitialUnknowns>{derivatives}{unknown}</InitialUnknowns></ModelStructure>
</fmiModelDescription>"""
