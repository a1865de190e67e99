"""Claims about the error formulas of Rizun 2008."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from imufmu.scoring import prediction as p

G = 9.80665
DELTA_N, DELTA_V = math.radians(0.2), 1.0  # the third row of Table 1
OMEGA_G = p.optimal_cutoff(DELTA_N, DELTA_V, G)
OMEGA = np.linspace(-3, 3, 600)  # rad/s; 0 is not among them

# Table 1: delta_n (deg/s/sqrt(Hz)), delta_v (m/s/sqrt(Hz)); 1 / omega_g (s), RMS tilt (deg) at delta_v, half, twice it.
TABLE_1 = {
    (0.1, 1.0): (7.6, 0.33, 0.30, 0.44),
    (0.1, 2.0): (10.8, 0.39, 0.35, 0.52),
    (0.2, 1.0): (5.4, 0.55, 0.50, 0.73),
    (0.2, 2.0): (7.6, 0.66, 0.59, 0.87),
}


@pytest.mark.parametrize("densities", TABLE_1, ids=str)
def test_table_1_comes_out(densities: tuple[float, float]) -> None:
    """To the rounding of the print; the one entry off by more, 0.44, is 0.4349."""
    delta_n, delta_v = math.radians(densities[0]), densities[1]
    time_constant, *tilts = TABLE_1[densities]
    assert 1 / p.optimal_cutoff(delta_n, delta_v, G) == pytest.approx(time_constant, abs=0.05)
    for printed, a in zip(tilts, (1.0, 0.5, 2.0), strict=True):
        assert math.degrees(p.tilt_rms(delta_n, delta_v, a)) == pytest.approx(printed, abs=0.006)


def test_the_formulas_equal_those_printed() -> None:
    """(46), (49), (50) as they stand in the paper; rounding only."""
    assert p.slosh_error(DELTA_N, DELTA_V) == pytest.approx(
        G**1.5 * DELTA_N**1.5 * DELTA_V**0.5 / math.sqrt(2), rel=1e-14
    )
    for a in (0.5, 1.0, 2.0):
        tilt = (3 + a**2) / (2 * math.sqrt(2)) * DELTA_N**1.5 * DELTA_V**0.5 / G**0.5
        assert p.tilt_rms(DELTA_N, DELTA_V, a) ** 2 == pytest.approx(tilt, rel=1e-14)


def test_the_error_spectrum_of_the_optimal_filter_is_the_printed_one() -> None:
    general = p.error_spectrum(OMEGA, p.wiener_response(OMEGA, OMEGA_G), DELTA_N, DELTA_V)
    assert np.allclose(general, p.optimal_error_spectrum(OMEGA, DELTA_N, DELTA_V), rtol=1e-11, atol=0)  # 1 - H cancels
    at, value = p.error_spectrum_peak(DELTA_N, DELTA_V)
    assert p.optimal_error_spectrum(at, DELTA_N, DELTA_V) == pytest.approx(value, rel=1e-14)
    assert p.optimal_error_spectrum(OMEGA, DELTA_N, DELTA_V).max() <= value
    assert p.optimal_error_spectrum(0.0, DELTA_N, DELTA_V) == pytest.approx(G * DELTA_N * DELTA_V)


@pytest.mark.parametrize("a", [0.5, 1.0, 2.0])
def test_the_integral_of_the_spectrum_is_the_closed_form(a: float) -> None:
    def spectrum(omega: np.ndarray) -> np.ndarray:
        return p.error_spectrum(omega, p.wiener_response(omega, OMEGA_G), DELTA_N, a * DELTA_V)

    # A midpoint rule on a smooth periodic function: rounding.
    assert p.mean_square(spectrum, OMEGA_G) == pytest.approx(p.slosh_error(DELTA_N, DELTA_V, a), rel=1e-10)


@pytest.mark.parametrize("omega_c", [1.0, 10.0, 100.0])
def test_band_limited_errors_are_the_integrals_of_their_spectra(omega_c: float) -> None:
    for response, closed in (
        (p.wiener_response, p.second_order_error),
        (p.first_order_response, p.first_order_error),
    ):

        def spectrum(omega: np.ndarray, response=response) -> np.ndarray:
            return p.error_spectrum(omega, response(omega, OMEGA_G), DELTA_N, DELTA_V, omega_c=omega_c)

        assert p.mean_square(spectrum, OMEGA_G) == pytest.approx(closed(OMEGA_G, DELTA_N, DELTA_V, omega_c), rel=1e-9)


def test_the_optimal_cutoff_and_the_exact_response_cannot_be_beaten() -> None:
    """Detuned by 5 % (34) gets worse; (33) beats (34) where velocity is band-limited, and itself detuned."""
    best = p.slosh_error(DELTA_N, DELTA_V)
    for factor in (0.95, 1.05):
        assert p.mean_square_error(factor * OMEGA_G, DELTA_N, DELTA_V, G) > best * 1.001
    for omega_c in (0.3, 1.0, 10.0):

        def error(cutoff: float, zero: float, omega_c: float = omega_c) -> float:
            return p.mean_square(
                lambda w: p.error_spectrum(w, p.wiener_response(w, cutoff, zero), DELTA_N, DELTA_V, omega_c=omega_c),
                OMEGA_G,
            )

        exact = error(OMEGA_G, omega_c)
        assert exact < error(OMEGA_G, math.inf)
        assert exact < min(error(0.95 * OMEGA_G, omega_c), error(1.05 * OMEGA_G, omega_c))


def test_the_first_order_filter_is_worse_by_the_derived_constants() -> None:
    """sqrt(2)/4 r and 0.668 r^(1/3) for r = omega_c / omega_g: 35 and 3.1 at r = 100, to the first order left out."""
    for r, tolerance in ((100, 0.05), (1e6, 2e-4)):
        best, omega_c = p.slosh_error(DELTA_N, DELTA_V), r * OMEGA_G
        same = p.first_order_error(OMEGA_G, DELTA_N, DELTA_V, omega_c) / best
        own = p.first_order_cutoff(DELTA_N, DELTA_V, omega_c)
        optimal = p.first_order_error(own, DELTA_N, DELTA_V, omega_c) / best
        assert same == pytest.approx(math.sqrt(2) / 4 * r, rel=tolerance)
        assert optimal == pytest.approx(3 * math.sqrt(2) / 8 * (2 * r) ** (1 / 3), rel=tolerance)
        for factor in (0.8, 1.2):
            assert p.first_order_error(factor * own, DELTA_N, DELTA_V, omega_c) / best > optimal


@pytest.mark.parametrize("part", [0.5, 0.05, 0.01, 1e-4])
def test_an_initial_error_stays_below_its_part_from_the_settling_time_on(part: float) -> None:
    x = OMEGA_G * np.linspace(0, 200, 400_001) / math.sqrt(2)
    above = np.flatnonzero(np.abs(np.exp(-x) * (np.cos(x) + np.sin(x))) > part)
    assert p.settling_time(OMEGA_G, part) == pytest.approx(200 / 400_000 * (above[-1] + 0.5), abs=200 / 400_000)


def test_prediction_of_a_device_is_that_of_its_noise_density(tmp_path: Path) -> None:
    by_name, by_density = p.predict("mtx", 1.0), p.predict(math.radians(0.1), 1.0)
    assert by_name == by_density
    copy = tmp_path / "mine.ssv"
    source = p.models_folder() / "imus" / "mtx.ssv"
    copy.write_text(source.read_text().replace("0.001745329", "0.003490658"))
    assert p.predict(copy, 1.0) == p.predict(math.radians(0.2), 1.0)
    shown = {name: float(value) for name, value in by_name.rows}
    assert shown["1 / cut-off (s)"] == pytest.approx(7.6, abs=0.05)
    assert shown["tilt, RMS (deg)"] == pytest.approx(0.33, abs=0.005)


@pytest.mark.parametrize(
    ("imu", "slosh", "told"),
    [
        ("mtz", 1.0, "no device is called 'mtz'; there is .*did you mean mtx"),
        ("nowhere.ssv", 1.0, r"no device is called \'nowhere\.ssv\'"),
        (0.0, 1.0, "gyro noise density = 0 "),
        (0.001, -1.0, "slosh = -1 m/s"),
        (0.001, math.nan, "slosh = nan"),
    ],
)
def test_what_cannot_be_predicted_is_refused_by_name(imu: str | float, slosh: float, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        p.predict(imu, slosh)


def test_a_device_without_a_gyroscope_noise_is_refused(tmp_path: Path) -> None:
    text = (p.models_folder() / "imus" / "mtx.ssv").read_text()
    silent = tmp_path / "silent.ssv"
    silent.write_text(text.replace('name="gyro_noise_density"', 'name="gyro_bias[1]"'))
    with pytest.raises(ValueError, match=re.escape(f"{silent}: sets no gyro_noise_density")):
        p.predict(silent, 1.0)


def test_a_noise_in_degrees_is_converted_and_one_of_another_kind_refused(tmp_path: Path) -> None:
    text = (p.models_folder() / "imus" / "mtx.ssv").read_text()
    of_mtx = p.gyro_noise_density_of("mtx")
    value = f'value="{of_mtx!r}" unit="rad/s/sqrt(Hz)"'
    assert value in text
    other = tmp_path / "other.ssv"
    other.write_text(text.replace(value, f'value="{math.degrees(of_mtx)!r}" unit="deg/s/sqrt(Hz)"'))
    assert p.gyro_noise_density_of(other) == pytest.approx(of_mtx, rel=1e-12)  # a few roundings
    other.write_text(text.replace(value, 'value="1" unit="deg/s"'))
    with pytest.raises(ValueError, match=r"gyro_noise_density: deg/s and rad/s/sqrt\(Hz\) differ in kind"):
        p.gyro_noise_density_of(other)
