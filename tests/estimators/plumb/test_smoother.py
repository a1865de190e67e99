"""Claims about the smoother of plumb: its equations, and what it does where the filter was wrong."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from imufmu.blocks.expressions import namespace
from imufmu.compiled.offline import run_offline
from imufmu.compiled.running import run
from imufmu.estimators.plumb import covariance
from imufmu.estimators.plumb.smoother import along, composed, matrix, smoothed
from support.motions import angle
from support.plumb_motions import BLOCK, G, carried, consumer, rms, smooth
from support.plumb_reference import cross_matrix

N = 18


def transition_of(S: np.ndarray, dV: np.ndarray, rate: np.ndarray) -> np.ndarray:
    F = np.eye(N)
    F[:3, 6:9], F[3:6, :3] = -S, -cross_matrix(dV)
    F[:3, 9:] = np.hstack([np.outer(S[:, i], rate) for i in range(3)])
    return F


def test_the_prediction_written_out_is_that_by_the_transition_matrix() -> None:
    rng = np.random.default_rng(0)
    root, S, dV, rate, H = rng.normal(0, 0.01, (N, N)), rng.normal(size=(3, 3)), *rng.normal(size=(2, 3)), 0.07
    x = namespace(BLOCK.state, ca.SX.zeros(sum(state.size for state in BLOCK.state)))
    x.q, x.dV, x.theta = ca.SX([1, 0, 0, 0]), ca.SX(dV), ca.SX(rate * H)
    p = namespace(BLOCK.own_parameters, ca.DM(BLOCK.start_vector(BLOCK.own_parameters)))
    p.s_m = 0  # no sample is missing
    P, _ = covariance.predicted(ca.SX(root @ root.T), ca.SX(S), x, H, p)
    F, noise = transition_of(S, dV, rate), ca.DM(ca.diag(P)).full().ravel()
    expected = F @ root @ root.T @ F.T
    noise = noise - np.diag(expected)
    for name, part, density in (("s_a", slice(3, 6), p.s_a), ("s_b", slice(6, 9), p.s_b)):
        assert np.allclose(noise[part], float(density) ** 2 * H, rtol=1e-9), name
    off_diagonal = ~np.eye(N, dtype=bool)
    off_diagonal[:3, :3] = False  # noise of the rate
    assert np.allclose(ca.DM(P).full()[off_diagonal], expected[off_diagonal], rtol=0, atol=1e-15)
    assert np.allclose(ca.DM(covariance.transition(ca.DM(S), ca.DM(dV), ca.DM(rate))).full(), F, rtol=0, atol=1e-15)


def test_it_is_the_best_linear_estimate_by_all_measurements_at_once() -> None:
    """Seven blocks of a linear model, by the filter and back, against one solution for all errors of all blocks."""
    rng, m, r = np.random.default_rng(1), 7, 1e-7
    parts = [(rng.normal(0, 0.1, (3, 3)), *rng.normal(0, 0.5, (2, 3))) for _ in range(m)]
    F = [transition_of(*part) for part in parts]
    Q = np.diag([1e-14] * 3 + [1e-13] * 3 + [1e-15] * 3 + [0.0] * 9)
    H, y = np.eye(N)[3:6], rng.normal(0, 1e-6, (m, 3))
    P = 1e-12 * np.diag(rng.uniform(1, 2, N))
    rows, P0, total = {name: [] for name in ("P", "P_before", "error")}, P, np.zeros(N)
    filtered = []
    for k in range(m):
        before = F[k] @ P @ F[k].T + Q if k else P
        total = F[k] @ total if k else total
        gain = before @ H.T @ np.linalg.inv(before[3:6, 3:6] + r**2 * np.eye(3))
        error = gain @ (y[k] - total[3:6])
        P, total = before - gain @ H @ before, total + error
        P = (P + P.T) / 2
        filtered.append(total)
        for name, value in (("P", P), ("P_before", before), ("error", error)):
            rows[name].append(value[np.triu_indices(N)] if value.ndim == 2 else value)
    records = {name: np.array(values) for name, values in rows.items()}
    records |= {name: np.array([part[i].ravel() for part in parts]) for i, name in enumerate(("S_block", "dV_block"))}
    records |= {"rate_block": np.array([part[2] for part in parts]), "kept": np.ones((m, N))}
    nothing = np.zeros(m)
    records |= {
        "anew": nothing,
        "coarse": nothing,
        "resting": nothing,
        "phi": np.zeros((m, 3)),
        "Q_turn": np.zeros((m, 9)),
    }
    result = smoothed(records)

    joint = np.zeros((m * N, m * N))
    for i in range(m):
        C = P0 if i == 0 else F[i] @ joint[(i - 1) * N : i * N, (i - 1) * N : i * N] @ F[i].T + Q
        for j in range(i, m):
            joint[i * N : (i + 1) * N, j * N : (j + 1) * N] = C.T
            joint[j * N : (j + 1) * N, i * N : (i + 1) * N] = C
            C = F[j + 1] @ C if j + 1 < m else C
    sees = np.kron(np.eye(m), H)
    gain = joint @ sees.T @ np.linalg.inv(sees @ joint @ sees.T + r**2 * np.eye(3 * m))
    mean, left = (gain @ y.ravel()).reshape(m, N), joint - gain @ sees @ joint
    # Psi of 1e-6 rad: what rotations do not add up to is of second order, 1e-12.
    assert np.allclose(result.after, (mean - np.array(filtered))[:, :3], rtol=0, atol=1e-11)
    for k in range(m):
        assert np.allclose(result.P[k], left[k * N : k * N + 3, k * N : k * N + 3], rtol=1e-6, atol=1e-20)


def test_rotation_vectors_are_composed_as_their_rotations() -> None:
    for a, b in np.random.default_rng(2).uniform(-2, 2, (50, 2, 3)):
        assert np.allclose(matrix(composed(a, b)), matrix(a) @ matrix(b), rtol=0, atol=1e-12)
    assert np.allclose(composed(np.zeros(3), np.zeros(3)), 0)


def test_within_a_block_it_goes_in_a_straight_line() -> None:
    before, after = np.array([[0.0], [2.0], [6.0]]), np.array([[1.0], [4.0], [7.0]])
    rows = along(before, after, np.array([1, 3, 6]), 8).ravel()
    assert np.allclose(rows, [1, 1, 1.5, 4, 4 + 2 / 3, 4 + 4 / 3, 7, 7])


def turned_with_a_gap() -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Rest, a turn of 90 deg of which a tenth of a second is lost, rest: what is left, and where up was."""
    t = np.arange(0, 40, 0.01)
    motion = carried(t, roll=np.radians(90) * smooth(t, 20, 1.2))
    kept = np.delete(np.arange(len(t)), slice(2055, 2065))
    return {name: rows[kept] for name, rows in consumer(motion).items()}, motion.vertical[kept]


def test_a_wrong_attitude_is_mended_back_to_where_it_went_wrong() -> None:
    """The filter was 13 deg off for two seconds. Where in the turn it went wrong is unknown, but not in the rest."""
    readings, vertical = turned_with_a_gap()
    settings = {"sample_period": 0.01, "g": G}
    causal, whole = run(BLOCK, readings, settings), run_offline(BLOCK, readings, settings)
    errors = [np.rad2deg(angle(result["vertical"], vertical)) for result in (causal, whole)]
    assert errors[0].max() > 8
    assert errors[1][:2000].max() < 0.5 and errors[1][2130:].max() < 0.5
    assert rms(errors[1]) < 0.5 * rms(errors[0])


@pytest.mark.parametrize("first", [(0.0, 0.0, -9.8), (9.8, 0.0, 0.0)])
def test_a_wrong_first_sample_does_not_matter(first: tuple[float, float, float]) -> None:
    t = np.arange(0, 20, 0.01)
    motion = carried(t, roll=0.4 * np.sin(t))
    readings = consumer(motion)
    readings["accel"][0] = first
    whole = run_offline(BLOCK, readings, {"sample_period": 0.01, "g": G})
    assert np.rad2deg(angle(whole["vertical"], motion.vertical)).max() < 1
