"""How well a gyroscope and an accelerometer can know the vertical: the error formulas of Rizun 2008.

Every function takes SI units and follows one equation of the paper, whose number ends its description:

    omega    rad/s           angular frequency, either sign
    omega_g  rad/s           cut-off of the filter
    omega_c  rad/s           where the spectrum of human velocity ends; infinite in the paper from (34) on
    delta_n  rad/s/sqrt(Hz)  gyroscope noise, one-sided density, as datasheets print it
    delta_v  m/s/sqrt(Hz)    slosh: one-sided density of the sensor's velocity
    g        m/s2            magnitude of gravity

Spectra are two-sided, per Hz: delta_n^2 / 2 and delta_v^2 / 2 are densities for either sign of omega, and a mean square
is the integral over both signs divided by 2 pi. A mean square error, (m/s2)^2, is that of one component of gravity.
Numbers or arrays of numbers go in and come out.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..blocks.vocabulary import GRAVITY
from ..cosim.ssp.files import DescriptionError
from ..cosim.ssp.parameters import read_parameter_set
from ..cosim.units import Unit, conversion
from ..estimators.rizun2008 import mean_square_error, optimal_cutoff, tilt_variance
from ..files.locations import models_folder
from ..files.names import no_such
from .table import Table

__all__ = [
    "acceleration_spectrum",
    "bias_tilt",
    "error_spectrum",
    "error_spectrum_peak",
    "first_order_cutoff",
    "first_order_error",
    "first_order_response",
    "gyro_drift_rms",
    "gyro_noise_density_of",
    "mean_square",
    "mean_square_error",
    "optimal_cutoff",
    "optimal_error_spectrum",
    "predict",
    "second_order_error",
    "settling_time",
    "signal_spectrum",
    "slosh_error",
    "tilt_rms",
    "tilt_variance",
    "wiener_response",
]

SETTLED = 0.05  # of the initial error
_POINTS = 20_000  # of the quadrature; even, so none lies at frequency 0


def gyro_drift_rms(delta_n: Any, t: Any) -> Any:
    """Root mean square tilt (rad) of the gyroscope alone, t (s) after a perfect start. (11)"""
    return delta_n * t**0.5


def signal_spectrum(omega: Any, delta_n: Any, g: float = GRAVITY) -> Any:
    """Spectrum ((m/s2)^2/Hz) of gravity in the gyro-estimated Earth frame, which drifts. (20)"""
    return g**2 * delta_n**2 / 2 / omega**2


def acceleration_spectrum(omega: Any, delta_v: Any, omega_c: float = np.inf) -> Any:
    """Spectrum ((m/s2)^2/Hz) of the sensor's acceleration: derivative of band-limited white velocity. (15), (16)"""
    return delta_v**2 / 2 * omega**2 / (1 + (omega / omega_c) ** 2)


def wiener_response(omega: Any, omega_g: float, omega_c: float = np.inf) -> Any:
    """Frequency response of the optimal filter, complex; omega_c > omega_g / sqrt(2). (33), (34)"""
    half = np.arcsin(omega_g**2 / (2 * omega_c**2)) / 2  # (25), (27)
    damping = np.sqrt(2) * omega_g * (np.cos(half) + np.sin(half))
    return omega_g**2 * (1 + 1j * omega / omega_c) / (omega_g**2 - omega**2 + damping * 1j * omega)


def first_order_response(omega: Any, cutoff: float) -> Any:
    """Frequency response of the filter that takes acceleration for white, complex. Section 4.2"""
    return cutoff / (1j * omega + cutoff)


def error_spectrum(
    omega: Any, response: Any, delta_n: Any, delta_v: Any, g: float = GRAVITY, omega_c: float = np.inf
) -> Any:
    """Spectrum ((m/s2)^2/Hz) of the error of a filter with this response at omega: signal lost, noise let in. (41)"""
    lost = np.abs(1 - response) ** 2 * signal_spectrum(omega, delta_n, g)
    return lost + np.abs(response) ** 2 * acceleration_spectrum(omega, delta_v, omega_c)


