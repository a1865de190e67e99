"""Will this FMU run, and where? Plain answers from its archive, and from one step in a process of its own."""

from __future__ import annotations

import ast
import importlib.util
import sys
from collections.abc import Collection, Container, Iterator
from dataclasses import dataclass
from enum import Enum
from pathlib import Path, PurePosixPath
from typing import Any

import fmpy
from fmpy.validation import validate_fmu

from ..files.archives import ArchiveError, read_members
from .archive import fmu_members, interface_of, kinds_of, read_fmu
from .trial import SECONDS, try_step

_SYSTEMS = {"linux": ".so", "darwin": ".dylib", "win": ".dll"}  # the name darwin has a win in it
_PLATFORMS = {
    "linux64": "64-bit Linux",
    "win64": "64-bit Windows",
    "darwin64": "macOS",
    "linux32": "32-bit Linux",
    "win32": "32-bit Windows",
    "x86_64-linux": "64-bit Linux",
    "x86_64-windows": "64-bit Windows",
    "x86_64-darwin": "macOS on Intel",
    "aarch64-linux": "Linux on ARM",
    "aarch64-darwin": "macOS on Apple silicon",
}
# Hosts, and where they run. With FMI 2.0 only FMPy is known to look into the folders named as those of FMI 3.0 are.
_DESKTOPS = frozenset({"linux64", "win64", "darwin64"})
_HOSTS = {
    "Simulink": _DESKTOPS,
    "Dymola": frozenset({"linux64", "win64"}),
    "OpenModelica": _DESKTOPS,
    "OMSimulator": _DESKTOPS,
    "FMPy": frozenset(_PLATFORMS),
}
_FMI_3 = {
    "x86_64-linux": "linux64",
    "x86_64-windows": "win64",
    "x86_64-darwin": "darwin64",
    "aarch64-darwin": "darwin64",
}
# PythonFMU decodes no other character of the address that a host gives it, and crashes the host where that fails.
_PLAIN_PATH = "unpack it to a path of ASCII letters, digits, blanks and -._~ only: others crash the host"


class Level(Enum):
    """What a finding means to its reader."""

    GOOD = "ok"
    NOTE = "note"
    PROBLEM = "problem"


@dataclass(frozen=True)
class Finding:
    """One statement about an FMU."""

    level: Level
    topic: str
    text: str


def examine(path: Path, step_timeout: float = SECONDS) -> list[Finding]:
    """Everything there is to say. The FMU is sound, and runs here, if no finding is a problem.

    step_timeout: s, for one step of it, which is taken in a process of its own.
    """
    try:
        names, _ = fmu_members(path)
        model = fmpy.read_model_description(str(path), validate=False)
    except ArchiveError as error:
        return [Finding(Level.PROBLEM, "archive", str(error))]
    except Exception as error:  # fmpy's parsing raises many kinds
        return [Finding(Level.PROBLEM, "model description", f"cannot be read: {error}")]
    platforms = sorted({PurePosixPath(n).parts[1] for n in names if n.startswith("binaries/") and n.count("/") > 1})
    is_python = "resources/slavemodule.txt" in names
    findings = [*_standard(path, model), *_bounds(model), *_binaries(names, platforms, model)]
    if is_python:
        findings.append(_python_packages(path))
    complete = [platform for platform in platforms if not _missing_library(platform, names, model)]
    findings += [_here(path), *_hosts(complete, model, is_python)]
    findings.append(_trial(path, platforms, model, step_timeout))
    return findings


def _standard(path: Path, model: Any) -> Iterator[Finding]:
    yield Finding(Level.GOOD, "kind", f"FMI {model.fmiVersion}, {kinds_of(model)}")
    problems = validate_fmu(str(path))
    if not problems:
        yield Finding(Level.GOOD, "validation", "FMPy finds nothing to complain about")
    for problem in problems:
        yield Finding(Level.PROBLEM, "validation", " ".join(problem.split()))


def _bounds(model: Any) -> Iterator[Finding]:
    """Bounds and start values, which no checker looks at."""
    faults = []
    for v in model.modelVariables:
        declared = v.declaredType
        low, high = (getattr(v, a) or (getattr(declared, a) if declared else None) for a in ("min", "max"))
        try:
            least, most = float(low or "-inf"), float(high or "inf")
            number = v.type.rstrip("0123456789") in ("Real", "Float", "Integer", "Int", "UInt") and not v.shape
            start = float(v.start) if number and v.start is not None else None
        except ValueError as error:
            faults.append(f"{v.name}: {error}")
            continue
        if least > most:
            faults.append(f"{v.name}: min {least:g} exceeds max {most:g}")
        elif start is not None and not least <= start <= most:
            faults.append(f"{v.name}: start {start:g} is outside [{least:g}, {most:g}]")
    if not faults:
        yield Finding(Level.GOOD, "bounds", "every start value lies within its bounds")
    for fault in faults:
        yield Finding(Level.PROBLEM, "bounds", fault)


def _binaries(names: Collection[str], platforms: list[str], model: Any) -> Iterator[Finding]:
    if not platforms:
        has_sources = any(name.startswith("sources/") for name in names)
        remedy = "compile it from its sources with `fmpy compile`" if has_sources else "export it with binaries"
        yield Finding(Level.PROBLEM, "binaries", f"there are none; {remedy}")
    for platform in platforms:
        missing = _missing_library(platform, names, model)
        title = f"{platform} ({_PLATFORMS.get(platform, 'a platform without a name here')})"
        if missing:
            yield Finding(Level.PROBLEM, "binaries", f"{title}: {missing} is missing")
        else:
            yield Finding(Level.GOOD, "binaries", title)


