"""Claims about the rigid body in a random hand, and about its parameter sets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssv
from lxml import etree
from scipy.spatial.transform import Rotation
from scipy.stats import chi, kstest, norm

from imufmu import System, locate
from imufmu import simulate as cosimulate
from imufmu.blocks.noise import uniforms
from imufmu.blocks.signals import UNITS
from imufmu.blocks.vocabulary import GRAVITY, MID_EUROPE
from imufmu.compiled.running import simulate
from imufmu.papers.motions import parameter_set
from imufmu.plants.handheld import BLOCK
from imufmu.plants.random_vectors import DRAWS, LINES, evenly, lines
from imufmu.plants.time_functions import windows
from imufmu.registry import BLOCKS
from support.places import ROOT
from support.truth_consistency import assert_truth_consistent

SETS = sorted((ROOT / "models" / "handheld").glob("*.ssv"))
TWO_BURSTS = {"bursts": 2, "burst_start": (0.5, 2.0, 9, 9), "burst_stop": (1.5, 2.8, 9, 9), "burst_ramp": 0.2}
LEVER = {"imu_position": (0.1, -0.2, 0.05), "random_attitude": 1}
WHITE = {"motion": 1}

# Of a record: what is stated, its mean and maximum, duration (s), as the papers print them.
STATED = {
    "lee2012_test_a": ("external_acceleration", 0.40, 1.83, 60.0),
    "lee2012_test_b": ("external_acceleration", 3.06, 16.71, 10.0),
    "lee2012_test_c": ("external_acceleration", 6.29, 37.22, 27.0),
    "leechoi2018_test_a": ("angular_velocity", 1.47, 6.08, 30.0),
    "leechoi2018_test_b": ("angular_velocity", 3.90, 13.70, 30.0),
    "leechoi2018_test_c": ("angular_velocity", 6.18, 17.16, 30.0),
}


def length(v: np.ndarray) -> np.ndarray:
    return np.linalg.norm(v, axis=-1)


def start(seed: int = 1, **parameters: Any) -> dict[str, np.ndarray]:
    """Initial state by name; (3, LINES) for the lines."""
    p = BLOCK.parameter_vector(parameters | {"seed": seed})
    x = np.array(BLOCK.initial_function(p, uniforms(seed, 0, 1, BLOCK.normals)[0])).ravel()
    found, first = {}, 0
    for state in BLOCK.state:
        found[state.name] = x[first : first + state.size].reshape(state.shape)
        first += state.size
    return found


def test_it_is_registered() -> None:
    assert BLOCKS["handheld"] is BLOCK


# Random vectors


def test_draws_become_even() -> None:
    draws = np.random.default_rng(1).normal(size=5000)
    values = np.array(ca.DM(evenly(ca.DM(draws)))).ravel()
    assert values == pytest.approx(norm.cdf(draws), abs=1e-15)


def test_every_part_of_the_band_has_its_line_and_phases_are_even() -> None:
    x = [start(seed, rate_low_frequency=0.5, rate_high_frequency=2.0) for seed in range(50)]
    edges = np.linspace(0.5, 2.0, LINES + 1)
    frequencies = np.array([s["rate_frequency"] for s in x])
    assert np.all((frequencies > edges[:-1]) & (frequencies < edges[1:]))
    places = (frequencies - edges[:-1]) / np.diff(edges)
    phases = np.array([s["rate_phase"] for s in x]) / (2 * np.pi)
    for sample in (places, phases):  # 1800 values each; a correct block fails for one seed in a million
        assert kstest(sample.ravel(), "uniform").pvalue > 1e-6


def test_lines_use_every_draw_once() -> None:
    draws = ca.SX.sym("draws", DRAWS)
    place, phase = lines(draws)
    used = ca.jacobian(ca.vertcat(ca.vec(place), ca.vec(phase)), draws).sparsity()
    assert used.nnz() == DRAWS
    assert sorted(set(used.get_col())) == list(range(DRAWS))


def expected_vector(t: np.ndarray, frequency: np.ndarray, phase: np.ndarray, mean: float, peak: float) -> np.ndarray:
    """The random vector (n, 3), with the distribution of the length from scipy."""
    s = np.sqrt(2 / LINES) * np.sin(2 * np.pi * frequency * t[:, None, None] + phase).sum(axis=2)
    return mean * peak * (chi(3).cdf(length(s)) ** (peak - 1) / length(s))[:, None] * s


@pytest.mark.parametrize("low", [0.0, 0.4], ids=["without pull", "with pull"])
def test_rate_and_acceleration_are_the_stated_functions(low: float) -> None:
    values = {"acceleration_low_frequency": low, "acceleration_mean": 3.0, "rate_peak_to_mean": 1.8, "rate_mean": 2.5}
    run, x = simulate(BLOCK, 5.0, 0.05, parameters=values), start(**values)
    rate = expected_vector(run.time, x["rate_frequency"], x["rate_phase"], 2.5, 1.8)
    acceleration = expected_vector(run.time, x["frequency"], x["phase"], 3.0, 3.0)
    omega_0 = np.pi * low
    acceleration -= 2 * omega_0 * run["velocity"] + omega_0**2 * run["position"]
    rounding = 1e-11  # F of a short vector is a difference of nearly equal numbers
    assert run["angular_velocity"] == pytest.approx(rate, abs=rounding)
    R_NS = Rotation.from_quat(np.roll(run["q_NS"], -1, axis=1))
    assert R_NS.apply(run["external_acceleration"]) == pytest.approx(acceleration, abs=rounding)


@pytest.mark.parametrize("peak", [1.5, 3.0, 8.0])
def test_mean_and_largest_rate_are_as_stated(peak: float) -> None:
    values = {"rate_mean": 2.0, "rate_peak_to_mean": peak, "max_step": 0.1, "rate_high_frequency": 2.0}
    rates = np.array(
        [length(simulate(BLOCK, 60.0, 0.1, None, values | {"seed": s})["angular_velocity"]) for s in range(8)]
    )
    assert rates.max() <= 2.0 * peak
    # 8 records of some 200 independent values whose standard deviation is at most 2.1 means (peak 8).
    assert rates.mean() == pytest.approx(2.0, rel=0.1)
    assert rates.max(axis=1).mean() == pytest.approx(2.0 * peak, rel=0.1)


def test_nothing_moves_with_means_of_zero() -> None:
    run = simulate(BLOCK, 1.0, 0.1, parameters={"rate_mean": 0.0, "acceleration_mean": 0.0})
    assert np.array_equal(run["specific_force"], np.tile([0.0, 0.0, GRAVITY], (11, 1)))
    assert not run["angular_velocity"].any() and not run["velocity"].any() and not run["position"].any()


# Truth


@pytest.mark.parametrize("motion", [{}, TWO_BURSTS, WHITE], ids=["hand", "bursts", "white velocity"])
def test_truth_is_one_motion_with_the_sensor_off_the_centre(motion: dict[str, Any]) -> None:
    # The white velocity is slowed down: its lines reach ten times the cut-off.
    slow = {"max_step": 1e-3, "velocity_cutoff": 2.0, "velocity_noise_density": 0.3}
    run = simulate(BLOCK, 3.0, 0.002, parameters=motion | LEVER | slow)
    assert length(run["velocity"]).max() > 0.1
    # Solver and spline, in 3 s; at the ends of a ramp the spline meets a jump in the fourth derivative.
    assert_truth_consistent(run, GRAVITY, np.array(MID_EUROPE), tolerance=1e-6)


def test_gravity_and_field_are_parameters() -> None:
    run = simulate(BLOCK, 1.0, 0.002, parameters={"g": 1.62, "earth_field": (-5.0, 7.0, 11.0)})
    assert_truth_consistent(run, 1.62, np.array([-5.0, 7.0, 11.0]), tolerance=1e-7)


def test_the_lever_arm_adds_the_acceleration_of_the_turn() -> None:
    """Against the same motion at the centre, with the angular acceleration from differences."""
    arm = np.array([0.3, -0.1, 0.2])
    h = 1e-3
    centre, off = (simulate(BLOCK, 2.0, h, parameters={"imu_position": at}) for at in (np.zeros(3), arm))
    w = centre["angular_velocity"]
    w_rate = (w[2:] - w[:-2]) / (2 * h)
    expected = np.cross(w_rate, arm) + np.cross(w[1:-1], np.cross(w[1:-1], arm))
    found = (off["external_acceleration"] - centre["external_acceleration"])[1:-1]
    assert length(expected).max() > 0.3
    assert found == pytest.approx(expected, abs=1e-4)  # h^2 / 6 of the third derivative of w, below 500 rad/s4


@pytest.mark.parametrize("motion", [{}, WHITE], ids=["hand", "white velocity"])
def test_any_communication_step_gives_the_same_truth(motion: dict[str, Any]) -> None:
    runs = [simulate(BLOCK, 0.6, step, parameters=motion) for step in (1e-3, 0.0075, 0.01, 0.1)]
    for name in ("q_NS", "position", "velocity", "angular_velocity", "specific_force"):
        ends = np.array([run[name][-1] for run in runs])
        # Solver steps of 1 to 2 ms: 300 steps, each wrong by (w h)^5 / 5! of some 10 m/s2; w up to 100 rad/s.
        assert np.ptp(ends, axis=0).max() < (1e-5 if motion else 1e-8), name


def test_solver_is_of_order_four() -> None:
    ends = [
        simulate(BLOCK, 2.0, 2.0, parameters={"max_step": h, "rate_mean": 4.0})["q_NS"][-1] for h in (0.04, 0.02, 0.001)
    ]
    errors = [np.abs(end - ends[2]).max() for end in ends[:2]]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.5)  # the next order of the error


def test_attitude_starts_as_given_or_anywhere() -> None:
    given = simulate(BLOCK, 0.01, 0.01, parameters={"initial_attitude": (0.1, -0.2, 0.3)})
    assert [given[name][0] for name in ("roll", "pitch", "yaw")] == pytest.approx([0.1, -0.2, 0.3], abs=1e-15)
    q = np.array([start(seed, random_attitude=1)["attitude"] for seed in range(400)])
    directions = Rotation.from_quat(np.roll(q, -1, axis=1)).as_matrix().reshape(-1, 9)
    # Components of evenly distributed directions are even over (-1, 1); one seed in a million fails.
    assert all(kstest(column, "uniform", (-1, 2)).pvalue > 1e-6 for column in directions.T)


def test_the_hand_does_not_run_away() -> None:
    run = simulate(BLOCK, 300.0, 0.1, parameters={"max_step": 0.02})
    assert length(run["position"]).max() < 2.0  # m; without the pull it would be hundreds


# Bursts and disturbances


def test_windows_are_flat_inside_and_zero_outside() -> None:
    t = ca.SX.sym("t")
    value = ca.Function("w", [t], [windows(t, 2, ca.DM([1, 4, 6]), ca.DM([3, 5, 7]), 0.4)])
    times = [0.0, 1.0, 1.2, 1.4, 2.0, 2.6, 3.0, 3.5, 4.4, 4.6, 5.0, 6.5]
    expected = [0, 0, 0.5, 1, 1, 1, 0, 0, 1, 1, 0, 0]  # the third interval does not count
    assert [float(value(s)) for s in times] == pytest.approx(expected, abs=1e-15)


def test_bursts_move_and_rests_rest() -> None:
    run = simulate(BLOCK, 4.0, 0.01, parameters=TWO_BURSTS)
    inside = ((run.time > 0.55) & (run.time < 1.45)) | ((run.time > 2.05) & (run.time < 2.75))
    outside = (run.time <= 0.5) | ((run.time >= 1.5) & (run.time <= 2.0)) | (run.time >= 2.8)
    for name in ("angular_velocity", "external_acceleration"):
        assert length(run[name][inside]).min() > 0
        assert not run[name][outside].any()
    assert np.array_equal(run["activity"][outside], np.zeros(outside.sum()))


def test_the_body_turns_at_rest_if_asked() -> None:
    in_bursts = simulate(BLOCK, 4.0, 0.01, parameters=TWO_BURSTS | {"turns_at_rest": 1})
    always = simulate(BLOCK, 4.0, 0.01)
    assert np.array_equal(in_bursts["angular_velocity"], always["angular_velocity"])
    assert not in_bursts["external_acceleration"][in_bursts.time >= 2.8].any()


# White velocity


def test_white_velocity_has_the_printed_density_in_every_part_of_its_spectrum() -> None:
    delta_v, omega_c = 0.5, 4.0
    given = {"motion": 1, "velocity_noise_density": delta_v, "velocity_cutoff": omega_c}
    states = [start(seed, **given) for seed in range(200)]
    f = np.array([s["frequency"] for s in states])
    omega = 2 * np.pi * f
    edges = omega_c * np.geomspace(1e-3, 10, LINES + 1)
    assert np.all((omega > edges[:-1]) & (omega < edges[1:]))
    velocity = np.array([s["velocity"] for s in states])
    # (14) times two, integrated over positive frequencies (Hz) from omega_c / 1000 to 10 omega_c.
    variance = delta_v**2 * omega_c / (2 * np.pi) * (np.arctan(10) - np.arctan(1e-3))
    # 600 values of three quarters of a degree of freedom or more each: standard error below 7 %; four of them.
    assert np.mean(velocity**2) == pytest.approx(variance, rel=0.28)


def test_white_velocity_keeps_its_mean_square_in_time() -> None:
    delta_v, omega_c = 1.0, 10.0
    values = {"motion": 1, "velocity_noise_density": delta_v, "velocity_cutoff": omega_c, "rate_mean": 0.0}
    runs = [simulate(BLOCK, 50.0, 0.05, None, values | {"max_step": 0.01, "seed": s}) for s in range(6)]
    variance = delta_v**2 * omega_c / (2 * np.pi) * (np.arctan(10) - np.arctan(1e-3))
    # Lines a factor of two apart, one at a random place of each part of the spectrum: 4 % between records.
    assert np.mean([run["velocity"] ** 2 for run in runs]) == pytest.approx(variance, rel=0.05)
    # The acceleration is its derivative: density times omega^2 below the cut-off, flat above.
    flat = delta_v**2 * omega_c**2 / (2 * np.pi)
    a_variance = flat * omega_c * (10 - np.arctan(10))
    assert np.mean([run["external_acceleration"] ** 2 for run in runs]) == pytest.approx(a_variance, rel=0.1)


# Parameter sets and system


@pytest.mark.parametrize("file", SETS, ids=lambda file: file.stem)
class TestParameterSet:
    def test_is_valid_and_within_bounds(self, file: Path) -> None:
        parameters = read_ssv(str(file)).parameters  # validates with the schema
        assert len({p.name for p in parameters}) == len(parameters), "a parameter is set twice"
        BLOCK.parameter_vector(
            parameter_set(f"handheld/{file.stem}")
        )  # raises for unknown names and values out of bounds

    def test_has_the_types_and_units_of_the_block_and_defines_them(self, file: Path) -> None:
        declared = {v.name: v.signal for v in BLOCK.variables if v.group == "parameter"}
        parameters = read_ssv(str(file)).parameters
        for p in parameters:
            signal = declared[p.name]
            assert p.type.lower() == signal.kind
            assert p.unit == (signal.unit if signal.kind == "real" else None)
        units = {
            u.get("name"): {k: float(e) for k, e in u[0].attrib.items()}
            for u in etree.parse(file).iterfind(".//{*}Unit")
        }
        assert units == {p.unit: dict(UNITS[p.unit].base or {}) for p in parameters if p.unit}

    def test_names_a_source_for_every_figure(self, file: Path) -> None:
        assert all(p.get("description") for p in etree.parse(file).iterfind(".//{*}Parameter"))


@pytest.mark.parametrize("name", STATED)
def test_records_have_the_mean_and_maximum_of_the_paper(name: str) -> None:
    stated, mean, maximum, duration = STATED[name]
    values = parameter_set(f"handheld/{name}") | {"max_step": 0.04}  # statistics need no exact solver
    lengths = np.array(
        [length(simulate(BLOCK, duration, 0.04, None, values | {"seed": seed})[stated]) for seed in range(16)]
    )
    # The mean of a record scatters by 3 to 12 %, the maximum by up to 8 %: a quarter of that over 16 seeds.
    assert lengths.mean() == pytest.approx(mean, rel=0.1)
    assert lengths.max(axis=1).mean() == pytest.approx(maximum, rel=0.07)


def test_there_are_the_parameter_sets_of_three_papers() -> None:
    assert {file.stem for file in SETS} == {*STATED, "rizun2008"}


def test_the_system_follows_the_truth_where_the_accelerometer_does_not() -> None:
    system = System.read(locate("handheld_lee2012"))
    assert system.description.name == "handheld_lee2012"
    result = cosimulate(system)
    vertical, truth, reading = (result[v][:-1] for v in ("lee2012.vertical", "plant.vertical", "imu.accel"))

    def tilt_rms(a: np.ndarray) -> float:
        return float(
            np.degrees(np.sqrt(np.mean(np.arctan2(length(np.cross(a, truth)), np.sum(a * truth, axis=1)) ** 2)))
        )

    assert tilt_rms(vertical) < 4.0  # deg; 2.7 with this seed
    assert tilt_rms(reading) > 20.0
