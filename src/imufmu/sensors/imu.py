"""Inertial and magnetic measurement unit: ideal signals in, readings of a real device out.

Gyroscope, accelerometer and magnetometer share one error model. With u the ideal signal (3,) in the sensor frame, the
errors act in this order, each exactly off at zero:

    1  alignment, scale   (I + diag(scale_error)) M u
    2  bias               + bias + bias_instability d_k
    3  white noise        + noise_density sqrt(sample_rate / 2) n_k
    4  range              clipped to [-range, range]; 0 is the bound of the reading's signal
    5  resolution         rounded to whole multiples of resolution; 0 is off

A range that is a whole multiple of the resolution stays the largest reading. Nothing leaves the bounds of the reading's
signal, beyond which an estimator takes it for missing.

Alignment. Row i of M is the direction of sensitive axis i, to first order in the angles m_ij (rad) by which it leans
towards axis j (for cross-axis sensitivity: reading i per unit along axis j):

        |  1    m_12  m_13 |
    M = | m_21   1    m_23 |     misalignment = (m_12, m_13, m_21, m_23, m_31, m_32)
        | m_31  m_32   1   |

Calibration [1] finds these six numbers; three do where the sensor frame is defined by the sensor itself (M lower
triangular: axes not orthogonal). A sensor turned as a whole by the small rotation vector r (rad) has M = I - skew(r):
misalignment = (r3, -r2, -r3, r1, r2, -r1).

Bias instability. d is a first-order Gauss-Markov process of unit variance with correlation time bias_time, sampled
without error and stationary from the first sample: d_0 = n, d_k = a d_k-1 + sqrt(1 - a^2) n with
a = exp(-period / bias_time). So bias_instability is a standard deviation. Its Allan deviation peaks at
0.617 bias_instability, at 1.89 bias_time [2]: divide an in-run bias stability, which is a level of the Allan deviation,
by 0.617.

White noise. noise_density is one-sided, as datasheets print it. The variance per sample, noise_density^2 / (2 period),
is sigma_G^2, sigma_A^2 or sigma_M^2 of the Kalman filters' papers; delta_n and delta_v of Rizun 2008, (14), are
densities as here. White noise of angle or velocity random walk N (Allan deviation N / sqrt(t)) has noise_density
sqrt(2) N.

Draws. Every sample takes 18 standard normal draws, whichever errors are on: 9 for the drifts d, then 9 for the white
noise n, each in the order gyro, accel, mag and x, y, z. So an error switched on leaves the others' values as they were.

[1] Tedaldi, Pretto, Menegatti, A Robust and Easy to Implement Method for IMU Calibration without External Equipments,
    ICRA 2014, doi:10.1109/ICRA.2014.6907297
[2] IEEE Std 952-1997, Specification Format Guide and Test Procedure for Single-Axis Interferometric Fiber Optic Gyros,
    annex C
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca

from ..blocks import vocabulary as v
from ..blocks.block import Expressions, SampledBlock
from ..blocks.signals import Parameter, Signal, State, real

SENSORS = ((v.ANGULAR_VELOCITY, v.GYRO), (v.SPECIFIC_FORCE, v.ACCEL), (v.MAGNETIC_FIELD, v.MAG))  # ideal, reading
AXES = 3 * len(SENSORS)
ALL_WHOLE = 2.0**52  # a number of this size has no fraction


def error_parameters(sensor: Signal) -> tuple[Parameter, ...]:
    """The parameters of one sensor; names and units follow from its reading. All may change during a run."""
    unit, limit = sensor.unit, sensor.maximum

    def error(
        name: str, unit: str, bounds: tuple[float, float], text: str, size: int = 0, start: float = 0
    ) -> Parameter:
        return real(f"{sensor.name}_{name}", unit, start, bounds, text, shape=(size,) if size else (), tunable=True)

    return (
        error("misalignment", "rad", (-0.5, 0.5), "Lean of axis i towards j, ij = 12, 13, 21, 23, 31, 32", size=6),
        error("scale_error", "1", (-1, 1), "Relative error of the scale factor, each axis", size=3),
        error("bias", unit, (-limit, limit), "Constant bias, each axis", size=3),
        error("bias_instability", unit, (0, limit), "Standard deviation of the drifting bias (Gauss-Markov)"),
        error("bias_time", "s", (1e-6, 1e9), "Correlation time of the drifting bias", start=100.0),
        error("noise_density", f"{unit}/sqrt(Hz)", (0, limit), "White noise, one-sided density"),
        error("range", unit, (0, limit), f"Largest reading, either sign; 0 is {limit:g}"),
        error("resolution", unit, (0, limit), "Step of the reading; 0 off"),
    )


def errors_of(sensor: Signal, p: SimpleNamespace) -> SimpleNamespace:
    """The parameters of one sensor without its prefix."""
    prefix = f"{sensor.name}_"
    return SimpleNamespace(**{name.removeprefix(prefix): e for name, e in vars(p).items() if name.startswith(prefix)})


def next_drift(drift: Any, n: Any, bias_time: Any, period: Any) -> Any:
    """Gauss-Markov process of unit variance, one period on; n (3,) standard normal."""
    a = ca.exp(-period / bias_time)
    return a * drift + ca.sqrt(1 - a**2) * n


def alignment_matrix(misalignment: Any) -> Any:
    """M (3, 3): rows are the sensitive axes."""
    m12, m13, m21, m23, m31, m32 = ca.vertsplit(misalignment)
    return ca.vertcat(ca.horzcat(1, m12, m13), ca.horzcat(m21, 1, m23), ca.horzcat(m31, m32, 1))


def within(y: Any, limit: Any) -> Any:
    """Every element clipped to [-limit, limit]."""
    return ca.fmax(-limit, ca.fmin(y, limit))


def rounded(y: Any, step: Any) -> Any:
    """The nearest whole multiples of step; y itself where they are as dense as numbers are, and where step is 0."""
    counts = y / ca.if_else(step > 0, step, 1)
    coarse = ca.logic_and(step > 0, ca.fabs(counts) < ALL_WHOLE)
    return ca.if_else(coarse, step * ca.floor(counts + 0.5), y)


def reading(ideal: Any, drift: Any, n: Any, e: SimpleNamespace, period: Any, limit: float) -> Any:
    """Reading (3,) of one sensor with errors e; drift and n (3,) are of unit variance."""
    y = (1 + e.scale_error) * (alignment_matrix(e.misalignment) @ ideal)
    y += e.bias + e.bias_instability * drift
    y += e.noise_density / ca.sqrt(2 * period) * n
    y = within(y, ca.if_else(e.range > 0, e.range, limit))
    return within(rounded(y, e.resolution), limit)


def initial(u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Drifts of the first sample, from their stationary distribution."""
    return dict(drift=u.normal[:AXES])