def optimal_error_spectrum(omega: Any, delta_n: Any, delta_v: Any, g: float = GRAVITY) -> Any:
    """Spectrum ((m/s2)^2/Hz) of the error of the optimal filter. (42)"""
    chi = omega / optimal_cutoff(delta_n, delta_v, g)
    return g * delta_n * delta_v * (1 + chi**2) / (1 + chi**4)


def error_spectrum_peak(delta_n: float, delta_v: float, g: float = GRAVITY) -> tuple[float, float]:
    """Where (42) is largest (rad/s), and its value there ((m/s2)^2/Hz). Text after (42)"""
    at = (2**0.5 - 1) ** 0.5 * optimal_cutoff(delta_n, delta_v, g)
    return at, (1 + 2**0.5) / 2 * g * delta_n * delta_v


def mean_square(spectrum: Callable[[np.ndarray], np.ndarray], scale: float) -> float:
    """Integral of a spectrum over all frequencies, divided by 2 pi, by quadrature. (43), (44)

    spectrum: of frequencies (n,) in rad/s; it must fall off as 1/omega^2 or faster. scale: rad/s, where it bends.
    With omega = scale tan(theta) the integrand is smooth and periodic, so the midpoint rule converges fast.
    """
    theta = (np.arange(_POINTS) + 0.5) / _POINTS * np.pi - np.pi / 2
    omega = scale * np.tan(theta)
    return float(np.mean(spectrum(omega) * scale / np.cos(theta) ** 2) / 2)


def slosh_error(delta_n: Any, delta_v: Any, a: Any = 1.0, g: float = GRAVITY) -> Any:
    """Mean square error of the filter that is optimal for delta_v, where the slosh is a delta_v. (46), (48), (49)"""
    return mean_square_error(optimal_cutoff(delta_n, delta_v, g), delta_n, a * delta_v, g)


def tilt_rms(delta_n: Any, delta_v: Any, a: Any = 1.0, g: float = GRAVITY) -> Any:
    """Root mean square tilt (rad) of the filter that is optimal for delta_v, where the slosh is a delta_v. (50)"""
    return tilt_variance(optimal_cutoff(delta_n, delta_v, g), delta_n, a * delta_v, g) ** 0.5


def second_order_error(omega_g: Any, delta_n: Any, delta_v: Any, omega_c: Any, g: float = GRAVITY) -> Any:
    """Mean square error of (34) where velocity is band-limited: (43) over (41) with (15) in place of (16)."""
    b, c = omega_g, omega_c
    let_in = delta_v**2 * b**4 * c**2 / 4 * (c**2 / b / 2**0.5 + b / 2**0.5 - c) / (b**4 + c**4)
    return 3 * (g * delta_n) ** 2 / b / (4 * 2**0.5) + let_in


def first_order_error(cutoff: Any, delta_n: Any, delta_v: Any, omega_c: Any, g: float = GRAVITY) -> Any:
    """Mean square error of the first-order filter of section 4.2, with the constants that it leaves out.

    At cutoff = omega_g its ratio to (46) tends to sqrt(2) / 4 omega_c / omega_g for a large omega_c.
    """
    return (g * delta_n) ** 2 / (4 * cutoff) + delta_v**2 * cutoff**2 * omega_c**2 / (4 * (cutoff + omega_c))


def first_order_cutoff(delta_n: Any, delta_v: Any, omega_c: Any, g: float = GRAVITY) -> Any:
    """Cut-off (rad/s) of the least ``first_order_error``, for an omega_c far above it.

    The ratio to (46) is then 3 sqrt(2) / 8 (2 omega_c / omega_g)^(1/3), or 0.668 (omega_c / omega_g)^(1/3).
    """
    omega_g = optimal_cutoff(delta_n, delta_v, g)
    return omega_g * (omega_g / (2 * omega_c)) ** (1 / 3)


