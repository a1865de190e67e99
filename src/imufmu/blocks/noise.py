"""Seeded standard normal draws that every backend reproduces.

Draw j of sample k is a pure function of (seed, k, j). The whole-number part (a SplitMix64 hash, Steele, Lea, Flood,
OOPSLA 2014, doi:10.1145/2660193.2660195) is exact in any language; the map from uniform to normal is a CasADi
expression that becomes part of the block's step, so there is one copy of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

_STRIDE = np.uint64(0x9E3779B97F4A7C15)


def _mix(z: np.ndarray) -> np.ndarray:
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def uniforms(seed: int, first: int, count: int, width: int) -> np.ndarray:
    """Uniform draws in the open interval (0, 1).

    seed: whole number >= 0. first: index of the first sample. Returns (count, width): row i belongs to sample
    first + i, whatever the other arguments are.
    """
    index = np.arange(first * width, (first + count) * width, dtype=np.uint64)
    with np.errstate(over="ignore"):  # arithmetic modulo 2^64 is meant
        stream = _mix(np.array([seed], dtype=np.uint64) + _STRIDE)
        z = _mix(stream + (index + np.uint64(1)) * _STRIDE)
    # 52 bits and a half: exact in a double, so neither 0 nor 1 is ever reached.
    return ((z >> np.uint64(12)).astype(float) + 0.5).reshape(count, width) * 2.0**-52


def draws(streams: Sequence[tuple[float, int]], first: int, count: int) -> np.ndarray:
    """Uniform draws of independent streams side by side, (count, sum of widths); streams: seed and width of each."""
    parts = [uniforms(int(seed), first, count, width) for seed, width in streams]
    return np.hstack(parts) if parts else np.zeros((count, 0))


# Rational approximations of the normal quantile, M. J. Wichura, Algorithm AS 241 (PPND16), Applied Statistics 37(3),
# 1988, doi:10.2307/2347330; relative accuracy about 1e-16. Numerator and denominator, lowest power first.
_CENTRE = (
    (3.3871328727963666080e0, 1.3314166789178437745e2, 1.9715909503065514427e3, 1.3731693765509461125e4,
     4.5921953931549871457e4, 6.7265770927008700853e4, 3.3430575583588128105e4, 2.5090809287301226727e3),
    (1.0, 4.2313330701600911252e1, 6.8718700749205790830e2, 5.3941960214247511077e3,
     2.1213794301586595867e4, 3.9307895800092710610e4, 2.8729085735721942674e4, 5.2264952788528545610e3),
)  # fmt: skip
_MIDDLE = (
    (1.42343711074968357734e0, 4.63033784615654529590e0, 5.76949722146069140550e0, 3.64784832476320460504e0,
     1.27045825245236838258e0, 2.41780725177450611770e-1, 2.27238449892691845833e-2, 7.74545014278341407640e-4),
    (1.0, 2.05319162663775882187e0, 1.67638483018380384940e0, 6.89767334985100004550e-1,
     1.48103976427480074590e-1, 1.51986665636164571966e-2, 5.47593808499534494600e-4, 1.05075007164441684324e-9),
)  # fmt: skip
_TAIL = (
    (6.65790464350110377720e0, 5.46378491116411436990e0, 1.78482653991729133580e0, 2.96560571828504891230e-1,
     2.65321895265761230930e-2, 1.24266094738807843860e-3, 2.71155556874348757815e-5, 2.01033439929228813265e-7),
    (1.0, 5.99832206555887937690e-1, 1.36929880922735805310e-1, 1.48753612908506148525e-2,
     7.86869131145613259100e-4, 1.84631831751005468180e-5, 1.42151175831644588870e-7, 2.04426310338993978564e-15),
)  # fmt: skip


def _ratio(coefficients: tuple[tuple[float, ...], tuple[float, ...]], r: Any) -> Any:
    def polynomial(powers: tuple[float, ...]) -> Any:
        value = powers[-1]
        for coefficient in reversed(powers[:-1]):
            value = value * r + coefficient
        return value

    numerator, denominator = coefficients
    return polynomial(numerator) / polynomial(denominator)


def standard_normal(uniform: Any) -> Any:
    """Standard normal quantile of ``uniform`` (n,), each element in (0, 1)."""
    q = uniform - 0.5
    centre = q * _ratio(_CENTRE, 0.180625 - q * q)
    r = ca.sqrt(-ca.log(ca.fmin(uniform, 1.0 - uniform)))
    outer = ca.if_else(r <= 5.0, _ratio(_MIDDLE, r - 1.6), _ratio(_TAIL, r - 5.0))
    return ca.if_else(ca.fabs(q) <= 0.425, centre, ca.sign(q) * outer)
