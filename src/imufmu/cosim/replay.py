"""Replay a recording through an estimator FMU: one step per sample, one row of outputs per row of the file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..blocks.columns import Columns, Tabular
from ..blocks.vocabulary import ACCEL, FORWARD_SPEED, GYRO, MAG
from ..files.atomic import check_not_read
from ..files.csv_table import write_csv
from ..files.names import no_such
from ..fmi.archive import read_fmu
from ..fmi.build import cached_fmu
from ..fmi.native import cached_native_fmu
from ..fmi.own import is_ours
from ..recordings.checks import axes_doubts
from ..recordings.reading import Recording, hold_missing
from ..registry import BLOCKS, DELAYED, ESTIMATORS
from .apart import Instance, Instances
from .errors import STEP_TIMEOUT, EndOfRun, SimulationError
from .interface import Interface, WiringError, unit_of
from .interrupt import Terminated, interrupt_between_calls
from .links import Wiring
from .results import Result, partial_remark
from .settings import Setting, given_settings
from .slave import Inlet, Outlet
from .units import SAME, Unit, UnitError, conversion

_READINGS = {signal.name: signal for signal in (GYRO, ACCEL, MAG, FORWARD_SPEED)}
_OPTIONAL = (MAG.name, FORWARD_SPEED.name)
VALID = "_valid"  # end of the name of an input that is 1 where the reading of that name is to be used
_BETWEEN_PROGRESS = 1000  # samples
_SAME_PERIOD = 1e-6  # relative; a larger deviation would shift the sample clock by a sample within a minute or so


@dataclass(frozen=True, eq=False)
class Replay(Tabular):
    """Outputs of an estimator over a recording, one row per row of the file.

    estimator: its name. columns: (n,) by FMU variable name, in the order of the FMU. units: by variable name. notes:
    what a user should know. partial: empty for a replay that reached the end of the file; else how far it came and why
    it ended, with columns of less rows than the file has.
    """

    recording: Recording
    estimator: str
    columns: dict[str, np.ndarray]
    units: dict[str, str]
    notes: tuple[str, ...]
    partial: str = ""

    def signals(self) -> dict[str, np.ndarray]:
        """Columns as signals: roll (n,), vertical (n, 3), ..."""
        return _signals(self.columns)

    def truth(self) -> dict[str, np.ndarray]:
        """What the file knows, in the axes of the estimates: those of the file."""
        return self.recording.axes.from_ours(self.recording.truth)

    def __repr__(self) -> str:
        return f"<Replay of {self.recording.name!r} through {self.estimator}: {len(self.columns)} variables>"

    def to_csv(self, path: str | Path) -> None:
        """Write time and all columns; where they are partial a last line says so, behind a #. Raises WriteError."""
        check_not_read(path, [self.recording.path])
        write_csv(path, {"time": self._time, **self.columns}, partial_remark(self.partial))

    def to_hdf5(self, path: str | Path) -> list[str]:
        """Write a file as that of a Result: ``/time`` and ``/estimator/variable``. Returns notes; raises WriteError."""
        check_not_read(path, [self.recording.path])
        columns = {f"{self.estimator}.{name}": column for name, column in self.columns.items()}
        units = {f"{self.estimator}.{name}": unit for name, unit in self.units.items()}
        return Result(self.recording.name, self._time, columns, units, self.notes, self.partial).to_hdf5(path)

    def _table(self) -> Columns:
        return Result(self.recording.name, self._time, self.columns, self.units, self.notes, self.partial)._table()

    @property
    def _time(self) -> np.ndarray:
        rows = min((len(column) for column in self.columns.values()), default=len(self.recording.time))
        return self.recording.time[:rows]