def step(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Drifts of the next sample."""
    drifts = zip(SENSORS, ca.vertsplit(x.drift, 3), ca.vertsplit(u.normal[:AXES], 3), strict=True)
    return dict(
        drift=ca.vertcat(*(next_drift(d, n, errors_of(s, p).bias_time, p.sample_period) for (_, s), d, n in drifts))
    )


def output(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Readings of one sample."""
    draws = zip(SENSORS, ca.vertsplit(x.drift, 3), ca.vertsplit(u.normal[AXES:], 3), strict=True)
    return {
        sensor.name: reading(getattr(u, ideal.name), drift, n, errors_of(sensor, p), p.sample_period, sensor.maximum)
        for (ideal, sensor), drift, n in draws
    }


BLOCK = SampledBlock(
    name="imu",
    summary="IMU: gyroscope, accelerometer and magnetometer readings with the errors of a real device",
    doc="""Samples angular velocity, specific force and magnetic field at the mounting point and adds, in this order:
misalignment and scale error, constant and drifting bias, white noise, saturation at the range, rounding to the
resolution. Every error is off at zero, so the block as it stands is an ideal IMU. Noise density is one-sided, as
datasheets print it: the standard deviation of a sample is noise density times the square root of half the sample rate.
Not modelled: bandwidth, temperature, nonlinearity, sensitivity of the gyroscope to acceleration. An input that is not
finite or out of its bounds is held.""",
    reference="Error model: IEEE Std 952-1997, annex C; D. Tedaldi, A. Pretto, E. Menegatti, ICRA 2014, "
    "doi:10.1109/ICRA.2014.6907297",
    inputs=v.IDEAL_IMU,
    outputs=tuple(sensor for _, sensor in SENSORS),
    locals=(),
    own_parameters=tuple(parameter for _, sensor in SENSORS for parameter in error_parameters(sensor)),
    state=(State("drift", (AXES,)),),
    initial=initial,
    step=step,
    output=output,
    normals=2 * AXES,
)
