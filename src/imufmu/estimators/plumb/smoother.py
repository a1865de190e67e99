"""A record of ``plumb`` smoothed: what came later tells how far the attitude was off.

After Rauch, Tung and Striebel [1], from the last block to the first, with the errors of ``block_end``: F of (5), P- and
P before and after the measurements, e what they corrected. s and Sigma are error and covariance by the whole record, of
the attitude that the filter had after a block:

    A = P F' (P-(next))^-1,   s = A (e(next) + s(next)),   Sigma = P + A (Sigma(next) - P-(next)) A'      (30)

Within a block psi goes in a straight line from s to e + s of its end.

While the vertical was not known (``start``) and where it was found anew, no covariance leads back. There the attitude
is handed back through the gyroscope, with psi as large as it may be, w what (5) says of its errors, and Q of (6):

    exp([psi]) = exp([w]) exp([psi(next)]),   w = S db - S dD theta / H,   Sigma = Sigma(next) + ... + Q   (31)

until it agrees, within AGREES standard deviations, with what the filter knew before it was lost - then both together
are what is known - or until the filter was at rest.

Sigma takes the velocity for white noise. That of a hand or a car is not, and its errors last over several blocks. So

    tilt_std^2 = min(filter's, WIDER (Sigma_xx + Sigma_yy) + UNTOLD (filter's - P_xx - P_yy))          (32)

with the filter's tilt_std^2, where it has an attitude, of which the second part is (28) and (29).

[1] Rauch, Tung, Striebel, Maximum likelihood estimates of linear dynamic systems, AIAA Journal 3(8), 1965,
    doi:10.2514/3.3166
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...blocks.expressions import shaped
from ...blocks.rotations import TINY, over_rows
from .covariance import N_ERRORS, PSI, B, D, V, transition

AGREES = 3.0
WIDER, UNTOLD = 2.0, 0.25
TILT = slice(0, 2)

Records = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Smoothed:
    """psi (rad) by the whole record and its covariance (rad2), where blocks end.

    before, after: (m, 3), of the attitude before the measurements, and after. P: (m, 3, 3).
    """

    before: np.ndarray
    after: np.ndarray
    P: np.ndarray


@dataclass
class _Known:
    """s and Sigma; ``handed``: only psi, and by (31)."""

    s: np.ndarray
    P: np.ndarray
    handed: bool = False


def smoothed(records: Records) -> Smoothed:
    """records: ``RECORD`` of ``record`` with P, coarse and resting, a row per block; the first is the start."""
    m = len(records["coarse"])
    blocks = dict(records) | {name: whole(records[name]) for name in ("P", "P_before")}
    blocks["F"] = over_rows(
        lambda S, dV, rate: transition(shaped(S, (3, 3)), dV, rate),
        *(records[name] for name in ("S_block", "dV_block", "rate_block")),
    ).reshape(m, N_ERRORS, N_ERRORS)
    result = Smoothed(np.zeros((m, 3)), np.zeros((m, 3)), np.zeros((m, 3, 3)))
    known = _Known(np.zeros(N_ERRORS), blocks["P"][-1])
    for k in range(m - 1, -1, -1):
        result.after[k], result.P[k] = known.s[PSI], known.P[PSI, PSI]
        if k:
            result.before[k], known = one_block_back(known, {name: rows[k] for name, rows in blocks.items()}, blocks, k)
    return result


def one_block_back(known: _Known, block: Records, blocks: Records, k: int) -> tuple[np.ndarray, _Known]:
    """psi before the measurements of block k, and what is known at the end of block k - 1."""
    psi = composed(known.s[PSI], block["phi"] if block["anew"] else block["error"][PSI])
    P = blocks["P"][k - 1]
    if not (block["anew"] or known.handed):
        error = known.s + block["error"]
        error[PSI] = psi
        A = np.linalg.solve(block["P_before"], block["kept"][:, None] * (block["F"] @ P)).T
        return psi, _Known(A @ error, P + A @ (known.P - block["P_before"]) @ A.T)  # (30)
    handed = handed_back(known, block, psi, P)
    had_attitude = not (blocks["anew"][k - 1] and blocks["coarse"][k - 1])
    return psi, met(handed, P, blocks["resting"][k - 1]) if had_attitude else handed


def handed_back(known: _Known, block: Records, psi: np.ndarray, P: np.ndarray) -> _Known:
    """What is known one block earlier through the gyroscope; psi: at the end of the block. P: of the filter then."""
    turned = np.zeros((3, N_ERRORS))
    turned[:, PSI] = np.eye(3)
    R = matrix(psi)
    of_rate = -R @ block["F"][PSI]
    turned[:, B], turned[:, D] = of_rate[:, B], of_rate[:, D]
    s = known.s.copy()
    s[PSI], s[V] = near(composed(turned[:, B] @ s[B] + turned[:, D] @ s[D], psi), psi), 0  # (31)
    Sigma = np.zeros_like(P)
    rest = [*range(N_ERRORS)[B], *range(N_ERRORS)[D]]
    Sigma[np.ix_(rest, rest)] = known.P[np.ix_(rest, rest)]
    Sigma[PSI, :] = turned @ known.P
    Sigma[PSI, V] = 0
    Sigma[:, PSI] = Sigma[PSI, :].T
    Sigma[PSI, PSI] = turned @ known.P @ turned.T + R @ block["Q_turn"].reshape(3, 3) @ R.T  # (31)
    Sigma[V, V] = P[V, V]
    return _Known(s, Sigma, True)


def met(handed: _Known, P: np.ndarray, resting: float) -> _Known:
    """What was handed back, with what the filter knew then, of covariance P, where they agree."""
    both = P[TILT, TILT] + handed.P[TILT, TILT]
    lean = handed.s[TILT]
    if lean @ np.linalg.solve(both, lean) < AGREES**2:
        gain = np.linalg.solve(both, P[TILT, :]).T
        return _Known(gain @ lean, P - gain @ P[TILT, :])
    return _Known(np.zeros(N_ERRORS), P) if resting else handed


def tilt_std(filters: np.ndarray, P: np.ndarray, Sigma: np.ndarray, coarse: np.ndarray) -> np.ndarray:
    """(32), rad. All (n,): the filter's, P_xx + P_yy, Sigma_xx + Sigma_yy, 1 where it has no attitude."""
    untold = np.where(coarse > 0, 0.0, np.maximum(filters**2 - P, 0.0))
    return np.minimum(filters, np.sqrt(WIDER * np.maximum(Sigma, 0.0) + UNTOLD * untold))