def _signals(columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    parts: dict[str, list[np.ndarray]] = {}
    for name, values in columns.items():
        parts.setdefault(name.split("[")[0], []).append(values)
    vectors = {name.split("[")[0] for name in columns if "[" in name}
    return {name: np.column_stack(part) if name in vectors else part[0] for name, part in parts.items()}


def in_axes_of(recording: Recording, columns: dict[str, np.ndarray], units: Mapping[str, str]) -> dict[str, np.ndarray]:
    """Estimates (n,) by variable name in the axes of the recording's file, and not in ours. units: by variable name."""
    if recording.axes.are_ours:
        return columns
    scales = {name: np.pi / 180 for name in ("roll", "pitch", "yaw") if units.get(name) == "deg"}
    turned = recording.axes.from_ours(_signals({name: scales.get(name, 1) * c for name, c in columns.items()}))
    flat = dict(columns)
    for name, values in turned.items():
        if values.ndim == 1:
            flat[name] = values / scales.get(name, 1)
        elif f"{name}[1]" in columns:
            flat |= {f"{name}[{i + 1}]": values[:, i] for i in range(values.shape[1])}
    return flat


def estimator_fmu(name: str, *, native: bool = False) -> Path:
    """The FMU a user means: a file, or an estimator of imufmu by name, in Python or native. Raises ValueError."""
    if name in BLOCKS:
        return (cached_native_fmu if native else cached_fmu)(name)
    if Path(name).suffix.lower() == ".fmu":
        return Path(name)
    known = [block.name for block in (*ESTIMATORS, *DELAYED)]
    raise ValueError(no_such("estimator", name, known, "or give the path of an .fmu file"))


def replay(
    recording: Recording,
    fmu: Path,
    parameters: Mapping[str, Any] | None = None,
    *,
    local_variables: bool = False,
    in_process: bool = False,
    step_timeout: float = STEP_TIMEOUT,
    progress: Callable[[int, int], None] | None = None,
) -> Replay:
    """Run the recording through an FMU whose inputs are gyro and accel (and mag), [1] to [3] each (and forward_speed).

    parameters: start values by variable name; ``sample_period`` follows the recording. Samples the recording lacks are
    given as NaN to an FMU that reports a ``status``, and are held for any other; inputs that it lacks altogether stay
    at their start values. local_variables: also return those. in_process, step_timeout: as for ``simulate``.

    Raises ArchiveError, WiringError (the FMU or a parameter does not fit) and SimulationError. That, and
    KeyboardInterrupt, has the rows up to there as ``result``, where there are any.
    """
    faults: list[str] = []
    model = read_fmu(fmu, faults)
    interface = Interface.of_model(model.modelName, model)
    used, readings, notes = _inputs(interface, recording, fmu)
    notes += [f"not as the standard has it: {fault}" for fault in faults]
    settings = _settings(interface, recording, dict(parameters or {}), fmu)
    outputs = [v for v in interface.of("output") if v.type == "Real"]
    reported = outputs + [v for v in interface.of("local") if v.type == "Real" and local_variables]
    ended = ""
    run = _Run(readings, float(recording.time[0]), recording.sample_period, len(reported))

    def result(partial: str = "") -> Replay:
        rows = np.searchsorted(recording.sample_index, run.done)
        at_rows = run.rows[recording.sample_index[:rows]]
        units = {v.name: unit_of(v) or "" for v in reported}
        return Replay(
            recording,
            interface.component,
            in_axes_of(recording, {v.name: at_rows[:, i] for i, v in enumerate(reported)}, units),
            units,
            (*recording.notes, *axes_doubts(recording), *notes),
            f"{rows} of {len(recording.time)} rows: {partial}" if partial else "",
        )

    try:
        with ExitStack() as stack:
            check = stack.enter_context(interrupt_between_calls())
            instances = Instances(stack, in_process, step_timeout, check)
            slave = instances.start(interface.component, fmu, model, is_ours(fmu))
            sources = np.arange(len(used))
            inlet = Inlet("Real", used, run.now, sources, np.ones(len(used)), np.zeros(len(used)))
            slave.connect([Outlet("Real", reported, len(outputs), run.values)], [inlet])
            slave.ready()
            try:
                run(slave, settings, check, progress)
            except EndOfRun as end:
                if not run.done:
                    raise
                ended = str(end)
            notes += slave.notes
            slave.close()
    except (SimulationError, KeyboardInterrupt, Terminated) as error:
        if run.done:
            reason = str(error) if isinstance(error, SimulationError) else "interrupted"
            error.result = result(reason)  # type: ignore[union-attr]
        raise
    return result(ended)


class _Run:
    """All samples of a recording through one instance.

    readings: (n, inputs), one row per sample. start, period: s. rows: (n, outputs), of which ``done`` are filled.
    """

    def __init__(self, readings: np.ndarray, start: float, period: float, outputs: int) -> None:
        self._readings, self._start, self._period = readings, start, period
        self.now, self.values = np.empty(readings.shape[1]), np.empty(outputs)
        self.rows = np.empty((len(readings), outputs))
        self.done = 0

    def __call__(
        self,
        slave: Instance,
        settings: tuple[Setting, ...],
        check: Callable[[], None],
        progress: Callable[[int, int], None] | None,
    ) -> None:
        start, period = self._start, self._period
        slave.enter_initialisation(settings, start, start + len(self._readings) * period)
        self.now[:] = self._readings[0]
        slave.gather()
        slave.write(start)
        slave.exit_initialisation(start)
        for k, row in enumerate(self._readings):
            check()
            time = start + k * period
            self.now[:] = row
            slave.gather()
            slave.advance(time, period, time)
            self.rows[k] = self.values
            self.done = k + 1
            if progress and k % _BETWEEN_PROGRESS == 0:
                progress(k, len(self._readings))


def _inputs(interface: Interface, recording: Recording, fmu: Path) -> tuple[list[Any], np.ndarray, list[str]]:
    """Input variables of the FMU that the recording feeds, their values at every instant, and notes."""
    notes: list[str] = []
    problems, used, columns = [], [], []
    instants = recording.at_instants()
    inputs = _from_one(interface.of("input"), notes)
    for name, signal in _READINGS.items():
        wanted = [element for element in signal.element_names() if element in inputs]
        if not wanted and name in instants:
            if name not in _OPTIONAL:
                problems.append(f"it has no input {name}[1]; its inputs are {', '.join(inputs) or 'none'}")
            continue
        if name not in instants:
            unset = [element for element in wanted if inputs[element].start is None]
            problems += [f"it needs {element}, which {recording.path} does not have" for element in unset]
            continue
        values = instants[name].reshape(len(instants[name]), -1)
        for i, element in enumerate(signal.element_names()):
            variable = inputs.get(element)
            if variable is None:
                continue
            try:
                linear = conversion(Unit(signal.unit), interface.unit(variable))
            except UnitError as error:
                problems.append(f"{element}: {error}")
                continue
            used.append(variable)
            columns.append(values[:, i] if linear == SAME else linear.factor * values[:, i] + linear.offset)
        if wanted and name + VALID in inputs:
            used.append(inputs[name + VALID])
            columns.append(np.isfinite(values).all(axis=1).astype(float))
    if problems:
        raise WiringError(fmu, problems, f"cannot replay {recording.path}")
    free = [variable.name for variable in inputs.values() if variable not in used]
    if free:
        notes.append(f"inputs not in the recording stay at their start values: {', '.join(free)}")
    readings = np.column_stack(columns)
    missing = ~np.isfinite(readings).all(axis=1)
    if missing.any() and "status" not in interface.variables:
        readings = hold_missing(readings)
        notes.append(f"{missing.sum()} of {len(readings)} samples are incomplete; held, as the FMU has no status")
    return used, readings, notes


def _from_one(inputs: Sequence[Any], notes: list[str]) -> dict[str, Any]:
    """Inputs by name; those of a reading whose FMU counts from 0 by the names of the same axes that count from 1."""
    names = {variable.name: variable for variable in inputs}
    for reading in _READINGS:
        if f"{reading}[0]" in names:
            if f"{reading}[3]" in names:
                raise ValueError(f"inputs {reading}[0] to {reading}[3] of the FMU: which three of them are x, y, z?")
            axes = [names.pop(f"{reading}[{i}]", None) for i in range(3)]
            names |= {f"{reading}[{i}]": axis for i, axis in enumerate(axes, 1) if axis is not None}
            notes.append(f"inputs {reading}[0], [1], [2] count from 0: taken for the axes x, y, z")
    return names


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
    settings = given_settings(full_names, Wiring.of_one(interface), problems)
    if problems:
        raise WiringError(fmu, problems, f"cannot replay {recording.path}")
    return settings
