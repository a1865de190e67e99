"""Fit the Fourier series of src/imufmu/plants/human/gait.py and print them: python models/human_segment/fit_gait.py

Least squares over: the published key points (each over 2 deg); the point of the foot that carries (heel, then heel and
ball, then ball), which must stay on the ground where it is (each over 2 cm), and clear it by 1 cm in the swing; angles
beyond the smallest and the largest key point (each over 2 deg); the size of the higher harmonics and the acceleration
of the sway (each over 2 m/s2), so that they do no more than needed. The unknowns are the series of hip, knee and ankle,
the mean height of the pelvis and its sway forwards. The posture is that of the product's own equations.
"""

from __future__ import annotations

from dataclasses import replace
from math import pi
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
from scipy.optimize import least_squares

from imufmu.blocks.vocabulary import GRAVITY
from imufmu.plants.human.body import BALL, FOOT, HEEL, segments
from imufmu.plants.human.gait import HARMONICS, RUNNING, WALKING, Gait, gait_posture, series

HEIGHT = 1.75
WALK = SimpleNamespace(height=HEIGHT, speed=1.37, cadence=113.0, g=GRAVITY)
RUN = SimpleNamespace(height=HEIGHT, speed=3.3, cadence=168.0, g=GRAVITY)
TERMS = 2 * HARMONICS + 1
JOINTS = ("hip", "knee", "ankle")

# Which points of the foot carry: name, from, to (part of the cycle).
WALKING_CONTACT = ((HEEL, 0.02, 0.38), (BALL, 0.13, 0.58))
RUNNING_CONTACT = ((HEEL, 0.02, 0.16), (BALL, 0.04, 0.33))


def contact_points(gait: Gait, p: SimpleNamespace, place: Any, phases: np.ndarray) -> Any:
    """(n, 2): forwards and up, m, of this point of the right foot at these phases."""
    stride = 120 * p.speed / p.cadence
    rows = []
    for phase in phases:
        point = segments(gait_posture(gait, phase, p), p.height)[FOOT].point(p.height * ca.vertcat(*place))
        rows.append(ca.horzcat(point[0] + stride * phase, point[2]))
    return ca.vertcat(*rows)


def residuals(gait: Gait, p: SimpleNamespace, contact: Any) -> Any:
    """Everything that ought to be zero, as a column."""
    rows = []
    for joint in JOINTS:
        coefficients, points = getattr(gait, joint), gait.key_points[joint]
        angles = [angle for _, angle in points]
        rows += [(angle_at(coefficients, percent / 100) - angle) / 2.0 for percent, angle in points]
        for phase in np.linspace(0, 1, 40, endpoint=False):
            angle = angle_at(coefficients, phase)
            rows.append((ca.fmax(angle - max(angles), 0) + ca.fmin(angle - min(angles), 0)) / 2.0)
        for k in range(1, HARMONICS + 1):
            rows += [coefficients[2 * k - 1] * k**2 / 150, coefficients[2 * k] * k**2 / 150]
    step_rate = 2 * pi * p.cadence / 60
    rows += [s * p.height * step_rate**2 / 2.0 for s in gait.sway]
    for place, start, stop in contact:
        points = contact_points(gait, p, place, np.linspace(start, stop, 15))
        rows += [ca.vec(points[:, 0] - ca.sum1(points[:, 0]) / 15) / 0.02, ca.vec(points[:, 1]) / 0.02]
        swing = contact_points(gait, p, place, np.linspace(gait.stance, 1, 20))
        rows.append(ca.fmin(swing[:, 1] - 0.01, 0) / 0.01)
    return ca.vertcat(*rows)


def angle_at(coefficients: Any, phase: float) -> Any:
    """Joint angle, deg."""
    return series(coefficients, phase) * 180 / pi


def fit(gait: Gait, p: SimpleNamespace, contact: Any) -> Gait:
    """The gait with its coefficients fitted."""
    x = ca.SX.sym("x", 3 * TERMS + 3)
    parts = ca.vertsplit(x)

    def with_values(values: Any) -> Gait:
        joints = {j: tuple(values[i * TERMS : (i + 1) * TERMS]) for i, j in enumerate(JOINTS)}
        return replace(gait, **joints, drop=values[3 * TERMS], sway=tuple(values[3 * TERMS + 1 :]))

    errors = residuals(with_values(parts), p, contact)
    value, slope = ca.Function("r", [x], [errors]), ca.Function("J", [x], [ca.jacobian(errors, x)])
    found = least_squares(lambda v: np.array(value(v)).ravel(), np.zeros(x.numel()), lambda v: np.array(slope(v)))
    return with_values([float(v) for v in found.x])


def main() -> None:
    for name, gait, p, contact in (
        ("WALKING", WALKING, WALK, WALKING_CONTACT),
        ("RUNNING", RUNNING, RUN, RUNNING_CONTACT),
    ):
        fitted = fit(gait, p, contact)
        print(name)
        for joint in JOINTS:
            values = getattr(fitted, joint)
            print(f"    {joint}=({', '.join(f'{v:.2f}' for v in values)}),")
        print(f"    drop={fitted.drop:.4f},\n    sway=({', '.join(f'{v:.4f}' for v in fitted.sway)}),")
        for joint in JOINTS:
            off = [
                float(angle_at(getattr(fitted, joint), percent / 100)) - angle
                for percent, angle in gait.key_points[joint]
            ]
            print(f"  # {joint} minus its key points: {', '.join(f'{d:+.1f}' for d in off)} deg")
        for place, start, stop in contact:
            points = np.array(ca.DM(contact_points(fitted, p, place, np.linspace(start, stop, 50))))
            x, z = np.ptp(points[:, 0]), points[:, 1]
            print(
                f"  # foot on the ground: slides {1e3 * x:.0f} mm, height {1e3 * z.min():.0f} to {1e3 * z.max():.0f} mm"
            )


if __name__ == "__main__":
    main()
