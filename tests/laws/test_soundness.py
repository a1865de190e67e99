"""Whatever sensors say, an estimator keeps its numbers: covariances positive, outputs finite, lost ones begun anew."""

from __future__ import annotations

import contextlib
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy import extract, fmi2, read_model_description
from fmpy.fmi1 import FMICallException

from imufmu.blocks.block import Block, SampledBlock
from imufmu.blocks.instance import SampledInstance
from imufmu.blocks.running import run
from imufmu.blocks.signals import State, total_size
from imufmu.blocks.vocabulary import Status
from imufmu.compiled import library, running
from imufmu.fmi.native import build_native
from imufmu.registry import BLOCKS, ESTIMATORS
from support import fmu
from support.backends import BACKENDS, Backend
from support.fragile import BREAKS, FRAGILE, FRAGILE_SLOWLY

EVERY = pytest.mark.parametrize("block", ESTIMATORS, ids=lambda block: block.name)
BACKEND = pytest.mark.parametrize("backend", BACKENDS, ids=lambda backend: backend.name)

CHUNK = 1024
FULL_SCALE = math.radians(2000)  # rad/s, of a usual gyroscope


# Hardship: turns up to the gyroscope's range, single samples and long gaps missing in every sensor


def hard_rows(block: SampledBlock, rng: np.random.Generator, first: int, dt: float, fastest: float) -> np.ndarray:
    """CHUNK rows of all inputs (CHUNK, n): NaN where a sample is missing, one in ten and now and then hundreds."""
    t, columns = (first + np.arange(CHUNK)[:, None]) * dt, []
    for s in block.inputs:
        turn = np.sin(2 * np.pi * np.array([0.31, 0.17, 0.23]) * t + [0, 2, 4])
        size = {"gyro": fastest, "accel": 10.0, "mag": 50.0}.get(s.name.rstrip("12"), s.nominal)
        values = size * turn[:, : s.size] + rng.normal(0, 0.1 * size, (CHUNK, s.size))
        values = np.clip(values, s.minimum, s.maximum)
        values[rng.random(CHUNK) < 0.1] = math.nan
        if rng.random() < 0.5:
            begins = rng.integers(CHUNK)
            values[begins : begins + rng.integers(1, 500)] = math.nan
        columns.append(values)
    return np.hstack(columns)


def covariances(state: tuple[State, ...], x: np.ndarray) -> dict[str, np.ndarray]:
    """Matrices (n, k, k) by name from states (n, ...): those called P..., whole or as an upper triangle row by row."""
    found, first = {}, 0
    for s in state:
        values, first = x[:, first : first + s.size], first + s.size
        if not s.name.startswith("P"):
            continue
        if len(s.shape) == 2:
            found[s.name] = values.reshape(-1, *s.shape)
            continue
        k = round((math.sqrt(8 * s.size + 1) - 1) / 2)
        matrix, (i, j) = np.empty((len(x), k, k)), np.triu_indices(k)
        matrix[:, i, j] = matrix[:, j, i] = values
        found[s.name] = matrix
    return found


def assert_covariances_survive(block: SampledBlock, samples: int, fastest: float, parameters: dict[str, Any]) -> None:
    rng, chunk = np.random.default_rng(17), block.next_function.mapaccum(CHUNK)
    p, no_draws = block.parameter_vector(parameters), np.zeros((0, CHUNK))
    x = block.first_function(block.start_vector(block.inputs), p, [])[0].full().ravel()
    status, dt = block.place_of("status"), p[0]
    for first in range(0, samples, CHUNK):
        u = hard_rows(block, rng, first, dt, fastest)
        states, reported = (part.full() for part in chunk(x, u.T, np.tile(p[:, None], CHUNK), no_draws))
        x = states[:, -1]
        assert np.isfinite(states).all() and np.isfinite(reported).all()
        assert not (reported[status].astype(int) & Status.RESTARTED).any()
        for name, P in covariances(block.state, states[: total_size(block.state)].T).items():
            assert np.array_equal(P, P.transpose(0, 2, 1)), name
            # Eigenvalues are computed to some 1e-15 of the largest one.
            least, trace = np.linalg.eigvalsh(P)[:, 0], np.trace(P, axis1=1, axis2=2)
            assert (least >= -1e-14 * trace).all(), f"{name}: {(least / trace).min()} of the trace"


