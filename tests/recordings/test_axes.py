"""Other conventions and mountings: readings become ours, estimates become theirs again, and a truth agrees in both."""

from __future__ import annotations

import numpy as np
import pytest

from imufmu.blocks.rotations import euler_from_quaternion, over_rows, quaternion_from_euler
from imufmu.recordings.axes import CONVENTIONS, parsed_axes
from imufmu.recordings.faults import RecordingError

LEVEL_NORTH = {"NED": (0.0, 0.0, 0.0), "NWU": (0.0, 0.0, 0.0), "ENU": (0.0, 0.0, np.pi / 2)}


def attitudes(seed: int = 2) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    roll, pitch, yaw = rng.uniform(-3, 3, 50), rng.uniform(-1.4, 1.4, 50), rng.uniform(-3, 3, 50)
    q_NS = over_rows(quaternion_from_euler, roll, pitch, yaw)
    return {"roll": roll, "pitch": pitch, "yaw": yaw, "q_NS": q_NS}


def test_an_aircraft_that_flies_level_to_the_north():
    """NED: x forward, y right, z down; at rest its z reads -g, and all angles are 0. Ours: yaw counts from East."""
    axes = parsed_axes("NED", None)
    one = np.ones((1, 3))
    theirs = {"accel": one * [0, 0, -9.81], "gyro": one * [0.1, 0.2, 0.3], "mag": one * [20, 1.4, 45]}
    theirs |= {"roll": np.zeros(1), "pitch": np.zeros(1), "yaw": np.zeros(1)}
    ours = axes.to_ours(theirs)
    assert ours["accel"].tolist() == [[0, 0, 9.81]]
    assert ours["gyro"].tolist() == [[0.1, -0.2, -0.3]]  # to the right is minus about z up
    assert ours["mag"].tolist() == [[20, -1.4, -45]]
    assert ours["yaw"] == pytest.approx(np.pi / 2)
    assert abs(ours["roll"][0]) < 1e-12 and abs(ours["pitch"][0]) < 1e-12  # a product of halves' roots


@pytest.mark.parametrize("convention", ["NED", "NWU"])
def test_nose_up_and_right_wing_down(convention):
    """In NED both angles are positive; with y to the left the pitch of a raised nose is negative."""
    sign = {"NED": 1, "NWU": -1}[convention]
    theirs = {"roll": np.array([0.3]), "pitch": np.array([sign * 0.2]), "yaw": np.array([0.0])}
    ours = parsed_axes(convention, None).to_ours(theirs)
    assert (ours["roll"][0], ours["pitch"][0]) == pytest.approx((0.3, -0.2))


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_what_went_in_comes_out(convention):
    axes = parsed_axes(convention, None)
    truth = attitudes()
    back = axes.from_ours(axes.to_ours(truth))
    for name in ("roll", "pitch", "yaw"):
        # Pitch stays 0.17 rad from the singularity, which multiplies rounding by 6.
        np.testing.assert_allclose(np.exp(1j * back[name]), np.exp(1j * truth[name]), atol=1e-13)
    same = np.abs((back["q_NS"] * truth["q_NS"]).sum(axis=1))
    np.testing.assert_allclose(same, 1, atol=1e-14)  # either sign is the same attitude
    vectors = {"vertical": np.random.default_rng(1).normal(size=(50, 3))}
    readings = axes.to_ours({"gyro": vectors["vertical"]})["gyro"]
    assert np.array_equal(axes.from_ours({"vertical": readings})["vertical"], vectors["vertical"])


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_angles_and_quaternion_say_the_same_in_every_convention(convention):
    turned = parsed_axes(convention, None).to_ours(attitudes())
    angles = over_rows(euler_from_quaternion, turned["q_NS"])
    for i, name in enumerate(("roll", "pitch", "yaw")):
        np.testing.assert_allclose(np.exp(1j * angles[:, i]), np.exp(1j * turned[name]), atol=1e-13)  # as above


def test_an_iphone_reads_minus_g_on_the_axis_that_points_up():
    ours = parsed_axes("ios", None).to_ours({"accel": np.array([[0, 0, -9.81]]), "gyro": np.array([[1.0, 2, 3]])})
    assert ours["accel"].tolist() == [[0, 0, 9.81]]
    assert ours["gyro"].tolist() == [[1, 2, 3]]


def test_a_sensor_that_is_mounted_upside_down():
    for mount in ("180,0,0", "x,-y,-z"):
        ours = parsed_axes(None, mount).to_ours({"accel": np.array([[0.1, 0.2, -9.81]])})
        np.testing.assert_allclose(ours["accel"], [[0.1, -0.2, 9.81]], atol=1e-14)  # a sine of 180 deg


def test_a_sensor_that_is_turned_to_the_left_by_a_quarter():
    """Its x axis points to the body's left: what it reads along x is along the body's y."""
    for mount in ("0,0,90", "-y,x,z"):
        ours = parsed_axes(None, mount).to_ours({"gyro": np.array([[1.0, 0, 0]])})
        np.testing.assert_allclose(ours["gyro"], [[0, 1, 0]], atol=1e-15)  # a cosine of 90 deg


@pytest.mark.parametrize(
    ("axes", "mount", "message"),
    [
        ("NEU", None, "no convention is called 'NEU'; there is ENU, NWU, NED"),
        (None, "x,y,-z", "mirror image.*--columns gyro=gx,gy,-gz"),
        (None, "x,x,z", "name each of x, y and z once"),
        (None, "1,2", "roll,pitch,yaw"),
        (None, "up", "roll,pitch,yaw"),
        (None, "nan,0,0", "finite"),
    ],
)
def test_what_is_no_convention_or_mounting_is_refused(axes, mount, message):
    with pytest.raises(RecordingError, match=message):
        parsed_axes(axes, mount)


def test_names_do_not_depend_on_capitals_and_ours_changes_nothing():
    assert parsed_axes("ned", None).name == "NED"
    assert parsed_axes("enu", None).are_ours and parsed_axes(None, None).note() == ""
    assert "NED" in parsed_axes("NED", "0,0,90").note() and "mounted" in parsed_axes("NED", "0,0,90").note()
