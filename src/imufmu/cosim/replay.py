"""Replay a recording through an estimator FMU: one step per sample, one row of outputs per row of the file."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..blocks.vocabulary import ACCEL, GYRO, MAG
from ..files.csv_table import write_csv
from ..fmi.archive import open_fmu
from ..fmi.build import cached_fmu
from ..fmi.native import cached_native_fmu
from ..recordings.reading import Recording, hold_missing
from ..registry import BLOCKS, ESTIMATORS
from .interface import Interface, WiringError, unit_of
from .interrupt import interrupt_between_calls
from .settings import Setting, given_settings
from .slave import Inlet, Outlet, Slave, forget_paths

_READINGS = {signal.name: signal for signal in (GYRO, ACCEL, MAG)}
_BETWEEN_PROGRESS = 1000  # samples
_SAME_PERIOD = 1e-6  # relative; a larger deviation would shift the sample clock by a sample within a minute or so


@dataclass(frozen=True, eq=False)
class Replay:
    """Outputs of an estimator over a recording, one row per row of the file.

    estimator: its name. columns: (n,) by FMU variable name, in the order of the FMU. units: by variable name. notes:
    what a user should know.
    """

    recording: Recording
    estimator: str
    columns: dict[str, np.ndarray]
    units: dict[str, str]
    notes: tuple[str, ...]

    def signals(self) -> dict[str, np.ndarray]:
        """Columns as signals: roll (n,), vertical (n, 3), ..."""
        parts: dict[str, list[np.ndarray]] = {}
        for name, values in self.columns.items():
            parts.setdefault(name.split("[")[0], []).append(values)
        vectors = {name.split("[")[0] for name in self.columns if "[" in name}
        return {name: np.column_stack(part) if name in vectors else part[0] for name, part in parts.items()}

    def to_csv(self, path: Path) -> None:
        """Write time and all columns. Raises WriteError."""
        write_csv(path, {"time": self.recording.time, **self.columns})


def estimator_fmu(name: str, *, native: bool = False) -> Path:
    """The FMU a user means: a file, or an estimator of imufmu by name, in Python or native. Raises ValueError."""
    if name in BLOCKS:
        return (cached_native_fmu if native else cached_fmu)(name)
    if Path(name).suffix.lower() == ".fmu":
        return Path(name)
    known = ", ".join(block.name for block in ESTIMATORS)
    raise ValueError(f"no estimator is called {name!r}; there is {known}, or give the path of an .fmu file")


def replay(
    recording: Recording,
    fmu: Path,
    parameters: Mapping[str, Any] | None = None,
    *,
    local_variables: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Replay:
    """Run the recording through an FMU whose inputs are gyro and accel (and mag), [1] to [3] each.

    parameters: start values by variable name; ``sample_period`` follows the recording. Samples the recording lacks are
    given as NaN to an FMU that reports a ``status``, and are held for any other. local_variables: also return those.

    Raises ArchiveError, WiringError (the FMU or a parameter does not fit) and SimulationError.
    """
    with tempfile.TemporaryDirectory(prefix="imufmu_replay_", ignore_cleanup_errors=True) as folder:
        library, model = open_fmu(fmu, Path(folder))
        interface = Interface(model.modelName, {v.name: v for v in model.modelVariables})
        used, readings, notes = _inputs(interface, recording, fmu)
        settings = _settings(interface, recording, dict(parameters or {}), fmu)
        outputs = [v for v in interface.of("output") if v.type == "Real"]
        reported = outputs + [v for v in interface.of("local") if v.type == "Real" and local_variables]
        now, values = np.empty(len(used)), np.empty(len(reported))
        with interrupt_between_calls() as check:
            slave = Slave(interface.component, library, Path(folder), model)
            try:
                sources = np.arange(len(used))
                inlet = Inlet("Real", used, now, sources, np.ones(len(used)), np.zeros(len(used)))
                slave.connect([Outlet("Real", reported, len(outputs), values)], [inlet])
                clock = (float(recording.time[0]), recording.sample_period)
                rows = _run(slave, settings, clock, readings, now, values, check, progress)
                notes += slave.notes
            finally:
                slave.close()
                forget_paths(Path(folder))
    at_rows = rows[recording.sample_index]
    return Replay(
        recording,
        interface.component,
        {v.name: at_rows[:, i] for i, v in enumerate(reported)},
        {v.name: unit_of(v) or "" for v in reported},
        (*recording.notes, *notes),
    )


def _run(
    slave: Slave,
    settings: tuple[Setting, ...],
    clock: tuple[float, float],
    readings: np.ndarray,
    now: np.ndarray,
    values: np.ndarray,
    check: Callable[[], None],
    progress: Callable[[int, int], None] | None,
) -> np.ndarray:
    """Values of the FMU after every row of readings; clock: start time and sample period (s)."""
    start, period = clock
    rows = np.empty((len(readings), len(values)))
    slave.enter_initialisation(settings, start)
    now[:] = readings[0]
    slave.gather()
    slave.write(start)
    slave.exit_initialisation(start)
    for k, row in enumerate(readings):
        check()
        time = start + k * period
        now[:] = row
        slave.gather()
        slave.write(time)
        slave.step(time, period)
        slave.read(time)
        rows[k] = values
        if progress and k % _BETWEEN_PROGRESS == 0:
            progress(k, len(readings))
    return rows


def _inputs(interface: Interface, recording: Recording, fmu: Path) -> tuple[list[Any], np.ndarray, list[str]]:
    """Input variables of the FMU that the recording feeds, their values at every instant, and notes."""
    problems, notes, used, columns = [], [], [], []
    instants = recording.at_instants()
    inputs = {v.name: v for v in interface.of("input")}
    for name, signal in _READINGS.items():
        wanted = [element for element in signal.element_names() if element in inputs]
        if not wanted and name in instants:
            if name != "mag":
                problems.append(f"it has no input {name}[1]; its inputs are {', '.join(inputs) or 'none'}")
            continue
        if wanted and name not in instants:
            problems.append(f"it needs {name}, which {recording.path} does not have")
            continue
        for i, element in enumerate(signal.element_names()):
            variable = inputs.get(element)
            if variable is None:
                continue
            if unit_of(variable) not in (None, signal.unit):
                problems.append(f"{element} is in {unit_of(variable)}, the recording in {signal.unit}")
            used.append(variable)
            columns.append(instants[name][:, i])
    if problems:
        raise WiringError(fmu, problems, f"cannot replay {recording.path}")
    free = [name for name in inputs if name not in {v.name for v in used}]
    if free:
        notes.append(f"inputs not in the recording stay at their start values: {', '.join(free)}")
    readings = np.column_stack(columns)
    missing = ~np.isfinite(readings).all(axis=1)
    if missing.any() and "status" not in interface.variables:
        readings = hold_missing(readings)
        notes.append(f"{missing.sum()} of {len(readings)} samples are incomplete; held, as the FMU has no status")
    return used, readings, notes


def _settings(interface: Interface, recording: Recording, parameters: dict[str, Any], fmu: Path) -> tuple[Setting, ...]:
    """Start values, the sample period taken from the recording. Raises WiringError."""
    problems: list[str] = []
    period = recording.sample_period
    given = parameters.setdefault("sample_period", period) if "sample_period" in interface.variables else period
    if isinstance(given, int | float) and abs(given - period) > _SAME_PERIOD * period:
        problems.append(
            f"sample_period = {given:g} s, but {recording.path} has a sample every {period:.9g} s; "
            "leave it out, it follows the recording"
        )
    full_names = {f"{interface.component}.{name}": value for name, value in parameters.items()}
    settings = given_settings(full_names, {interface.component: interface}, problems)
    if problems:
        raise WiringError(fmu, problems, f"cannot replay {recording.path}")
    return settings