@EVERY
@pytest.mark.parametrize("fastest", [3.0, FULL_SCALE, 300.0])
def test_covariances_stay_symmetric_and_positive_and_outputs_finite(block: SampledBlock, fastest: float) -> None:
    assert_covariances_survive(block, 8 * CHUNK, fastest, {})


@EVERY
def test_covariances_stay_positive_with_every_variance_at_its_least(block: SampledBlock) -> None:
    """A filter without process noise and with perfect sensors has nothing that heals what rounding breaks."""
    names = ("sigma_g2", "sigma_a2", "sigma_m2", "q_d", "q_1", "q_2", "q_b", "r1", "r2", "r3_slow", "r3_fast")
    sharp = {q.name: q.minimum for q in block.own_parameters if q.name in names}
    assert_covariances_survive(block, 4 * CHUNK, FULL_SCALE, sharp)


@pytest.mark.slow
@EVERY
def test_covariances_stay_positive_over_a_million_samples(block: SampledBlock) -> None:
    assert_covariances_survive(block, 10**6, FULL_SCALE, {})


# Readings that no sensor gives


def quiet_inputs(block: Block, rows: int) -> dict[str, np.ndarray]:
    """At rest, with a little noise: every element near its start value."""
    rng = np.random.default_rng(3)
    noisy = {s.name: s.start_values() + rng.normal(0, 0.01, (rows, s.size)) for s in block.inputs}
    return {s.name: np.clip(noisy[s.name], s.minimum, s.maximum) for s in block.inputs}


@BACKEND
@EVERY
def test_a_reading_out_of_its_bounds_counts_as_missing(block: SampledBlock, backend: Backend) -> None:
    """Bit for bit, and in status: just beyond a bound, 1e8, 1e20 and 1e300 are what NaN is.

    The bounds themselves are not, but to a filter that knows the range of its sensor.
    """
    parameters = {q.name for q in block.own_parameters}
    for i, s in enumerate(block.inputs):
        absent, beyond, within = (quiet_inputs(block, 60) for _ in range(3))
        garbage = [np.nextafter(s.maximum, math.inf), np.nextafter(s.minimum, -math.inf), 1e8, -1e20, 1e300]
        for row, value in zip((7, 20, 21, 33, 50), garbage, strict=True):
            absent[s.name][row, i % s.size] = math.nan
            beyond[s.name][row, i % s.size] = value
            within[s.name][row, i % s.size] = s.maximum
        expected, actual = (backend.run(block, inputs, {}, 60) for inputs in (absent, beyond))
        assert all(np.array_equal(actual[y.name], expected[y.name]) for y in block.reported)
        used = backend.run(block, within, {}, 60)
        flags = {"gyro": Status.GYRO_MISSING, "accel": Status.ACCEL_MISSING, "mag": Status.MAG_MISSING}
        flag = flags.get(s.name.rstrip("12"))
        if flag:
            assert np.flatnonzero(actual["status"].astype(int) & flag).tolist() == [7, 20, 21, 33, 50]
            assert f"{s.name}_range" in parameters or not (used["status"].astype(int) & flag).any()


