"""Claims about the sensor on a moving person: one motion, rigid bones, soft tissue, parameters."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from imufmu.blocks.block import ParameterError
from imufmu.blocks.vocabulary import GRAVITY, MID_EUROPE
from imufmu.compiled.running import simulate
from imufmu.plants.human import body
from imufmu.plants.human.plant import BLOCK
from imufmu.plants.time_functions import smooth_step, step_double_integral, step_integral
from imufmu.plants.truth import PARAMETERS
from support.human import (
    ACTIVITY,
    ANKLE,
    HEAD,
    HEIGHT,
    HIP,
    JUMP,
    KNEE,
    LEFT,
    PELVIS,
    RUN,
    WALK,
    length,
    moved,
    outputs_at,
)
from support.truth_consistency import assert_truth_consistent

# One motion


@ACTIVITY
@pytest.mark.parametrize("segment", range(5), ids=body.SEGMENTS)
def test_truth_is_one_motion_for_every_activity_and_segment(activity: dict[str, Any], segment: int) -> None:
    place = {"segment": segment, "imu_position": (0.05, -0.03, 0.02), "mount": (0.3, -0.5, 1.0), "heading": 0.7}
    run = moved(3.0, 0.002 if activity is JUMP else 0.004, activity, place, rest=0.5, ramp=1.0)
    assert segment == body.FOOT or length(run["velocity"]).max() > 0.1
    # The jump leaves the ground in 30 ms, with steps of the fourth derivative that a spline rounds off.
    tolerance = 3e-6 if activity is JUMP else 1e-6
    assert_truth_consistent(run, GRAVITY, np.array(MID_EUROPE), tolerance)


@pytest.mark.parametrize("segment", [body.PELVIS, body.FOOT], ids=["pelvis", "foot"])
def test_impacts_and_soft_tissue_belong_to_the_motion(segment: int) -> None:
    shaken = {"segment": segment, "impact_acceleration": 100.0, "wobble": 1, "rest": 0.2, "ramp": 0.4, "max_step": 5e-4}
    run = moved(1.5, 0.001, RUN, shaken)
    # A jump of the fourth derivative of a burst of 80 ms at both its ends, in rows of 1 ms.
    assert_truth_consistent(run, GRAVITY, np.array(MID_EUROPE), tolerance=1e-5)


@ACTIVITY
def test_any_communication_step_gives_the_same_truth(activity: dict[str, Any]) -> None:
    """To the rounding of the instant, by accelerations that change by 1e5 m/s3 at most."""
    given = activity | {"rest": 0.0, "max_step": 1.0}
    ends = [simulate(BLOCK, 0.6, step, parameters=given) for step in (1e-4, 0.01, 0.1, 0.6)]
    for name in ("q_NS", "position", "specific_force"):
        assert np.ptp([run[name][-1] for run in ends], axis=0).max() < 1e-10, name
        assert ends[0][name][-1] == pytest.approx(outputs_at(np.array([0.6]), given)[name][0], abs=1e-10)


def test_on_soft_tissue_the_truth_depends_on_the_solver_step_only() -> None:
    soft = {"rest": 0.0, "ramp": 0.5, "wobble": 1, "max_step": 1e-3}
    ends = [moved(1.0, step, WALK, soft) for step in (1e-4, 1e-3, 0.01, 0.1)]
    for name in ("position", "specific_force"):
        # 1 ms against 0.1 ms: (omega h)^4 / 120 of some m/s2, omega h = 0.14.
        assert np.ptp([run[name][-1] for run in ends], axis=0).max() < 2e-4, name


def test_integrals_of_the_smooth_step() -> None:
    s = ca.SX.sym("s")
    for integral, integrand in ((step_integral, smooth_step), (step_double_integral, step_integral)):
        slope = ca.Function("slope", [s], [ca.jacobian(integral(s), s) - integrand(s)])
        assert abs(np.array([float(slope(v)) for v in np.linspace(-0.5, 2, 50)])).max() < 1e-14
        assert float(integral(ca.DM(0))) == 0


# The body


@ACTIVITY
def test_bones_keep_their_lengths(activity: dict[str, Any]) -> None:
    bones = moved(6.0, 0.01, activity)["skeleton"]
    leg = {(HIP, KNEE): 0.245, (KNEE, ANKLE): 0.246, (HEAD, PELVIS): 0.47, (HIP, HIP + LEFT): 0.1}
    for (a, b), part in leg.items():
        for shift in (0, LEFT) if a > PELVIS and b < HIP + LEFT else (0,):
            found = length(bones[:, a + shift] - bones[:, b + shift])
            assert found == pytest.approx(part * HEIGHT, abs=1e-12), (a, b)  # rounding of tens of metres


def test_proportions_scale_with_height() -> None:
    small, tall = (moved(0.1, 0.1, WALK, height=h)["skeleton"][0] for h in (1.5, 2.0))
    assert small / 1.5 == pytest.approx(tall / 2.0, abs=1e-14)


@pytest.mark.parametrize("segment", range(5), ids=body.SEGMENTS)
def test_sensor_axes_are_x_forwards_z_up_in_upright_standing(segment: int) -> None:
    start = moved(0.1, 0.1, WALK, segment=segment, heading=0.4)
    tilt = body.PELVIC_TILT if segment == body.PELVIS else 0.0
    assert [start[n][0] for n in ("roll", "pitch", "yaw")] == pytest.approx([0, tilt, 0.4], abs=1e-15)


def test_the_sensor_sits_where_it_is_put() -> None:
    """On the shank, in its frame: from the middle between knee and ankle."""
    at = np.array([0.04, -0.05, 0.1])
    run = moved(4.0, 0.01, WALK, segment=body.SHANK, imu_position=at)
    middle = (run["skeleton"][:, KNEE] + run["skeleton"][:, ANKLE]) / 2
    along_shank = (run["skeleton"][:, KNEE] - middle) / (0.123 * HEIGHT)
    offset = run["position"] - middle
    assert length(offset) == pytest.approx(length(at), abs=1e-12)
    assert np.sum(offset * along_shank, axis=1) == pytest.approx(at[2], abs=1e-12)


def test_heading_turns_the_way() -> None:
    north = moved(6.0, 0.1, WALK, heading=np.pi / 2)["skeleton"]
    east = moved(6.0, 0.1, WALK)["skeleton"]
    assert north[..., 1] == pytest.approx(east[..., 0], abs=1e-12)
    assert north[..., 0] == pytest.approx(-east[..., 1], abs=1e-12)


# Soft tissue


def test_soft_tissue_of_no_give_is_a_rigid_mount_and_off_means_rigid() -> None:
    rigid, off, stiff = (
        moved(3.0, 0.01, WALK, max_step=5e-4, **wobble)
        for wobble in ({}, {"wobble": 0, "wobble_frequency": 5.0}, {"wobble": 1, "wobble_frequency": 60.0})
    )
    assert np.array_equal(rigid["specific_force"], off["specific_force"])
    # A mass of omega = 377 rad/s follows r'' to r'''' / omega^2; walking has 200 times the acceleration of its r''''.
    assert length(stiff["position"] - rigid["position"]).max() < 1e-4


def test_the_sensor_on_soft_tissue_is_a_mass_on_a_spring_and_damper() -> None:
    """Against an independent integration of the rigid acceleration, from differences of nothing but the rigid run."""
    tissue = {"wobble": 1, "wobble_frequency": 8.0, "wobble_damping": 0.2, "max_step": 5e-4}
    rigid, soft = (moved(3.0, 0.005, WALK, given) for given in ({}, tissue))
    base = make_interp_spline(rigid.time, rigid["position"], k=7).derivative(2)
    omega = 2 * np.pi * 8.0

    def slope(t: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[3:], -base(t) - 2 * 0.2 * omega * y[3:] - omega**2 * y[:3]])

    expected = solve_ivp(slope, (0, 3), np.zeros(6), "DOP853", rigid.time, rtol=1e-10, atol=1e-12, max_step=0.01).y[:3]
    offset = soft["position"] - rigid["position"]
    assert length(offset).max() > 1e-3
    assert offset == pytest.approx(expected.T, abs=1e-6)  # spline through rows of 5 ms


# Parameters


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("activity", 5),
        ("segment", -1),
        ("segment", 1.5),
        ("height", 0.5),
        ("speed", -1.0),
        ("cadence", 0.0),
        ("ramp", 0.0),
        ("impact_duration", 0.0),
        ("jump_acceleration", 1.0),
        ("stroke_time", 0.0),
        ("rise_time", 0.0),
        ("wobble_frequency", 0.0),
        ("wobble", 2),
    ],
)
def test_parameters_out_of_bounds_are_refused_by_name(name: str, value: float) -> None:
    with pytest.raises(ParameterError, match=rf"{name} = "):
        BLOCK.parameter_vector({name: value})


@ACTIVITY
def test_outputs_are_finite_and_bounded_with_every_parameter_at_its_bounds(activity: dict[str, Any]) -> None:
    shared = {"max_step", "activity"} | {q.name for q in PARAMETERS if q.name != "g"}
    for parameter in BLOCK.parameters:
        for value in () if parameter.name in shared else (parameter.minimum, parameter.maximum):
            at_bound = activity | {parameter.name: np.full(parameter.size, value)}
            values = outputs_at(np.linspace(0, 4, 41), at_bound)
            for q in BLOCK.reported:
                inside = (values[q.name] >= q.minimum) & (values[q.name] <= q.maximum)
                assert inside.all(), f"{parameter.name} = {value:g}: {q.name}"