def along(before: np.ndarray, after: np.ndarray, ends: np.ndarray, n: int) -> np.ndarray:
    """Rows (n, k) of what is linear within a block: from ``after`` one end (m, k) to ``before`` the next.

    ends: (m,), the row that each block ends with. What stands before the first end is as at that, and behind the last.
    """
    rows = np.arange(n)
    later = np.clip(np.searchsorted(ends, rows), 0, len(ends) - 1)
    earlier = np.maximum(later - 1, 0)
    share = np.clip((rows - ends[earlier]) / np.maximum(ends[later] - ends[earlier], 1), 0, 1)[:, None]
    result = (1 - share) * after[earlier] + share * before[later]
    at_end = ends[later] <= rows
    result[at_end] = after[later[at_end]]
    result[rows < ends[0]] = after[0]
    return result


def whole(triangles: np.ndarray) -> np.ndarray:
    """Symmetric matrices (m, 18, 18) of their upper triangles, row by row."""
    P, (i, j) = np.empty((len(triangles), N_ERRORS, N_ERRORS)), np.triu_indices(N_ERRORS)
    P[:, i, j] = P[:, j, i] = triangles
    return P


def composed(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Rotation vector (rad) of exp([a]) exp([b])."""
    (p, u), (q, v) = map(_quaternion, (a, b))
    w, xyz = p * q - u @ v, p * v + q * u + np.cross(u, v)
    sine = np.linalg.norm(xyz)
    if w < 0:
        w, xyz = -w, -xyz
    return 2 * xyz if sine < TINY else 2 * np.arctan2(sine, w) / sine * xyz


def near(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The rotation vector of the rotation a that is next to b: after half a turn, one by more."""
    length = float(np.linalg.norm(a))
    other = a - 2 * np.pi / max(length, TINY) * a
    return other if np.linalg.norm(other - b) < np.linalg.norm(a - b) else a


def _quaternion(a: np.ndarray) -> tuple[float, np.ndarray]:
    half = np.linalg.norm(a) / 2
    return np.cos(half), 0.5 * np.sinc(half / np.pi) * a


def matrix(a: np.ndarray) -> np.ndarray:
    """exp([a])."""
    w, u = _quaternion(a)
    cross = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross
