"""Claims about how the person moves: published ranges, cadence, impacts, flight, lean, standing up."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest

from imufmu.blocks.vocabulary import GRAVITY
from imufmu.plants.human import body
from imufmu.plants.human.activities import SQUARE_WAVE, TIPTOE
from imufmu.plants.human.gait import RUNNING, WALKING, Gait, series
from imufmu.plants.human.plant import IMPACT_SHARE
from support.human import (
    ANKLE,
    BALL,
    HEAD,
    HEEL,
    HEIGHT,
    JUMP,
    LEFT,
    PELVIS,
    RISE,
    RUN,
    SKATE,
    WALK,
    length,
    moved,
    steady,
)
from support.places import ROOT

GAITS = pytest.mark.parametrize("gait", [WALKING, RUNNING], ids=["walking", "running"])

# Walking and running against published figures


@GAITS
def test_curves_meet_their_published_key_points(gait: Gait) -> None:
    """Within 5 deg, the usual standard deviation between persons; most within 1 deg."""
    off = [
        np.degrees(float(series(getattr(gait, joint), percent / 100))) - angle
        for joint, points in gait.key_points.items()
        for percent, angle in points
    ]
    assert np.abs(off).max() < 5.0
    assert np.median(np.abs(off)) < 1.0


@pytest.mark.parametrize(
    ("activity", "bands"),
    [
        # The key points of [1] in human_gait span 45, 57 (to 65) and 25 deg; 5 deg to either side.
        (WALK, [(40, 50), (52, 65), (20, 30)]),
        # Arcs of slow runners in Pink et al. 1994, Am. J. Sports Med. 22(4): hip 40 and more at a faster pace, knee 95,
        # ankle 50; the key points of [2] in human_gait span 64, 65 at least, and 50.
        (RUN, [(40, 69), (65, 95), (45, 55)]),
    ],
    ids=["walking", "running"],
)
def test_ranges_of_motion_are_in_published_bands(activity: dict[str, Any], bands: list[tuple[float, float]]) -> None:
    run = moved(8.0, 0.005, activity)
    ranges = np.degrees(np.ptp(run["joint_angle"][steady(run)], axis=0))
    for found, (low, high) in zip(ranges, bands, strict=True):
        assert low <= found <= high


def test_the_hip_swings_further_with_a_longer_stride() -> None:
    ranges = []
    for speed in (0.9, 1.37, 1.8):
        run = moved(8.0, 0.01, WALK, speed=speed)
        ranges.append(np.ptp(run["joint_angle"][steady(run), 0]))
    assert np.array(ranges) / ranges[1] == pytest.approx(np.array([0.9, 1.37, 1.8]) / 1.37, rel=2e-3)  # rows of 10 ms


@pytest.mark.parametrize("activity", [WALK, RUN], ids=["walking", "running"])
def test_cadence_and_speed_are_as_stated(activity: dict[str, Any]) -> None:
    run = moved(12.0, 0.005, activity, segment=body.PELVIS)
    cadence, speed = activity.get("cadence", 113.0), activity.get("speed", 1.37)
    height = run["position"][steady(run), 2]
    spectrum = np.abs(np.fft.rfft((height - height.mean()) * np.hanning(len(height)), 16 * len(height)))
    steps_per_minute = 60 * np.argmax(spectrum) / (16 * len(height) * 0.005)
    assert steps_per_minute == pytest.approx(cadence, abs=60 / (16 * 9.0) + 0.1)  # one line of the spectrum
    stride = round(120 / cadence / 0.005)  # rows, to a row
    way = run["position"][-1 - 8 * stride, 0], run["position"][-1, 0]
    assert (way[1] - way[0]) / (8 * stride * 0.005) == pytest.approx(speed, rel=0.01)  # sway over a part of a row


@pytest.mark.parametrize("activity", [WALK, RUN], ids=["walking", "running"])
@pytest.mark.parametrize("segment", range(5), ids=body.SEGMENTS)
def test_gait_repeats_itself_every_stride_to_rounding(activity: dict[str, Any], segment: int) -> None:
    stride = 120 / activity.get("cadence", 113.0)
    run = moved(3.0 + 10 * stride, 1.0 * stride / 64, activity, segment=segment, impact_acceleration=50.0)
    rows = slice(round(3.0 / stride * 64) + 64, None)
    for name in ("specific_force", "angular_velocity", "vertical"):
        repeated = run[name][rows][64:] - run[name][rows][:-64]
        assert np.abs(repeated).max() < 1e-7, name  # bursts: 1e5 m/s3 times the rounding of 10 s


def test_the_left_leg_does_half_a_stride_later_what_the_right_one_did() -> None:
    stride = 120 / 113
    run = moved(3.0 + 4 * stride, stride / 64, WALK)
    bones = run["skeleton"][round(3.0 / stride * 64) + 64 :]
    right, left = (bones[:, ANKLE + s, 2] for s in (0, LEFT))
    assert left[32:] == pytest.approx(right[:-32], abs=1e-12)


def test_the_walking_pelvis_rises_and_sways_as_published() -> None:
    run = moved(8.0, 0.005, WALK, segment=body.PELVIS)
    position = run["position"][steady(run)]
    assert np.ptp(position[:, 2]) == pytest.approx(0.046, abs=2e-4)  # Perry, in Whittle 1997; rows of 5 ms
    assert np.ptp(position[:, 1]) == pytest.approx(0.040, abs=2e-4)  # as chosen
    speed = run["velocity"][steady(run), 0]
    assert 0.05 < np.ptp(speed) / 2 < 0.3  # m/s: it slows down on each step and speeds up again


def test_a_runner_flies_and_bounces_as_published() -> None:
    """Free fall for the flight; vertical oscillation 5 to 10 cm, usual among runners."""
    run = moved(8.0, 0.002, RUN, segment=body.PELVIS)
    rise = run["position"][steady(run), 2]
    assert 0.05 < np.ptp(rise) < 0.10
    up = np.einsum("ij,ij->i", run["specific_force"], run["vertical"])[steady(run)]
    # Three harmonics of a half sine: 28 % of each step nearly weightless, peak force 2 to 3 body weights.
    assert np.mean(up < 0.15 * GRAVITY) == pytest.approx(0.28, abs=0.08)
    assert 2.0 < up.max() / GRAVITY < 3.0
    assert np.mean(up) == pytest.approx(GRAVITY, rel=0.01)  # the ground carries the weight


@pytest.mark.parametrize(
    ("activity", "impact", "band"),
    [
        # Lafortune 1991, J. Biomechanics 24(10), accelerometer on a pin in the tibia: resultant 2.7 to 3.7 g in
        # walking, at most 10.6 g in running.
        (WALK, 25.0, (2.7, 3.7)),
        (RUN, 80.0, (5.0, 10.6)),
    ],
    ids=["walking", "running"],
)
def test_the_shank_feels_published_peak_accelerations(
    activity: dict[str, Any], impact: float, band: tuple[float, float]
) -> None:
    run = moved(8.0, 0.001, activity, segment=body.SHANK, impact_acceleration=impact)
    peak = length(run["specific_force"]).max() / GRAVITY
    assert band[0] <= peak <= band[1]


def test_an_impact_is_a_short_burst_of_the_stated_peak_after_the_contact() -> None:
    clean, run = (moved(8.0, 0.001, WALK, segment=body.FOOT, impact_acceleration=a) for a in (0.0, 60.0))
    added = run["specific_force"] - clean["specific_force"]
    up = np.einsum("ij,ij->i", added, run["vertical"])[steady(run)]
    assert up.max() == pytest.approx(60.0, rel=0.01)  # rows of 1 ms in a burst of 80 ms
    assert length(added)[steady(run)] == pytest.approx(np.abs(up), abs=1e-12)
    share = 0.08 * 113 / 120  # of a stride
    assert np.mean(np.abs(up) > 1e-9) == pytest.approx(share, abs=0.01)
    assert not added[run.time < 1.0].any()
    one = up[np.argmax(up) - 45 : np.argmax(up) + 45]
    spectrum = np.abs(np.fft.rfft(one, 4096))
    assert 12 < np.argmax(spectrum) / (4096 * 0.001) < 20  # Hz: Shorten and Winslow 1992, shanks of runners


@pytest.mark.parametrize("segment", range(5), ids=body.SEGMENTS)
def test_pelvis_and_trunk_feel_both_feet_and_a_leg_its_own(segment: int) -> None:
    given = {"segment": segment, "ramp": 1.0}
    clean, run = (moved(7.0, 0.002, WALK, given, impact_acceleration=a) for a in (0.0, 50.0))
    up = np.einsum("ij,ij->i", run["specific_force"] - clean["specific_force"], run["vertical"])[run.time > 2.0]
    share = IMPACT_SHARE[segment]
    assert up.max() == pytest.approx(50.0 * share, rel=0.01)  # rows of 2 ms in a burst of 80 ms
    bursts = np.count_nonzero(np.diff((up > 25.0 * share).astype(int)) == 1)
    contacts = 5.0 * 113 / 60 / (1 if segment in (body.PELVIS, body.TRUNK) else 2)
    assert abs(bursts - contacts) < 1


@pytest.mark.parametrize(
    ("activity", "lean"), [(WALK, 2.0), (RUN, 8.0), (SKATE, 35.0)], ids=["walking", "running", "skating"]
)
def test_the_trunk_leans_forwards_in_motion(activity: dict[str, Any], lean: float) -> None:
    run = moved(8.0, 0.05, activity, segment=body.TRUNK)
    assert np.degrees(run["pitch"][steady(run)]) == pytest.approx(lean, abs=1e-9)


@pytest.mark.parametrize(
    ("activity", "contact"), [(WALK, (0.02, 0.58)), (RUN, (0.02, 0.33))], ids=["walking", "running"]
)
def test_the_foot_that_carries_stays_near_its_place_on_the_ground(
    activity: dict[str, Any], contact: tuple[float, float]
) -> None:
    """models/human_segment/fit_gait.py prints 10 and 19 mm at most; the pelvis turns and lists besides."""
    stride = 120 / activity.get("cadence", 113.0)
    run = moved(10.0, stride / 200, activity)
    first = round((1.0 + 4 * stride) / (stride / 200))
    flat = slice(first + round(200 * max(contact[0], 0.13)), first + round(200 * contact[1]))
    ball = run["skeleton"][flat, BALL]
    assert np.ptp(ball[:, 0]) < 0.03
    assert np.abs(ball[:, 2]).max() < 0.03


@pytest.mark.parametrize("activity", [WALK, RUN], ids=["walking", "running"])
def test_no_foot_dips_5_cm_into_the_ground_in_the_ramps_and_2_cm_in_between(activity: dict[str, Any]) -> None:
    """The posture goes from standing to the gait and back in proportion: 37 and 41 mm as measured."""
    run = moved(22.0, 0.005, activity)
    lowest = run["skeleton"][..., 2].min(axis=1)
    assert -0.05 < lowest.min() < -0.03
    assert lowest[(run.time > 3.0) & (run.time < 19.0)].min() > -0.02


def test_the_printed_fit_is_the_one_in_the_module() -> None:
    sys.path.insert(0, str(ROOT / "models" / "human_segment"))
    import fit_gait

    for gait, p, contact in (
        (WALKING, fit_gait.WALK, fit_gait.WALKING_CONTACT),
        (RUNNING, fit_gait.RUN, fit_gait.RUNNING_CONTACT),
    ):
        fitted = fit_gait.fit(gait, p, contact)
        for joint in ("hip", "knee", "ankle"):
            # Printed to 0.01 deg; the solver stops within a tenth of that.
            assert getattr(gait, joint) == pytest.approx(getattr(fitted, joint), abs=0.02)
        assert (gait.drop, *gait.sway) == pytest.approx((fitted.drop, *fitted.sway), abs=2e-4)


@pytest.mark.parametrize("ramp", [2.0, 50.0])
@pytest.mark.parametrize("activity", [WALK, RUN, SKATE], ids=["walking", "running", "rollerblading"])
def test_motion_starts_and_ends_at_rest(activity: dict[str, Any], ramp: float) -> None:
    run = moved(8.0, 0.01, activity, rest=1.0, duration=5.0, ramp=ramp, segment=body.SHANK)
    still = (run.time < 1.0) | (run.time > 6.0)
    for name in ("velocity", "angular_velocity", "external_acceleration"):
        assert not np.abs(run[name][still]).any(), name
        assert np.abs(run[name][~still]).max() > 0.5


# Jump


def test_the_pelvis_falls_freely_in_flight_and_peaks_as_stated() -> None:
    for peak, rise in ((40.0, 0.35), (25.0, 0.2), (60.0, 0.5)):
        run = moved(4.0, 0.001, JUMP, segment=body.PELVIS, jump_acceleration=peak, jump_height=rise)
        v = np.sqrt(2 * GRAVITY * rise)
        flight = 2 * v / GRAVITY
        force = length(run["specific_force"])
        weightless = run.time[force < 1e-9]  # rounding of a difference of metres over T_r^2
        assert np.ptp(weightless) == pytest.approx(flight - 0.03, abs=0.004)  # the release takes 30 ms on both sides
        assert np.all(np.diff(weightless) < 0.0015)  # one flight
        assert length(run["external_acceleration"]).max() == pytest.approx(peak, rel=1e-3)  # rows of 1 ms
        assert run["position"][-1] == pytest.approx(run["position"][0], abs=1e-14)
        top = run["position"][:, 2].max() - run["position"][run.time < weightless[0], 2][-1]
        assert top == pytest.approx(rise, abs=0.15 * rise)  # from the end of the release to the top


def test_a_jumper_stays_on_the_ground_until_take_off_and_bends_the_knees() -> None:
    run = moved(4.0, 0.002, JUMP, segment=body.PELVIS)
    bones = run["skeleton"]
    dip = bones[:, PELVIS, 2] < bones[0, PELVIS, 2] - 0.02
    assert bones[:, BALL, 2].min() > -0.5 * 0.017 * HEIGHT - 1e-3  # eps / 2
    assert np.abs(bones[dip, HEEL, 2]).max() < 0.02
    assert bones[:, BALL, 2].max() > 0.3
    knee = np.degrees(run["joint_angle"][:, 1])
    assert 40 < knee.max() < 100 and knee.min() > 5
    assert np.degrees(run["joint_angle"][:, 2]).min() > -np.degrees(TIPTOE) - 30


@pytest.mark.parametrize(("peak", "rise"), [(40.0, 0.35), (20.0, 0.6), (10.0, 1.0)])
def test_nobody_pushes_off_in_the_air(peak: float, rise: float) -> None:
    """Also where the push asked for is longer than the legs: the pelvis leaves at most on the balls of the feet."""
    run = moved(5.0, 0.002, JUMP, segment=body.PELVIS, jump_acceleration=peak, jump_height=rise)
    height, weightless = run["position"][:, 2], length(run["specific_force"]) < 1e-9
    release = np.sqrt(2 * GRAVITY * rise) * 0.032  # m, at most: the way in the time of release and a row
    assert 0 < height[np.argmax(weightless)] - height[0] < 0.05 * HEIGHT + release
    assert height.max() - height[0] == pytest.approx(rise + 0.05 * HEIGHT, rel=0.15)  # release, low heels
    assert length(run["external_acceleration"]).max() > 0.99 * peak  # rows of 2 ms


# Rollerblading


def test_a_skater_holds_a_lean_that_balances_the_sideways_acceleration() -> None:
    run = moved(12.0, 0.005, SKATE, segment=body.PELVIS, lateral_acceleration=2.0, stroke_time=1.4)
    rows = steady(run)
    bones = run["skeleton"][rows]
    sideways = np.gradient(np.gradient(bones[:, PELVIS, 1], 0.005), 0.005)[5:-5]
    lean = run["roll"][rows][5:-5]
    assert np.tan(lean) == pytest.approx(-sideways / GRAVITY, abs=2e-3)  # differences over 5 ms
    held = np.abs(sideways) > 0.97 * 2.0
    assert held.mean() > 0.6  # of each stroke
    starts = np.flatnonzero(np.diff(held.astype(int)) == 1)
    assert np.diff(starts)[1:] * 0.005 == pytest.approx(1.4, abs=0.02)
    assert np.all(np.sign(sideways[starts + 50][1:]) == -np.sign(sideways[starts + 50][:-1]))


def test_the_square_wave_is_flat() -> None:
    s = np.linspace(0.2, 0.8, 100)
    wave = sum(c * np.sin(k * np.pi * s) for k, c in SQUARE_WAVE.items())
    assert np.abs(wave - 1).max() < 0.03


def test_the_outer_leg_pushes_and_both_skates_stay_near_the_ground() -> None:
    run = moved(12.0, 0.01, SKATE)
    bones = run["skeleton"][run.time > 3.5]
    for foot in (ANKLE, ANKLE + LEFT):
        assert np.abs(bones[:, foot, 2] - 0.039 * HEIGHT).max() < 0.03
    apart = bones[:, ANKLE + LEFT, 1] - bones[:, ANKLE, 1]
    assert apart.max() > 0.4 and apart.min() > 0.1
    assert np.mean(run["velocity"][(run.time > 4) & (run.time < 10), 0]) == pytest.approx(
        5.0, abs=0.02
    )  # sway, part of a stroke


# Sit-to-stand


def test_standing_up_takes_its_time_and_keeps_the_feet_on_the_ground() -> None:
    run = moved(4.0, 0.01, RISE, segment=body.TRUNK, rise_time=2.0)  # 1.7 to 2.3 s, Arch. Phys. Med. Rehab. 74, 1993
    bones = run["skeleton"]
    assert np.ptp(bones[:, ANKLE], axis=0).max() < 1e-12
    assert np.ptp(bones[:, HEEL], axis=0).max() < 1e-12
    moving = run.time[length(run["angular_velocity"]) > 1e-3]
    assert 1.0 < moving[0] < 1.2 and 2.8 < moving[-1] < 3.0
    knee, lean = np.degrees(run["joint_angle"][:, 1]), np.degrees(run["pitch"])
    assert knee[0] == pytest.approx(95) and knee[-1] == pytest.approx(0, abs=1e-9)
    assert 30 < lean.max() <= 40 and lean[[0, -1]] == pytest.approx([0, 0], abs=1e-9)
    assert bones[-1, HEAD, 2] == pytest.approx(HEIGHT)
    assert np.all(np.diff(bones[:, PELVIS, 2]) > -5e-3)  # it rises; the thighs roll on the seat before
