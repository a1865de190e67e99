"""The IMU: every error is the stated one, and every device file fits the block."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssv
from lxml import etree
from scipy.stats import chi2, norm

from imufmu.blocks.instance import SampledInstance
from imufmu.blocks.running import Stream
from imufmu.blocks.signals import UNITS
from imufmu.compiled.running import run
from imufmu.sensors.imu import BLOCK
from support.places import ROOT

DEVICES = sorted((ROOT / "models" / "imus").glob("*.ssv"))
READINGS = {"gyro": "angular_velocity", "accel": "specific_force", "mag": "magnetic_field"}
CONFIDENCE = 1 - 1e-6  # of every statistical bound here: a correct block fails for one seed in a million
EVERY_ERROR = {
    f"{sensor}_{name}": value
    for sensor in READINGS
    for name, value in {
        "misalignment": (0.01, -0.02, 0.03, 0.01, -0.01, 0.02),
        "scale_error": (0.02, -0.01, 0.03),
        "bias": (0.1, -0.2, 0.3),
        "bias_instability": 0.05,
        "bias_time": 3.0,
        "noise_density": 0.02,
        "range": 2.0,
        "resolution": 0.01,
    }.items()
}


def motion(n: int) -> dict[str, np.ndarray]:
    """Ideal signals (n, 3) of any size."""
    rng = np.random.default_rng(1)
    return {name: rng.normal(size=(n, 3)) for name in READINGS.values()}


def still(n: int, **parameters: object) -> np.ndarray:
    """Readings (n, 9) of zero input: the additive errors alone."""
    result = run(BLOCK, {name: np.zeros((n, 3)) for name in READINGS.values()}, parameters)
    return np.hstack([result[name] for name in READINGS])


def of_every_sensor(**errors: float) -> dict[str, float]:
    return {f"{sensor}_{name}": value for sensor in READINGS for name, value in errors.items()}


def test_without_errors_the_reading_is_the_ideal_signal():
    ideal = motion(3000)
    result = run(BLOCK, ideal)
    for reading, signal in READINGS.items():
        assert np.array_equal(result[reading], ideal[signal])


@pytest.mark.parametrize("sample_rate", [50.0, 1000.0])
def test_white_noise_has_the_printed_density(sample_rate):
    density, n = {"gyro": 0.002, "accel": 0.03, "mag": 0.4}, 20000
    y = still(n, sample_period=1 / sample_rate, **{f"{name}_noise_density": d for name, d in density.items()})
    expected = np.repeat([d * np.sqrt(sample_rate / 2) for d in density.values()], 3)
    statistic = np.sum((y / expected) ** 2, axis=0)  # chi-square with n degrees of freedom, each axis
    assert np.all(statistic > chi2.ppf((1 - CONFIDENCE) / 2, n))
    assert np.all(statistic < chi2.ppf((1 + CONFIDENCE) / 2, n))


def test_the_eighteen_draws_of_a_sample_are_independent_of_each_other_and_of_the_next():
    n = 20000
    noise = still(n, **of_every_sensor(noise_density=np.sqrt(0.02)))
    # Correlation time far below the period: the drift is white, so that its draws can be seen.
    drift = still(n, **of_every_sensor(bias_instability=1.0, bias_time=1e-5))
    draws = np.hstack([noise, drift])
    now_and_next = np.hstack([draws[:-1], draws[1:]])
    correlation = np.corrcoef(now_and_next.T)[np.triu_indices(36, 1)]
    # Sample correlations of independent draws are normal with standard deviation 1/sqrt(n).
    assert np.max(np.abs(correlation)) < norm.ppf((1 + CONFIDENCE) / 2) / np.sqrt(n - 1)


@pytest.fixture(scope="module")
def drift() -> np.ndarray:
    """Nine drifting biases of standard deviation 0.3 over 6000 correlation times of 10 samples each."""
    return still(60000, sample_period=0.1, **of_every_sensor(bias_instability=0.3, bias_time=1.0))


def test_drifting_bias_has_its_standard_deviation_and_loses_correlation_in_its_time(drift):
    # Standard error of both estimates is at most sqrt(2 / (correlation times in all)) = 0.6 %; five of them.
    tolerance = 5 * np.sqrt(2 / (9 * 6000))
    variance = np.mean(drift**2)
    assert variance == pytest.approx(0.3**2, rel=tolerance)
    assert np.mean(drift[10:] * drift[:-10]) / variance == pytest.approx(np.exp(-1), abs=tolerance)


def test_allan_deviation_of_the_drifting_bias_peaks_at_0_617_of_its_standard_deviation(drift):
    def allan(samples: int) -> float:
        means = drift[: len(drift) // samples * samples].reshape(-1, samples, 9).mean(axis=1)
        return np.sqrt(np.mean(np.diff(means, axis=0) ** 2) / 2)

    # 28000 differences of means: standard error below 1 %, four of them.
    assert allan(19) == pytest.approx(0.617 * 0.3, rel=0.03)
    assert allan(19) > allan(3)
    assert allan(19) > allan(120)


def test_drifting_bias_is_stationary_from_the_first_sample():
    first = np.array([still(1, seed=seed, **of_every_sensor(bias_instability=2.0))[0] for seed in range(200)])
    statistic = np.sum((first / 2.0) ** 2)  # chi-square with 1800 degrees of freedom
    assert chi2.ppf((1 - CONFIDENCE) / 2, first.size) < statistic < chi2.ppf((1 + CONFIDENCE) / 2, first.size)


def test_different_seeds_are_independent_and_the_same_seed_repeats():
    n, errors = 20000, of_every_sensor(noise_density=1.0)
    first, second = still(n, seed=1, **errors), still(n, seed=2, **errors)
    assert np.array_equal(first, still(n, seed=1, **errors))
    correlation = np.corrcoef(np.hstack([first, second]).T)[:9, 9:]
    assert np.max(np.abs(correlation)) < norm.ppf((1 + CONFIDENCE) / 2) / np.sqrt(n)


def test_run_and_stream_agree_bit_for_bit_with_every_error_on():
    ideal = motion(300)
    ideal["specific_force"][40] = np.nan  # held by both
    whole = run(BLOCK, ideal, EVERY_ERROR)
    stream = Stream(BLOCK, EVERY_ERROR)
    samples = [stream.update(**{name: rows[k] for name, rows in ideal.items()}) for k in range(300)]
    for name in READINGS:
        assert np.array_equal(whole[name], [sample[name] for sample in samples])
        assert np.all(np.isfinite(whole[name]))


@pytest.mark.parametrize("name", [name for name in EVERY_ERROR if name.startswith("gyro")])
def test_an_error_of_one_sensor_leaves_the_others_alone(name):
    others = {key: value for key, value in EVERY_ERROR.items() if not key.startswith("gyro")}
    ideal = motion(100)
    without, with_it = run(BLOCK, ideal, others), run(BLOCK, ideal, others | {name: EVERY_ERROR[name]})
    assert np.array_equal(without["accel"], with_it["accel"])
    assert np.array_equal(without["mag"], with_it["mag"])


def test_bias_drift_and_noise_add_without_changing_each_others_draws():
    bias = {f"{sensor}_bias": 0.5 for sensor in READINGS}
    drift = of_every_sensor(bias_instability=0.3, bias_time=0.1)
    noise = of_every_sensor(noise_density=0.2)
    together = still(500, **bias, **drift, **noise)
    # Three numbers of size 10 at most, added in another order: a few roundings.
    assert still(500, **bias) + still(500, **drift) + still(500, **noise) == pytest.approx(together, abs=1e-14)


@pytest.mark.parametrize(("reading", "signal"), READINGS.items())
def test_misalignment_and_scale_error_act_as_the_matrix(reading, signal):
    ideal = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    errors = {
        f"{reading}_misalignment": (0.01, 0.02, 0.03, 0.04, 0.05, 0.06),
        f"{reading}_scale_error": (0.1, 0.2, -0.5),
    }
    # Column j: what the three axes read for a unit along axis j; rows (I + diag(scale_error)) M by hand.
    matrix = np.array([[1.1, 0.011, 0.022], [0.036, 1.2, 0.048], [0.025, 0.03, 0.5]])
    response = run(BLOCK, {signal: ideal}, errors)[reading].T
    assert response == pytest.approx(matrix, abs=4e-16)  # two roundings of numbers near 1


def test_a_sensor_turned_as_a_whole_reads_the_turned_vector():
    r = np.array([1e-4, -2e-4, 3e-4])
    turned = {"accel_misalignment": (r[2], -r[1], -r[2], r[0], r[1], -r[0])}
    ideal = np.array([1.0, 2.0, 9.0])
    y = run(BLOCK, {"specific_force": ideal[None]}, turned)["accel"][0]
    assert y == pytest.approx(ideal - np.cross(r, ideal), abs=4e-15)  # three roundings of numbers below 16


def test_reading_saturates_at_the_range_on_both_sides():
    ideal = np.array([[3.0, -3.0, 1.5], [2.0, -2.0, 1e9]])
    y = run(BLOCK, {"angular_velocity": ideal}, {"gyro_range": 2.0})["gyro"]
    assert np.array_equal(y, [[2.0, -2.0, 1.5], [2.0, -2.0, 2.0]])


def test_noise_and_bias_do_not_pass_the_range():
    y = run(BLOCK, {"specific_force": np.full((500, 3), 9.9)}, {"accel_range": 10.0, "accel_noise_density": 1.0})
    assert np.max(y["accel"]) == 10.0


def test_resolution_rounds_to_the_nearest_multiple():
    ideal, step = motion(2000)["magnetic_field"], 0.3
    y = run(BLOCK, {"magnetic_field": ideal}, {"mag_resolution": step})["mag"]
    # One rounding in the division and one in the product, of numbers below 16 steps.
    assert np.array_equal(y, step * np.round(y / step))
    assert np.max(np.abs(y - ideal)) <= step / 2 + 1e-15
    assert len(np.unique(y)) > 10


def test_errors_act_in_the_stated_order():
    ideal = {"specific_force": np.array([[2.0, 4.0, 8.0]])}
    errors = {"accel_scale_error": -0.5, "accel_bias": 1.0, "accel_range": 4.24, "accel_resolution": 0.25}
    # Scaled to 1, 2, 4; biased to 2, 3, 5; clipped to 4.24; rounded to 4.25, past the range that is no multiple.
    assert run(BLOCK, ideal, errors)["accel"].tolist() == [[2.0, 3.0, 4.25]]


def test_an_error_may_change_during_a_run():
    imu = SampledInstance(BLOCK)
    imu.initialise(0.0)
    imu.sample()
    imu.p[[v.name for v in BLOCK.variables if v.group == "parameter"].index("gyro_bias[2]")] = 0.25
    imu.sample()
    assert imu.y[:3].tolist() == [0.0, 0.25, 0.0]


def units_of(file: Path) -> dict[str, dict[str, float]]:
    """Base units that a parameter set defines, by unit name."""
    units = etree.parse(file).iterfind(".//{*}Unit")
    return {unit.get("name"): {k: float(v) for k, v in unit[0].attrib.items()} for unit in units}


@pytest.mark.parametrize("file", DEVICES, ids=lambda file: file.stem)
class TestDevice:
    def test_is_valid_and_within_bounds(self, file):
        values = {p.name: float(p.value) for p in read_ssv(str(file)).parameters}  # validates with the schema
        assert len(values) == len(read_ssv(str(file)).parameters), "a parameter is set twice"
        BLOCK.parameter_vector(values)  # raises for unknown names and values out of bounds

    def test_has_the_units_of_the_block_and_defines_them(self, file):
        declared = {v.name: v.signal.unit for v in BLOCK.variables if v.group == "parameter"}
        parameters = read_ssv(str(file)).parameters
        assert {p.name: p.unit for p in parameters} == {p.name: declared[p.name] for p in parameters}
        assert set(units_of(file)) == {p.unit for p in parameters}
        for name, base in units_of(file).items():
            exponents = dict(UNITS[name].base or {}) | ({"factor": 1e-6} if name == "uT" else {})
            assert base == exponents

    def test_names_a_source_for_every_figure(self, file):
        assert all(p.get("description") for p in etree.parse(file).iterfind(".//{*}Parameter"))

    def test_range_is_a_reading_of_its_resolution(self, file):
        values = {p.name: float(p.value) for p in read_ssv(str(file)).parameters}
        for sensor in READINGS:
            if resolution := values.get(f"{sensor}_resolution"):
                steps = values[f"{sensor}_range"] / resolution
                # Seven digits are written: the quotient of 30000 steps is good to a hundredth.
                assert steps == pytest.approx(round(steps), abs=0.02)


def test_there_are_device_files():
    assert {file.stem for file in DEVICES} >= {"mtx", "mtw", "mti_g_700", "mpu9150"}


@pytest.mark.parametrize("resolution", [5e-324, 1e-310, 1e-30])
def test_a_resolution_finer_than_numbers_are_changes_nothing(resolution: float):
    """1 / 5e-324 is infinite. 1e-30: every number is a whole multiple of it as far as a double can tell."""
    ideal = np.array([[1.0, -0.3, 0.0], [1e3, -1e-5, 0.1]])
    y = run(BLOCK, {"angular_velocity": ideal}, {"gyro_resolution": resolution})["gyro"]
    assert np.array_equal(y, ideal)


def test_a_reading_stays_within_the_bounds_that_estimators_take_it_in():
    """Whatever the ideal signal, bias, range and resolution: beyond them it would count as missing."""
    high = np.full((2, 3), 1e9)
    for name, ideal in (("gyro", "angular_velocity"), ("accel", "specific_force"), ("mag", "magnetic_field")):
        limit = next(s.maximum for s in BLOCK.outputs if s.name == name)
        coarse = 0.6 * limit  # the limit is nearer to two steps of it than to one
        for parameters in (
            {},
            {f"{name}_bias": limit},
            {f"{name}_resolution": coarse},
            {f"{name}_noise_density": limit},
        ):
            for sign in (1, -1):
                y = run(BLOCK, {ideal: sign * high}, parameters)[name]
                assert np.array_equal(np.abs(y), np.full((2, 3), limit)), parameters
