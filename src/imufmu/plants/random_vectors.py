"""Random vectors over time, of a stated mean and largest length.

    s_j(t) = sqrt(2 / N) sum_i sin(2 pi f_ij t + phi_ij),  j = 1, 2, 3                (1)
    u(t)   = F(|s|),  F(r) = erf(r / sqrt 2) - sqrt(2 / pi) r exp(-r^2 / 2)           (2)
    x(t)   = m k u^(k - 1) s / |s|                                                    (3)

(1) is close to three independent normal variables of unit variance; F is the distribution of their length, so u is
evenly distributed over (0, 1) and the mean of u^(k - 1) is 1 / k. Hence x has the mean length m and never exceeds m k,
which it nears in any record that is long enough. The larger k, the rarer and sharper the peaks. Warping (3) adds
harmonics above the band of the f.

Line i of N has its frequency at a random place in the i-th of N equal parts of the band, so that even a short record
holds its share of every part; phases are even over the circle.
"""

from __future__ import annotations

from math import pi
from typing import Any

import casadi as ca

from ..blocks.rotations import norm, unit

LINES = 12  # sinusoids per axis
DRAWS = 2 * 3 * LINES  # standard normal draws behind one random vector

_SMALLEST = 1e-18  # of u: what F leaves of nothing, below the rounding of (2)


def evenly(normal: Any) -> Any:
    """Values even over (0, 1) from standard normal ones."""
    return (1 + ca.erf(normal / ca.sqrt(2))) / 2


def lines(normal: Any) -> tuple[Any, Any]:
    """Places in the band (0 to 1) and phases (rad) of all lines, both (3, LINES), from DRAWS standard normal draws."""
    draws = ca.reshape(evenly(normal), LINES, 6).T
    parts = ca.repmat(ca.SX(range(LINES)).T, 3, 1)
    return (parts + draws[:3, :]) / LINES, 2 * pi * draws[3:, :]


def sum_of_lines(t: Any, amplitude: Any, frequency: Any, phase: Any) -> Any:
    """Sum over the lines of each axis (3,); amplitude, frequency (Hz), phase (rad): (3, LINES) or scalar."""
    return ca.sum2(amplitude * ca.sin(2 * pi * frequency * t + phase))


def random_vector(t: Any, frequency: Any, phase: Any, mean: Any, peak_to_mean: Any) -> Any:
    """x(t) (3,) of (1) to (3); frequency, phase: (3, LINES), Hz and rad; mean: m, peak_to_mean: k > 1."""
    s = sum_of_lines(t, ca.sqrt(2 / LINES), frequency, phase)
    r = norm(s)
    u = ca.erf(r / ca.sqrt(2)) - ca.sqrt(2 / pi) * r * ca.exp(-(r**2) / 2)
    return mean * peak_to_mean * ca.fmax(u, _SMALLEST) ** (peak_to_mean - 1) * unit(s)