@pytest.mark.parametrize("kind", fmu.KINDS)
def test_an_fmu_warns_once_per_episode_of_readings_out_of_bounds(kind: str) -> None:
    instance = fmu.Fmu("lee2012", kind=kind).initialise()
    limits = {s.name: s.maximum for s in BLOCKS["lee2012"].inputs}
    episode = {"gyro[2]": -1.01 * limits["gyro"], "accel[1]": 1.01 * limits["accel"]}
    for k, values in enumerate([{}, episode, episode, {}, episode]):
        instance.set({"gyro[2]": limits["gyro"], "accel[1]": -limits["accel"]} | values)  # a bound itself is a reading
        with contextlib.suppress(FMICallException):  # FMPy takes a warning for a failure
            instance.step(0.01 * k, 0.01)
    said = [message for _, message in instance.log]
    assert said == ["lee2012: not finite or out of bounds, treated as missing: gyro[2], accel[1]"] * 2
    instance.close()


# Numbers lost


@EVERY
@pytest.mark.parametrize("value", [math.nan, math.inf, 1e200])
def test_an_estimator_whose_state_is_not_finite_begins_anew_and_says_so(block: SampledBlock, value: float) -> None:
    """From there on it is what a fresh one is that starts with that sample."""
    lost, fresh = SampledInstance(block), SampledInstance(block)
    inputs = np.hstack(list(quiet_inputs(block, 30).values()))
    for instance in (lost, fresh):
        instance.initialise(0.0)
    for k in range(30):
        lost.u[:] = inputs[k]
        if k == 10:
            lost.x[:] = value
        lost.sample()
        status = Status(int(lost.y[block.place_of("status")]))
        assert (Status.RESTARTED in status) == (k == 10)
        if k >= 10:
            fresh.u[:] = inputs[k]
            fresh.sample()
            assert np.array_equal(lost.x, fresh.x)
        assert np.isfinite(lost.y).all()


BROKEN_ROWS = (5, 6, 7, 14, 30)


def fragile_record() -> np.ndarray:
    values = np.random.default_rng(1).uniform(0, 9, 40)
    values[list(BROKEN_ROWS)] = BREAKS
    values[[20, 21]] = (math.nan, 20.5)  # missing, and beyond its bounds
    return values


def begun_anew(block: SampledBlock) -> np.ndarray:
    """Columns total, samples, status (n, 3) that the block must report, written out."""
    total, samples, held, rows = 0.0, 0, 0.0, []
    for k, value in enumerate(fragile_record()):
        missing = not -10 <= value <= 20
        held = held if missing else float(value)
        samples += 1
        due = block is FRAGILE or samples % 2 == 0
        lost = k > 0 and due and held < 0
        if k == 0 or lost:
            total, samples = abs(held), 1
        elif due:
            total += math.sqrt(held)
        rows.append((total, samples, Status.GYRO_MISSING * missing + Status.RESTARTED * lost))
    return np.array(rows, dtype=float)


@pytest.mark.parametrize("block", [FRAGILE, FRAGILE_SLOWLY], ids=lambda block: block.name)
def test_a_restart_is_the_same_interpreted_compiled_and_in_a_native_fmu(
    block: SampledBlock, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    values, expected = fragile_record(), begun_anew(block)
    assert (expected[:, 2] >= Status.RESTARTED).any()
    monkeypatch.setattr(library, "_ROWS_FOR_A_COMPILATION", 0)
    for result in (run(block, {"value": values}), running.run(block, {"value": values})):
        assert np.array_equal(np.column_stack([result[name] for name in ("total", "samples", "status")]), expected)
    assert library.compiled(block).library(0) is not None

    monkeypatch.setitem(BLOCKS, block.name, block)
    folder = extract(str(build_native(block.name, tmp_path)), str(tmp_path / "unpacked"))
    model = read_model_description(folder)
    slave = fmi2.FMU2Slave(
        guid=model.guid, unzipDirectory=folder, modelIdentifier=model.coSimulation.modelIdentifier, instanceName="toy"
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    references = {v.name: v.valueReference for v in model.modelVariables}
    rows = []
    for k, value in enumerate(values):
        slave.setReal([references["value"]], [value])
        slave.doStep(0.01 * k, 0.01)
        rows.append(slave.getReal([references[name] for name in ("total", "samples", "status")]))
    slave.terminate()
    slave.freeInstance()
    assert np.array_equal(rows, expected)
