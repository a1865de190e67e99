"""Kalman filter of a fixed direction, seen from the sensor: the equations that several papers share.

A direction that stands still in N turns in S against the gyroscope. lee2012 [1] tracks the vertical, from the
accelerometer and a model of the external acceleration; zihajehzadeh2014 tracks the vertical in the same way and East
from the magnetometer. Equation numbers are those of [1].

    paper   here   unit    meaning
    Z       d      1       the direction in S, of any length
    P       P      1       its covariance
    Z+, a+  Z, a   1, m/s2 vertical and external acceleration, a posteriori

From one sample to the next, dt later, with Z+ and y_G of the one before:

    Phi = I - dt [y_G x],   Q = -dt^2 sigma_G^2 [Z+ x] [Z+ x]                                (12), (15)
    Z- = Phi Z+,   P- = Phi P+ Phi' + Q                                                      (24), (25)

A measurement z of h Z, with the variance sigma^2 on each axis, corrects this:

    K = h P- (h^2 P- + sigma^2 I)^-1                                                         (26)
    Z+ = Z- + K (z - h Z-),   P+ = P- - h K P-                                               (27), (28)

For the vertical the accelerometer measures g Z, less what is left of the external acceleration of the sample before.
Then Z+ is given unit length, and what gravity leaves of the reading is the external acceleration:

    z = y_A - c_a a+,   sigma^2 = c_a^2 |a+|^2 / 3 + sigma_A^2                               (18), (23)
    a+ = y_A - g Z+                                                                          (29)

An acceleration that lasts is not in that model: (27) takes it over whole, sooner or later, and P does not know. Where
the user says how large it may be, sigma_m on each axis, the one-sigma tilt does:

    tilt_std^2 = tr P - Z' P Z + 2 (sigma_m / g)^2

A block that uses this module declares GYRO_VARIANCE and GYRO_INDEX, and for the vertical ACCEL_VARIANCE, GRAVITY and
MODEL_ERROR.

[1] Lee, Park, Robinovitch, Estimation of Attitude and External Acceleration Using Inertial Sensor Measurement During
    Various Dynamic Conditions, IEEE TIM 61(8), 2012, doi:10.1109/TIM.2012.2187245
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca

from ..blocks.rotations import root, skew, unit
from ..blocks.signals import integer, real
from . import kalman

NO_DIRECTION = 1e-6  # of the usual magnitude: a first sample shorter than this points nowhere
LARGEST_TRACE = 1e6  # of P: a longer prediction without update would overflow; nothing is known by then
LARGEST_LENGTH = 1e3  # of a direction that is not normalised: (12) makes it longer with every sample

GYRO_VARIANCE = real(
    "sigma_g2", "rad2/s2", 1e-4, (0, 1e3), "Gyroscope variance per sample; larger trusts it less", tunable=True
)
ACCEL_VARIANCE = real(
    "sigma_a2", "m2/s4", 1e-4, (1e-9, 1e6), "Accelerometer variance per sample; larger trusts it less", tunable=True
)
GRAVITY = real("g", "m/s2", 9.8, (1, 100), "Magnitude of gravity; 9.8 as in Lee et al. 2012")
MODEL_ERROR = real(
    "model_error",
    "m/s2",
    0.0,
    (0, 100),
    "sigma_m: lasting acceleration that the model does not know, per axis; adds to tilt_std only",
    tunable=True,
)
GYRO_INDEX = integer(
    "gyro_index", 0, (0, 2), "Gyroscope sample of the prediction: 0 previous (as printed), 1 current, 2 mean"
)


def rate(u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Gyroscope sample of the prediction from t-1 to t: y_G,t-1 as printed, y_G,t, or their mean."""
    mean = (u.gyro_previous + u.gyro) / 2
    return ca.if_else(p.gyro_index == 0, u.gyro_previous, ca.if_else(p.gyro_index == 1, u.gyro, mean))


def predict(d: Any, P: Any, gyro: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """A priori direction and covariance."""
    dt = p.sample_period
    Phi = ca.SX.eye(3) - dt * skew(gyro)  # (12)
    Q = -(dt**2) * p.sigma_g2 * skew(d) @ skew(d)  # (15)
    P = kalman.predicted(Phi @ P @ Phi.T + Q)  # (25)
    unknown = LARGEST_TRACE / 3 * ca.SX.eye(3)  # scaled down instead, P would lose its small eigenvalues
    return Phi @ d, ca.if_else(ca.trace(P) > LARGEST_TRACE, unknown, P)  # (24)


def update(d: Any, P: Any, z: Any, M: Any, scale: Any, accepted: Any) -> tuple[Any, Any, Any]:
    """A posteriori direction (not normalised), covariance, innovation; direction and covariance as before if not
    accepted.

    z (3,): measurement of scale * d. M: scalar, the variance of each of its elements: they correct one after the other,
    with the numbers of (26) to (28), without an inverse and without leaving the symmetric positive matrices.
    """
    innovation = z - scale * d
    for axis in range(3):
        d, P = kalman.update_by_state(d, P, axis, scale, z[axis], M, accepted)  # (26) to (28), H = scale I
    return d, P, innovation


def normalised(d: Any, switch: Any) -> Any:
    """d of unit length; where ``switch`` is 0 as it is, up to LARGEST_LENGTH."""
    return ca.if_else(switch, unit(d), d / ca.fmax(1, ca.norm_2(d) / LARGEST_LENGTH))


def has_vertical(u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """1 where the accelerometer sample has a direction to start from."""
    return ca.logic_and(ca.norm_2(u.accel) > NO_DIRECTION * p.g, 1 - u.accel_missing)


def first_vertical(u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Up vector in S from one accelerometer sample; (0, 0, 1) where it has no direction."""
    return ca.if_else(has_vertical(u, p), unit(u.accel), ca.DM([0, 0, 1]))


def first_acceleration(Z: Any, started: Any, u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """External acceleration of the first sample: what gravity along Z leaves of it."""
    return ca.if_else(ca.logic_and(started, 1 - u.accel_missing), u.accel - p.g * Z, 0)


def vertical_step(
    Z: Any, a: Any, P: Any, u: SimpleNamespace, p: SimpleNamespace, *, c_a: Any, accepted: Any, normalise: Any = 1
) -> tuple[Any, Any, Any, Any]:
    """Vertical, external acceleration, covariance and innovation (m/s2), one sample on.

    c_a: part of the acceleration that the model keeps; 0 is no model. accepted: 0 predicts only.
    """
    M = c_a**2 * ca.sumsqr(a) / 3 + p.sigma_a2  # (22), (23)
    Z, P = predict(Z, P, rate(u, p), p)
    Z, P, innovation = update(Z, P, u.accel - c_a * a, M, p.g, accepted)  # z: (18)
    Z = normalised(Z, normalise)
    a = ca.if_else(u.accel_missing, a, u.accel - p.g * Z)  # (29)
    return Z, a, P, ca.if_else(u.accel_missing, 0, innovation)


def tilt_std(Z: Any, P: Any, p: SimpleNamespace, length: Any = 1) -> Any:
    """One-sigma tilt (rad): by the covariance P of the vertical, its part across the unit vector Z, and by what the
    model does not know.

    length: of the vertical, in the unit of P's root.
    """
    across = (ca.trace(P) - Z.T @ P @ Z) / length**2
    return root(across + 2 * (p.model_error / p.g) ** 2)