def settling_time(omega_g: float, part: float = SETTLED) -> float:
    """Time (s) after which an initial error stays below this part of itself. From (34)

    The error goes as exp(-x) (cos x + sin x), x = omega_g t / sqrt(2), with extremes exp(-k pi) at x = k pi: the last
    passage lies between the last extreme above ``part`` and the zero that follows it.
    """
    last = np.floor(-np.log(part) / np.pi) * np.pi
    low, high = last, last + 3 * np.pi / 4
    for _ in range(60):
        x = (low + high) / 2
        above = np.exp(-x) * abs(np.cos(x) + np.sin(x)) > part
        low, high = (x, high) if above else (low, x)
    return float(2**0.5 * high / omega_g)


def bias_tilt(omega_g: Any, bias: Any) -> Any:
    """Steady tilt (rad) that a gyroscope bias (rad/s) across the vertical leaves: (34) delays a ramp by this long."""
    return 2**0.5 * bias / omega_g


def gyro_noise_density_of(imu: str | Path) -> float:
    """Gyroscope noise density (rad/s/sqrt(Hz)) of a parameter set: a name in models/imus, or an .ssv file.

    Raises ValueError where there is no such device, DescriptionError where the file does not tell, or in another kind
    of unit.
    """
    folder = models_folder() / "imus"
    path = Path(imu) if Path(imu).suffix.lower() == ".ssv" else folder / f"{imu}.ssv"
    if not path.is_file():
        known = sorted(known.stem for known in folder.glob("*.ssv"))
        raise ValueError(no_such("device", str(imu), known, "or give an .ssv file"))
    values = [value for value in read_parameter_set(path) if value.name == "gyro_noise_density"]
    if not values:
        raise DescriptionError(f"{path}: sets no gyro_noise_density")
    try:
        return conversion(values[-1].unit, Unit("rad/s/sqrt(Hz)"))(float(values[-1].value))
    except ValueError as error:
        raise DescriptionError(f"{values[-1].where}: gyro_noise_density: {error}") from error


def predict(imu: str | Path | float, slosh: float, g: float = GRAVITY) -> Table:
    """What the optimal filter reaches with this gyroscope in this motion.

    imu: a parameter set, as for ``gyro_noise_density_of``, or the density in rad/s/sqrt(Hz). slosh: m/s/sqrt(Hz).
    Raises ValueError where a density is not positive or an IMU not known.
    """
    delta_n = float(imu) if isinstance(imu, (int, float)) else gyro_noise_density_of(imu)
    for name, density, unit in (("gyro noise density", delta_n, "rad/s/sqrt(Hz)"), ("slosh", slosh, "m/s/sqrt(Hz)")):
        if not 0 < density < np.inf:
            raise ValueError(f"{name} = {density:g} {unit}: expected a positive number")
    omega_g = optimal_cutoff(delta_n, slosh, g)
    rows: list[tuple[str, float]] = [
        ("gyroscope noise density (deg/s/sqrt(Hz))", np.rad2deg(delta_n)),
        ("slosh (m/s/sqrt(Hz))", slosh),
        ("optimal cut-off (rad/s)", omega_g),
        ("1 / cut-off (s)", 1 / omega_g),
        ("tilt, RMS (deg)", np.rad2deg(tilt_rms(delta_n, slosh, g=g))),
        ("tilt, RMS, with half the slosh (deg)", np.rad2deg(tilt_rms(delta_n, slosh, 0.5, g))),
        ("tilt, RMS, with twice the slosh (deg)", np.rad2deg(tilt_rms(delta_n, slosh, 2.0, g))),
        (f"settling time, to {SETTLED:.0%} of an initial error (s)", settling_time(omega_g)),
        ("tilt per 0.1 deg/s of gyroscope bias (deg)", bias_tilt(omega_g, 0.1)),
        ("tilt of the gyroscope alone after 60 s, RMS (deg)", np.rad2deg(gyro_drift_rms(delta_n, 60.0))),
    ]
    return Table(["", "value"], [[name, f"{value:.4g}"] for name, value in rows])