def _missing_library(platform: str, names: Container[str], model: Any) -> str:
    """A library that should be in the platform's folder and is not; empty if all are, or if its suffix is unknown."""
    suffix = next((s for system, s in _SYSTEMS.items() if system in platform), "")
    parts = (model.coSimulation, model.modelExchange, model.scheduledExecution)
    wanted = [f"{part.modelIdentifier}{suffix}" for part in parts if part]
    return next((file for file in wanted if suffix and f"binaries/{platform}/{file}" not in names), "")


def _python_packages(path: Path) -> Finding:
    """What the Python sources inside import from outside."""
    pointer = "resources/slavemodule.txt"
    names, sources = read_members(path, lambda n: n == pointer or (n.startswith("resources/") and n.endswith(".py")))
    script = f"resources/{sources.pop(pointer).decode(errors='replace').strip()}.py"
    if script not in names:
        return Finding(Level.PROBLEM, "Python", f"{script} is missing, which {pointer} names")
    inside = {PurePosixPath(name).parts[1].removesuffix(".py") for name in names if name.startswith("resources/")}
    wanted = set()
    for name, source in sources.items():
        try:
            tree = ast.parse(source)
        except (SyntaxError, ValueError) as error:
            return Finding(Level.PROBLEM, "Python", f"{name} is no valid Python: {error}")
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                wanted |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
                wanted.add(node.module.split(".")[0])
    outside = sorted(wanted - inside - set(sys.stdlib_module_names))
    missing = [package for package in outside if importlib.util.find_spec(package) is None]
    text = f"needs Python in the host process, with {', '.join(outside) or 'no further package'}"
    if missing:
        return Finding(Level.PROBLEM, "Python", f"{text}; not installed here: {', '.join(missing)}")
    return Finding(Level.NOTE, "Python", f"{text} (all installed here); {_PLAIN_PATH}")


def _here(path: Path) -> Finding:
    """Whether imufmu runs it, as a plant or anything else in a system."""
    faults: list[str] = []
    try:
        model = read_fmu(path, faults)
    except ArchiveError as error:
        return Finding(Level.NOTE, "imufmu", f"does not run it: {str(error).removeprefix(f'{path}: ')}")
    solver = "" if model.coSimulation else ", its equations solved by CVode of FMPy"
    odd = ", and notes what breaks the standard; with --strict it refuses" if faults else ""
    return Finding(Level.GOOD, "imufmu", f"runs it as a component of a system on this machine{solver}{odd}")


def _hosts(platforms: list[str], model: Any, is_python: bool) -> Iterator[Finding]:
    if interface_of(model) is None:
        yield Finding(Level.NOTE, "hosts", f"for {kinds_of(model)}, which none of {', '.join(_HOSTS)} is known to run")
        return
    is_fmi_2 = str(model.fmiVersion).startswith("2.")
    for host, its_platforms in _HOSTS.items():
        known = its_platforms | (set() if is_fmi_2 else {new for new, old in _FMI_3.items() if old in its_platforms})
        where = ", ".join(_PLATFORMS[platform] for platform in platforms if platform in known)
        if not where:
            yield Finding(Level.NOTE, host, "nowhere: no binary for a platform that it runs on")
            continue
        needs = []
        if not is_fmi_2 and host != "FMPy":
            needs.append("an FMU 2.0" if host == "OpenModelica" else "a release that reads FMI 3.0")
        if host == "OpenModelica" and model.modelExchange is None:
            needs.append("OMSimulator, its part for co-simulation")
        if is_python and host != "FMPy":
            needs.append("the Python named above and its packages; on Linux started with LD_PRELOAD=libpython3.x.so")
        text = f"{where}; needs {' and '.join(needs)}" if needs else where
        yield Finding(Level.NOTE if needs else Level.GOOD, host, text)


def _trial(path: Path, platforms: list[str], model: Any, seconds: float) -> Finding:
    if interface_of(model) is None:
        return Finding(Level.NOTE, "one step", f"not tried: FMPy does not run FMUs for {kinds_of(model)}")
    if not {fmpy.platform, fmpy.platform_tuple} & set(platforms):
        return Finding(Level.PROBLEM, "one step", f"not tried: no binary for this machine ({fmpy.platform})")
    trial = try_step(path, seconds)
    # A crash by chance and one by design are different news; an endless loop is not worth another minute.
    if trial.fault and not trial.hung and not try_step(path, seconds).fault:
        return Finding(Level.NOTE, "one step", f"works on this machine in one of two tries; in the other {trial.fault}")
    said = f" It said: {' | '.join(trial.said.splitlines()[-3:])}" if trial.said else ""
    if trial.fault:
        return Finding(Level.PROBLEM, "one step", f"{trial.fault.rstrip('.')}.{said}")
    if trial.closing:
        return Finding(Level.NOTE, "one step", f"works on this machine, but when closed {trial.closing}.{said}")
    return Finding(Level.GOOD, "one step", f"works on this machine.{said}")
