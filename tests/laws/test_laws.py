"""Laws that every registered block keeps, on every backend. A new block joins by its registration."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imufmu.blocks import vocabulary as v
from imufmu.blocks.block import Block, ContinuousBlock, SampledBlock
from imufmu.blocks.running import Trajectory
from imufmu.blocks.signals import UNITS, Signal
from imufmu.blocks.vocabulary import MID_EUROPE, Status
from imufmu.compiled.running import simulate
from imufmu.registry import BLOCKS, ESTIMATORS, PLANTS
from support import motions
from support.backends import BACKENDS, PLANT_STEP, Backend, InProcess, Refused
from support.motions import angle
from support.truth_consistency import assert_signals_agree, assert_truth_consistent

ROWS = 300
BACKEND = pytest.mark.parametrize("backend", BACKENDS, ids=lambda backend: backend.name)
OTHER_BACKEND = pytest.mark.parametrize("backend", BACKENDS[1:], ids=lambda backend: backend.name)

# Inputs that a motion can feed, and the flag that says a reading is missing.
OF_A_MOTION = {
    "gyro": "gyro",
    "accel": "accel",
    "mag": "mag",
    "angular_velocity": "gyro",
    "specific_force": "accel",
    "magnetic_field": "mag",
}
MISSING = {"gyro": Status.GYRO_MISSING, "accel": Status.ACCEL_MISSING, "mag": Status.MAG_MISSING}


def names(signals: Iterable[Signal]) -> set[str]:
    return {signal.name for signal in signals}


def over(blocks: Iterable[Block]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("block", list(blocks), ids=lambda block: block.name)


EVERY = over(BLOCKS.values())
SEEDED = over(block for block in BLOCKS.values() if "seed" in names(block.parameters))
OF_TILT = [b for b in ESTIMATORS if names(b.inputs) >= {"gyro", "accel"} and "vertical" in names(b.outputs)]
OF_HEADING = [b for b in OF_TILT if "mag" in names(b.inputs)]


def period_of(block: Block) -> float:
    return block.period if isinstance(block, SampledBlock) else PLANT_STEP


def fed_by(block: Block, motion: motions.Motion) -> dict[str, np.ndarray]:
    """The inputs of the block that the motion has."""
    return {s.name: getattr(motion, OF_A_MOTION[s.name]) for s in block.inputs if s.name in OF_A_MOTION}


def ordinary_inputs(block: Block, seed: int = 0, rows: int = ROWS) -> dict[str, np.ndarray]:
    """A tumbling and shaken sensor; any other input wanders about its start by its nominal value."""
    rng, dt = np.random.default_rng(seed), period_of(block)
    inputs = fed_by(block, motions.motion(rng, rows, dt=dt))
    for s in block.inputs:
        if s.name not in inputs:
            waves = motions.wander(rng, np.arange(rows) * dt, 0.3 * s.nominal)[:, np.arange(s.size) % 3]
            inputs[s.name] = np.clip(s.start_values() + waves, s.minimum, s.maximum)
    return inputs


def assert_finite(block: Block, result: Trajectory, what: str) -> None:
    for s in block.reported:
        assert np.isfinite(result[s.name]).all(), f"{block.name}, {what}: {s.name} is not finite"


# Declarations


@EVERY
def test_every_variable_is_described_with_unit_and_bounds(block: Block) -> None:
    declared = (*block.inputs, *block.parameters, *block.reported)
    for s in declared:
        assert s.unit in UNITS
        assert math.isfinite(s.minimum) and math.isfinite(s.maximum) and s.minimum <= s.maximum, s.name
        assert len(s.description) >= 8, s.name
        assert s.nominal > 0, s.name
    # gyro_bias and accel_bias may share a text, two variables of gyro may not.
    families = [(s.name.split("_")[0], s.description) for s in declared]
    assert len(set(families)) == len(families), "two variables of one description"
    assert all(v.signal.minimum <= v.start <= v.signal.maximum for v in block.variables)


@EVERY
def test_every_block_says_what_it_is(block: Block) -> None:
    assert BLOCKS[block.name] is block
    assert block.summary and block.doc and block.reference


# Whatever comes in


@BACKEND
@EVERY
def test_outputs_of_ordinary_motion_lie_within_their_bounds(block: Block, backend: Backend) -> None:
    result = backend.run(block, ordinary_inputs(block), {}, ROWS)
    for s in block.reported:
        assert np.all((result[s.name] >= s.minimum) & (result[s.name] <= s.maximum)), s.name


@BACKEND
@EVERY
def test_missing_inputs_never_reach_the_outputs(block: Block, backend: Backend) -> None:
    """Single elements, whole rows, gaps, and inputs that are missing from the first sample to the last."""
    rng, inputs = np.random.default_rng(5), ordinary_inputs(block)
    for values in inputs.values():
        rows, columns = rng.integers(0, ROWS, 60), rng.integers(0, values.shape[1], 60)
        values[rows, columns] = rng.choice([math.nan, math.inf, -math.inf, 1e200], 60)
        values[100:150] = math.nan
    assert_finite(block, backend.run(block, inputs, {}, ROWS), "some missing")
    for name in inputs:
        never = inputs | {name: np.full_like(inputs[name], math.nan)}
        assert_finite(block, backend.run(block, never, {}, ROWS), f"{name} always missing")
    nothing = {name: np.full_like(values, math.nan) for name, values in inputs.items()}
    assert_finite(block, backend.run(block, nothing, {}, ROWS), "all missing")


@BACKEND
@EVERY
def test_outputs_are_finite_for_extreme_inputs(block: Block, backend: Backend) -> None:
    """At the declared bounds, at zero from the start, and at the smallest numbers there are.

    A plant may refuse what its solver cannot follow; it must not go on without finite numbers.
    """
    for what in ("minimum", "maximum", "zero", "subnormal", "any of these"):
        rng, inputs = np.random.default_rng(6), {}
        for s in block.inputs:
            values = {"minimum": s.minimum, "maximum": s.maximum, "zero": 0.0, "subnormal": 5e-324}
            choice = list(values.values()) if what == "any of these" else [values[what]]
            inputs[s.name] = np.clip(rng.choice(choice, (ROWS, s.size)), s.minimum, s.maximum)
        try:
            assert_finite(block, backend.run(block, inputs, {}, ROWS), what)
        except Refused as refusal:
            assert block in PLANTS and "max_step" in str(refusal), refusal


@over(block for block in BLOCKS.values() if isinstance(block, SampledBlock))
def test_outputs_are_finite_with_every_parameter_at_its_bounds(block: SampledBlock) -> None:
    inputs = ordinary_inputs(block)
    for variable in block.variables:
        if variable.group == "parameter":
            for value in (variable.signal.minimum, variable.signal.maximum):
                result = InProcess().run(block, inputs, {variable.name: value}, ROWS)
                assert_finite(block, result, f"{variable.name} = {value:g}")


# Repeatability


@OTHER_BACKEND
@EVERY
def test_every_backend_gives_the_numbers_of_the_run_in_process(block: Block, backend: Backend) -> None:
    """Bit for bit: all evaluate the same Functions. The noise of one seed is part of it."""
    inputs = ordinary_inputs(block)
    expected, actual = (b.run(block, inputs, {}, ROWS) for b in (InProcess(), backend))
    for signal in block.reported:
        assert np.array_equal(actual[signal.name], expected[signal.name]), signal.name


@BACKEND
@EVERY
def test_a_run_repeats_itself_bit_for_bit(block: Block, backend: Backend) -> None:
    first, second = (backend.run(block, ordinary_inputs(block), {}, ROWS) for _ in range(2))
    assert all(np.array_equal(first[s.name], second[s.name]) for s in block.reported)


@BACKEND
@SEEDED
def test_the_seed_decides_the_noise(block: Block, backend: Backend) -> None:
    """Every noise density at a nominal value, whatever the defaults are."""
    noise = {q.name: q.nominal for q in block.parameters if q.name.endswith("noise_density")}
    inputs = ordinary_inputs(block)
    one, same, other = (backend.run(block, inputs, noise | {"seed": seed}, ROWS) for seed in (1, 1, 2))
    assert all(np.array_equal(one[s.name], same[s.name]) for s in block.outputs)
    assert all(np.any(one[s.name] != other[s.name], axis=0).all() for s in block.outputs)


@BACKEND
@EVERY
def test_a_run_rolled_back_equals_an_uninterrupted_one_bit_for_bit(block: Block, backend: Backend) -> None:
    """In the same instance and in a fresh one, with jittering steps and missing inputs."""
    inputs, h = ordinary_inputs(block, rows=60), period_of(block)
    for values in inputs.values():
        values[::11] = math.nan
    ends = np.cumsum(np.random.default_rng(8).uniform(0.2, 3, 60)) * h
    times = np.concatenate([[0.0], ends])
    first, fresh = backend.open(block, {}), backend.open(block, {})
    saved, expected = b"", []
    for i in range(60):
        if i == 30:
            saved = first.save()
        expected.append(first.step(times[i], ends[i] - times[i], {name: u[i] for name, u in inputs.items()}))
    for session in (first, fresh):
        session.restore(saved)
        for i in range(30, 60):
            again = session.step(times[i], ends[i] - times[i], {name: u[i] for name, u in inputs.items()})
            assert all(np.array_equal(again[s.name], expected[i][s.name]) for s in block.reported)


# Estimators

ATTITUDES = Rotation.concatenate(
    [
        Rotation.identity(1),
        Rotation.from_euler("ZYX", [[0, 0, math.pi], [0.4, math.pi / 2, 0], [0, -math.pi / 2, 0], [2, 1.5, -3]]),
        Rotation.random(20, random_state=np.random.default_rng(11)),
    ]
)


@BACKEND
@over(OF_TILT)
def test_rest_gives_the_right_vertical_at_any_attitude(block: Block, backend: Backend) -> None:
    """Upside down and at pitch +-90 deg too; roll and pitch, and q_NS where there is one, are of that vertical."""
    for attitude in ATTITUDES:
        motion = motions.rest(attitude, 50, period_of(block))
        result = backend.run(block, fed_by(block, motion), {}, 50)
        assert angle(result["vertical"], motion.vertical).max() < 1e-9  # perfect readings: rounding only
        assert_attitude_agrees(result)


@BACKEND
@over(OF_TILT)
def test_the_vertical_has_unit_length_and_agrees_with_the_angles(block: Block, backend: Backend) -> None:
    result = backend.run(block, ordinary_inputs(block), {}, ROWS)
    assert np.allclose(np.linalg.norm(result["vertical"], axis=1), 1, rtol=0, atol=1e-12)
    assert_attitude_agrees(result)


def assert_attitude_agrees(result: Trajectory) -> None:
    roll, pitch = result["roll"], result["pitch"]
    vertical = np.column_stack([-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)])
    assert np.allclose(vertical, result["vertical"], rtol=0, atol=1e-12)
    if "q_NS" in result.values:
        assert np.allclose(np.linalg.norm(result["q_NS"], axis=1), 1, rtol=0, atol=1e-12)
        R_NS = Rotation.from_quat(np.roll(result["q_NS"], -1, axis=1))
        assert np.allclose(R_NS.inv().apply([0, 0, 1]), result["vertical"], rtol=0, atol=1e-12)


@BACKEND
@over(OF_TILT)
def test_a_steady_turn_is_followed_without_lag(block: Block, backend: Backend) -> None:
    """Perfect readings at 1 rad/s for 3 s: never more than one and a half sample periods of turn behind.

    One sample is the lag of a filter that integrates the sample before; the wrong sign of the gyroscope lags more.
    """
    dt = period_of(block)
    for axis in Rotation.random(5, random_state=np.random.default_rng(12)).apply([1.0, 0.0, 0.0]):
        motion = motions.turn(Rotation.identity(), axis, ROWS, dt)
        result = backend.run(block, fed_by(block, motion), {}, ROWS)
        assert angle(result["vertical"], motion.vertical).max() < 1.5 * dt


@BACKEND
@over(OF_TILT)
def test_a_turned_sensor_sees_the_same_vertical(block: Block, backend: Backend) -> None:
    """Axes are names: readings turned by a constant rotation give the vertical turned by it."""
    turned_by, inputs = Rotation.from_euler("ZYX", [0.5, -0.4, 2.0]), ordinary_inputs(block)
    turned = {name: turned_by.apply(values) if name in OF_A_MOTION else values for name, values in inputs.items()}
    expected = turned_by.apply(backend.run(block, inputs, {}, ROWS)["vertical"])
    # Rounding, and its growth in a filter that weighs by its own estimate.
    assert np.allclose(backend.run(block, turned, {}, ROWS)["vertical"], expected, rtol=0, atol=1e-9)


@BACKEND
@over(OF_HEADING)
def test_the_heading_of_the_world_does_not_matter_for_the_vertical(block: Block, backend: Backend) -> None:
    """The same motion in a world turned about the vertical: only the magnetometer notices."""
    motion = motions.motion(np.random.default_rng(13), ROWS, dt=period_of(block))
    inputs = fed_by(block, motion)
    turned_field = Rotation.from_euler("Z", 1.3).apply(motions.FIELD_N)
    turned = inputs | {"mag": motion.R_NS.inv().apply(turned_field)}
    one, other = (backend.run(block, given, {}, ROWS)["vertical"] for given in (inputs, turned))
    assert np.allclose(one, other, rtol=0, atol=1e-9)  # rounding, as above


@BACKEND
@over(b for b in ESTIMATORS if "status" in names(b.outputs))
def test_status_names_exactly_the_missing_samples(block: Block, backend: Backend) -> None:
    inputs = ordinary_inputs(block)
    expected = {name: np.zeros(ROWS, bool) for name in inputs if name in MISSING}
    for i, (name, rows) in enumerate(expected.items()):
        rows[[20 + i, 21 + i, 60, ROWS - 1]] = True
        inputs[name][rows, i % 3] = math.nan
    status = backend.run(block, inputs, {}, ROWS)["status"].astype(int)
    for name, rows in expected.items():
        assert np.array_equal((status & MISSING[name]) > 0, rows), name
    assert not (status & Status.NOT_INITIALISED).any()


@BACKEND
@over(OF_TILT)
def test_status_is_clear_at_rest(block: Block, backend: Backend) -> None:
    motion = motions.rest(Rotation.from_euler("ZYX", [0.3, 0.2, 0.1]), 50, period_of(block))
    status = backend.run(block, fed_by(block, motion), {}, 50)["status"]
    assert np.array_equal(status, np.zeros(50))


# Plants


@BACKEND
@over(PLANTS)
def test_the_truth_of_a_plant_belongs_to_one_motion(block: Block, backend: Backend) -> None:
    """Attitude in every form, gravity, field, and the ideal IMU integrated once and twice agree for 3 s."""
    result = backend.run(block, {}, {}, ROWS)
    start = {q.name: q.start_values() for q in block.parameters}
    # A quintic spline through rows 10 ms apart follows the defaults' motion to 1e-6.
    assert_truth_consistent(result, start["g"][0], np.array(start["earth_field"]), tolerance=1e-6)


@BACKEND
@over(PLANTS)
def test_the_truth_of_a_plant_does_not_depend_on_later_inputs(block: Block, backend: Backend) -> None:
    inputs = ordinary_inputs(block)
    late = {name: np.where(np.arange(ROWS)[:, None] < 200, values, -values) for name, values in inputs.items()}
    one, other = (backend.run(block, given, {}, ROWS) for given in (inputs, late))
    assert all(np.array_equal(one[name][:200], other[name][:200]) for name in names(v.TRUTH))


@over(PLANTS)
def test_any_communication_step_gives_the_same_truth(block: ContinuousBlock) -> None:
    """Inputs held away from their start; communication steps of 0.1 ms to 0.1 s; truth at 0.1 s and at 0.2 s."""
    held = {}
    for s in block.inputs:
        away = np.array(s.start_values()).reshape(s.shape) + 0.3 * s.nominal
        held[s.name] = np.clip(away, s.minimum, s.maximum)
    at_both: dict[str, list[np.ndarray]] = {s.name: [] for s in (*v.TRUTH, *v.IDEAL_IMU)}
    for step in (1e-4, 1e-3, 0.01, 0.1):
        run = simulate(block, 0.2, step, held)
        for name, values in at_both.items():
            values.append(run[name][[round(0.1 / step), round(0.2 / step)]])
    for name, values in at_both.items():
        # RK4 takes steps of 0.1 ms in the first run, of max_step (1 to 2 ms) in the last: an error of order
        # (rate * step)^4 in 0.2 s, for rates of tens per second.
        assert np.ptp(values, axis=0).max() <= 1e-8 * max(1.0, np.abs(values).max()), name


@over(PLANTS)
def test_a_magnetic_disturbance_is_added_in_its_intervals(block: ContinuousBlock) -> None:
    field = np.array([5.0, -3.0, 2.0])
    times = {"disturbance_start": (0.5, 2.0, 0.0), "disturbance_stop": (1.5, 3.0, 9.0)}
    disturbed = {"disturbances": 2, "disturbance_field": field, "disturbance_ramp": 0.25} | times
    clean, run = simulate(block, 4.0, 0.01), simulate(block, 4.0, 0.01, parameters=disturbed)
    R_NS = Rotation.from_quat(np.roll(run["q_NS"], -1, axis=1))
    added = R_NS.apply(run["magnetic_field"] - clean["magnetic_field"])
    flat = ((run.time > 0.76) & (run.time < 1.24)) | ((run.time > 2.26) & (run.time < 2.74))
    off = (run.time <= 0.5) | ((run.time >= 1.5) & (run.time <= 2.0)) | (run.time >= 3.0)
    assert added[flat] == pytest.approx(np.tile(field, (flat.sum(), 1)), abs=1e-13)  # rounding of 50 uT
    assert not added[off].any()
    assert np.array_equal(run["specific_force"], clean["specific_force"])
    undisturbed = Trajectory(run.time[off], {name: values[off] for name, values in run.values.items()})
    assert_signals_agree(undisturbed, v.GRAVITY, np.array(MID_EUROPE))


def test_vocabulary_names_are_used_with_their_own_declaration() -> None:
    """A block that calls a signal by a common name means the common signal: same unit, same shape."""
    common = {s.name: s for s in (*v.TRUTH, *v.IDEAL_IMU, v.GYRO, v.ACCEL, v.MAG, v.TILT_STD, v.STATUS)}
    for block in BLOCKS.values():
        for s in (*block.inputs, *block.outputs):
            if s.name in common:
                assert (s.unit, s.shape) == (common[s.name].unit, common[s.name].shape), f"{block.name}.{s.name}"
