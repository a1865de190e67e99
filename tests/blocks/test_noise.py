"""Claims about the seeded noise."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy import stats

from imufmu.blocks.noise import standard_normal, uniforms
from imufmu.blocks.rotations import over_rows

LIKELY = 1e-4  # smallest p value: seeded, so a test that passes once passes always; a broken generator gives 1e-30

# SplitMix64 with Python's whole numbers, inverse included.
_MODULUS = 2**64
_STRIDE, _FIRST, _SECOND = 0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB


def mix(z: int) -> int:
    z = (z ^ (z >> 30)) * _FIRST % _MODULUS
    z = (z ^ (z >> 27)) * _SECOND % _MODULUS
    return z ^ (z >> 31)


def unmix(z: int) -> int:
    def undo_shift(value: int, bits: int) -> int:
        found = value
        for _ in range(64 // bits):
            found = value ^ (found >> bits)
        return found

    z = undo_shift(z, 31) * pow(_SECOND, -1, _MODULUS) % _MODULUS
    z = undo_shift(z, 27) * pow(_FIRST, -1, _MODULUS) % _MODULUS
    return undo_shift(z, 30)


def hashed(seed: int, index: int) -> int:
    """The 64 bits behind draw number ``index`` of a seed."""
    return mix((mix((seed + _STRIDE) % _MODULUS) + (index + 1) * _STRIDE) % _MODULUS)


def place_of(bits: int, seed: int) -> int:
    """The index whose hash is ``bits``."""
    return ((unmix(bits) - mix((seed + _STRIDE) % _MODULUS)) * pow(_STRIDE, -1, _MODULUS) - 1) % _MODULUS


# The first 52 bits of the hash make the draw: (bits + 1/2) / 2^52. Any language can be checked against these.
PINNED = {
    (0, 0): 0xA706DD2F4D197,
    (1, 0): 0x5E41AB0874396,
    (1, 1): 0xF18D6CE93D6CF,
    (1, 17): 0xCC85689913EB5,
    (42, 10**9): 0xA4938C5330875,
    (2**31 - 1, 12345): 0x8E9FFFAC1FF9B,
}


@pytest.mark.parametrize(("seed", "index"), PINNED)
def test_draws_are_pinned_for_other_languages(seed: int, index: int) -> None:
    assert hashed(seed, index) >> 12 == PINNED[seed, index]
    assert uniforms(seed, index, 1, 1)[0, 0] == (PINNED[seed, index] + 0.5) / 2**52


def test_draws_are_the_hash_computed_with_whole_numbers() -> None:
    """Draw j of sample k has index k width + j."""
    draws = uniforms(7, 1000, 20, 3)
    expected = [[(hashed(7, k * 3 + j) >> 12) + 0.5 for j in range(3)] for k in range(1000, 1020)]
    assert np.array_equal(draws, np.array(expected) / 2**52)


@pytest.mark.parametrize(("first", "count"), [(0, 1), (0, 256), (255, 2), (256, 256), (999, 1)])
def test_any_window_gives_the_same_draws(first: int, count: int) -> None:
    assert np.array_equal(uniforms(3, first, count, 18), uniforms(3, 0, 1000, 18)[first : first + count])


@pytest.mark.parametrize("bits", [0, 2**64 - 1, 2**63, 2**63 - 1])
def test_the_interval_is_open_even_for_the_most_extreme_hashes(bits: int) -> None:
    seed = next(s for s in range(100) if place_of(bits, s) < 2**62)
    index = place_of(bits, seed)
    assert hashed(seed, index) == bits
    draw = uniforms(seed, index, 1, 1)
    assert 0.0 < draw[0, 0] < 1.0
    assert np.isfinite(over_rows(standard_normal, draw)).all()


def test_draws_of_no_width_are_empty() -> None:
    assert uniforms(1, 0, 5, 0).shape == (5, 0)


def test_uniforms_are_uniform() -> None:
    assert stats.kstest(uniforms(1, 0, 20_000, 1)[:, 0], "uniform").pvalue > LIKELY


def test_normals_are_standard_normal() -> None:
    w = over_rows(standard_normal, uniforms(1, 0, 20_000, 1))[:, 0]
    assert stats.kstest(w, "norm").pvalue > LIKELY


def test_seeds_draws_and_neighbouring_samples_are_independent() -> None:
    """Among 4 seeds with 4 draws each no pair correlates, at equal or neighbouring samples."""
    n = 20_000
    columns = np.hstack([over_rows(standard_normal, uniforms(seed, 0, n, 4)) for seed in (0, 1, 2, 2**31 - 1)])
    for lag in (0, 1, 2):
        correlation = columns[lag:].T @ columns[: n - lag] / n
        # 5 standard errors, 1 / sqrt(n) each; sqrt(2 / n) on the diagonal, which holds the variances.
        assert np.abs(correlation - (np.eye(16) if lag == 0 else 0)).max() < 5 * np.sqrt(2 / n)


def test_neighbouring_seeds_share_no_draws() -> None:
    draws = np.concatenate([uniforms(seed, 0, 10_000, 1)[:, 0] for seed in range(10)])
    assert len(np.unique(draws)) == len(draws)


def test_standard_normal_is_the_quantile_of_scipy() -> None:
    """From one end of the open interval to the other, across both joints of the approximation."""
    tail = 10.0 ** np.linspace(-15.9, np.log10(0.5), 2000)
    joints = np.concatenate([x + np.linspace(-1e-6, 1e-6, 11) for x in (0.075, np.exp(-25.0))])
    u = np.concatenate([tail, joints[joints > 0], 0.5 + np.linspace(-1e-3, 1e-3, 100), 1 - tail[tail > 1e-15], [0.5]])
    # Both are rational approximations, good to a few ulp (2.2e-16) each.
    np.testing.assert_allclose(over_rows(standard_normal, u)[:, 0], stats.norm.ppf(u), rtol=2e-15, atol=0)


def test_standard_normal_is_odd_and_increases() -> None:
    u = np.sort(np.concatenate([uniforms(5, 0, 2000, 1)[:, 0], np.linspace(0.0749, 0.0751, 100)]))
    w = over_rows(standard_normal, u)[:, 0]
    assert np.all(np.diff(w) > 0)
    # 1 - u is exact for the multiples of 2^-53 that draws are.
    exact = uniforms(5, 0, 2000, 1)
    assert np.array_equal(over_rows(standard_normal, 1 - exact), -over_rows(standard_normal, exact))


def test_standard_normal_works_on_vectors() -> None:
    w = ca.Function("w", [], [standard_normal(ca.SX([0.1, 0.5, 0.9]))])()
    assert np.allclose(np.array(w["o0"]).ravel(), [-1.2815515655446004, 0, 1.2815515655446004], rtol=1e-15, atol=0)
