"""What a plant tells of its attitude in its own words, and the truth of a run that follows from it.

A description names the variables in an annotation of its default experiment; at the end of a run they become columns of
a component ``truth``, as a plant of imufmu has them: vertical, roll, pitch, and yaw and q_NS where they are known.

    <ssc:Annotation type="org.imufmu.truth">
      <imufmu:Truth>
        <imufmu:Quantity name="quaternion" form="xyzw to-world">
          <imufmu:Variable name="plant.q[0]" factor="1"/> ...
        </imufmu:Quantity>
      </imufmu:Truth>
    </ssc:Annotation>
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..blocks.columns import element_names

COMPONENT = "truth"
PLANT = "plant"  # the component that tells it, where connect has named it
ORDERS = ("wxyz", "xyzw")
DIRECTIONS = ("to-world", "to-body")  # of what a quaternion or matrix does to components of a vector
NAMESPACE = "urn:imufmu:ssp"

# Size and SI unit of what can be told, the best source of an attitude first.
QUANTITIES = {
    "quaternion": (4, "1"),
    "matrix": (9, "1"),
    "vertical": (3, "1"),
    "roll": (1, "rad"),
    "pitch": (1, "rad"),
    "yaw": (1, "rad"),
    "external_acceleration": (3, "m/s2"),
    "position": (3, "m"),
    "specific_force": (3, "m/s2"),  # to see whether the attitude can be right
}
_PASSED_ON = ("external_acceleration", "position")
_FAR = 30.0  # deg; a motion that leans the mean specific force that far off the vertical is rare
_CONTRADICTS = 0.1  # deg
_SHORT = 0.01  # of a quaternion's length


@dataclass(frozen=True)
class Told:
    """One of QUANTITIES. variables: ``component.variable`` of its elements, in our order; a matrix row by row.

    factors: of each element, to SI units. form: of a quaternion its order and direction, of a matrix its direction.
    """

    quantity: str
    variables: tuple[str, ...]
    factors: tuple[float, ...]
    form: str = ""

    def values(self, columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """(n, size) in SI units."""
        return np.column_stack([columns[name] for name in self.variables]) * np.array(self.factors)


def read_truth(root: Any) -> tuple[Told, ...]:
    """What the annotation of a description (lxml) names. Raises ValueError for one that cannot be."""
    told = []
    for quantity in root.iterfind(f".//{{{NAMESPACE}}}Truth/{{{NAMESPACE}}}Quantity"):
        elements = quantity.findall(f"{{{NAMESPACE}}}Variable")
        name, form = quantity.get("name", ""), quantity.get("form", "")
        size = QUANTITIES.get(name, (0, ""))[0]
        if size != len(elements) or not _is_form(name, form):
            raise ValueError(f"line {quantity.sourceline}: Truth: {name!r} of {len(elements)} variables, form {form!r}")
        factors = tuple(float(element.get("factor", 1)) for element in elements)
        told.append(Told(name, tuple(element.get("name", "") for element in elements), factors, form))
    return tuple(told)


def _is_form(quantity: str, form: str) -> bool:
    parts = form.split()
    if quantity == "quaternion":
        return len(parts) == 2 and parts[0] in ORDERS and parts[1] in DIRECTIONS
    return form in DIRECTIONS if quantity == "matrix" else not form


def derived_names(told: Iterable[Told]) -> list[str]:
    """Columns that follow, as ``derive`` returns them."""
    found = {one.quantity for one in told}
    signals = {"vertical": (3,), "roll": (), "pitch": ()} if knows_attitude(found) else {}
    if found & {"quaternion", "matrix"} or (signals and {"roll", "pitch", "yaw"} <= found):
        signals |= {"yaw": (), "q_NS": (4,)}
    signals |= {name: (3,) for name in _PASSED_ON if name in found and signals}
    return [f"{COMPONENT}.{element}" for name, shape in signals.items() for element in element_names(name, shape)]


def knows_attitude(quantities: Iterable[str]) -> bool:
    """Whether a vertical follows from these."""
    found = set(quantities)
    return bool(found & {"quaternion", "matrix", "vertical"}) or {"roll", "pitch"} <= found


def derive(
    told: Sequence[Told], columns: Mapping[str, np.ndarray]
) -> tuple[dict[str, np.ndarray], dict[str, str | None], list[str]]:
    """Columns of the truth, their units, and notes, from the columns of a run."""
    given = {one.quantity: one.values(columns) for one in told}
    forms = {one.quantity: one.form.split() for one in told}
    names, notes = derived_names(told), []
    if not names or not len(next(iter(given.values()))):
        return {name: np.empty(0) for name in names}, {name: _unit(name) for name in names}, []
    turns = None  # R_NS, (n, 3, 3)
    if "quaternion" in given:
        turns, off = _of_quaternion(given["quaternion"], *forms["quaternion"])
        if off > _SHORT:
            notes.append(
                f"{COMPONENT}: the quaternion's length differs from 1 by up to {off:.2g}; its direction is used"
            )
    elif "matrix" in given:
        turns = given["matrix"].reshape(-1, 3, 3)
        turns = turns if forms["matrix"] == ["to-world"] else turns.transpose(0, 2, 1)
    elif {"roll", "pitch", "yaw"} <= given.keys():
        turns = _of_angles(*(given[name][:, 0] for name in ("roll", "pitch", "yaw")))
    if turns is not None:
        vertical = turns[:, 2, :]
    elif "vertical" in given:
        vertical = given["vertical"] / np.linalg.norm(given["vertical"], axis=1, keepdims=True)
    else:
        vertical = _of_angles(given["roll"][:, 0], given["pitch"][:, 0], np.zeros(len(given["roll"])))[:, 2, :]
    if "vertical" in given and turns is not None:
        notes += _contradiction(vertical, given["vertical"])
    values = {"vertical": vertical, "roll": np.arctan2(vertical[:, 1], vertical[:, 2])}
    values["pitch"] = np.arctan2(-vertical[:, 0], np.hypot(vertical[:, 1], vertical[:, 2]))
    if turns is not None:
        values["yaw"] = np.arctan2(turns[:, 1, 0], turns[:, 0, 0])
        values["q_NS"] = _quaternions(turns)
    values |= {name: given[name] for name in _PASSED_ON if name in given}
    if "specific_force" in given:
        notes += _far_off(vertical, given["specific_force"])
    flat = {
        f"{COMPONENT}.{element}": np.ascontiguousarray(part)
        for name, array in values.items()
        for element, part in zip(element_names(name, array.shape[1:]), array.reshape(len(array), -1).T, strict=True)
    }
    return flat, {name: _unit(name) for name in flat}, notes


def _unit(name: str) -> str:
    signal = name.removeprefix(f"{COMPONENT}.").split("[")[0]
    return QUANTITIES.get(signal, (4, "1"))[1]


def _far_off(vertical: np.ndarray, force: np.ndarray) -> list[str]:
    """Over a run the specific force points up in the mean: a note where it does not."""
    along = np.mean(np.sum(vertical * force, axis=1)) / max(np.mean(np.linalg.norm(force, axis=1)), 1e-300)
    angle = np.rad2deg(np.arccos(np.clip(along, -1.0, 1.0)))
    if not angle > _FAR:
        return []
    return [
        f"{COMPONENT}: in the mean the vertical lies {angle:.0f} deg off the specific force: is the attitude given the "
        "other way round, or in another order? Does the force contain gravity, +9.8 on the axis that points up?"
    ]


def _contradiction(turned: np.ndarray, told: np.ndarray) -> list[str]:
    """A plant that tells its attitude twice should tell the same."""
    cosine = np.sum(turned * told, axis=1) / np.linalg.norm(told, axis=1)
    apart = np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0)).max())
    if not apart > _CONTRADICTS:
        return []
    return [
        f"{COMPONENT}: the attitude and the vertical of the plant are up to {apart:.3g} deg apart; the attitude counts"
    ]


def _of_quaternion(q: np.ndarray, order: str, direction: str) -> tuple[np.ndarray, float]:
    """R_NS (n, 3, 3) of quaternions (n, 4), and by how much their lengths differ from 1 at most."""
    length = np.linalg.norm(q, axis=1, keepdims=True)
    w, x, y, z = (q / np.where(length > 0, length, np.nan)).T[[0, 1, 2, 3] if order == "wxyz" else [3, 0, 1, 2]]
    if direction == "to-body":
        x, y, z = -x, -y, -z
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.array(rows).transpose(2, 0, 1), float(np.abs(length - 1).max())


def _of_angles(roll: np.ndarray, pitch: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """R_NS (n, 3, 3) of Z-Y-X angles (rad)."""
    (cr, cp, cy), (sr, sp, sy) = ([f(a) for a in (roll, pitch, yaw)] for f in (np.cos, np.sin))
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.array(rows).transpose(2, 0, 1)


def _quaternions(turns: np.ndarray) -> np.ndarray:
    """q_NS (n, 4), scalar first and not negative, of R_NS (n, 3, 3): from its largest element."""
    diagonal = np.einsum("nii->ni", turns)
    trace = diagonal.sum(axis=1)
    # Four times q q^T, of which the row with the largest diagonal element is the quaternion times a positive number.
    table = np.empty((len(turns), 4, 4))
    table[:, 0, 0] = 1 + trace
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        table[:, i + 1, i + 1] = 1 + 2 * diagonal[:, i] - trace
        table[:, 0, i + 1] = table[:, i + 1, 0] = turns[:, k, j] - turns[:, j, k]
        table[:, j + 1, k + 1] = table[:, k + 1, j + 1] = turns[:, j, k] + turns[:, k, j]
    best = np.einsum("nii->ni", table).argmax(axis=1)
    q = table[np.arange(len(turns)), best]
    return q / np.linalg.norm(q, axis=1, keepdims=True) * np.where(q[:, :1] < 0, -1.0, 1.0)
