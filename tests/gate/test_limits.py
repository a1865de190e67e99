"""Limits files: what they say, and every fault told with line, column and what to do."""

from __future__ import annotations

import json
import re
from importlib.resources import files
from pathlib import Path

import pytest

from imufmu.gate.limits import LimitsError, components, read_limits, required
from support.places import ROOT

GOOD = """
system = "roundabout.ssd"
stop_time = "1 min"
seeds = 200
[parameters]
"imu.gyro_bias" = [0.0, 0.0, 0.01]

[[limit]]
name = "plumb holds the tilt"
reason = "the platform must stay level"
quantity = "plumb.tilt"
statistic = "rmse"
at_most = "2 deg"
from = "5 s"
to = 60
where = "plant.speed > 18 km/h"
runs = "95 %"
confidence = "99 %"

[[limit]]
always = "plumb.tilt < 3 deg"
when = "plant.speed > 5 m/s"

[[limit]]
eventually = "plumb.tilt < 0.5 deg"
within = "2000 ms"
after = "plant.speed == 0"

[[limit]]
quantity = "plumb.tilt"
statistic = "settling_time"
band = "1 deg"
at_most = "5 s"
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "roundabout.limits.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_limits_file_says_what_is_limited_when_and_how_often(tmp_path: Path) -> None:
    limits = read_limits(written(tmp_path, GOOD))
    assert (limits.system, limits.stop_time, limits.seeds) == ("roundabout.ssd", 60.0, 200)
    assert limits.parameters == {"imu.gyro_bias": [0.0, 0.0, 0.01]}
    first, second, third, fourth = limits.limits
    assert (first.name, first.statistic, str(first.at_most)) == ("plumb holds the tilt", "rmse", "2 deg")
    assert (first.window.begin, first.window.end) == (5.0, 60.0)
    assert (first.runs, first.confidence) == (0.95, 0.99)
    assert (second.kind, second.name) == ("always", "always plumb.tilt < 3 deg when plant.speed > 5 m/s")
    assert (third.kind, third.within) == ("eventually", 2.0)
    assert str(fourth.band) == "1 deg"
    assert components(limits.limits) == {"plumb", "plant"}


LIMIT = '[[limit]]\nquantity = "plumb.tilt"\nstatistic = "rmse"\nat_most = "2 deg"\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "has no [[limit]]"),
        ("limit = []", "line 1"),
        ("[[limit]\n", "not TOML"),
        ("seeds = 0\n" + LIMIT, "line 1, column 1: 0 is less than the minimum of 1"),
        ("sedes = 5\n" + LIMIT, "line 1, column 1: no key is called 'sedes'; did you mean seeds?"),
        (LIMIT + 'at_moost = "1 deg"\n', "line 5, column 1: no key is called 'at_moost'; did you mean at_most?"),
        (LIMIT + LIMIT.replace("rmse", "rms"), "line 7, column 1: 'rms' is not one of rmse, "),
        (LIMIT + LIMIT, "line 5, column 3: two limits are called"),
        ('[[limit]]\nquantity = "plumb.tilt"\nat_most = "2 deg"\n', "which statistic of 'plumb.tilt'?"),
        ('[[limit]]\nquantity = "plumb.tilt"\nstatistic = "max"\n', "give at_most, at_least or both"),
        ('[[limit]]\nname = "x"\n', "line 1, column 3: give one of quantity (with a statistic), always, eventually"),
        ('[[limit]]\nalways = "a.b < 1"\nquantity = "a.b"\n', "give one of quantity"),
        ('[[limit]]\nalways = "a.b < 1"\nat_most = 3\n', "at_most goes with quantity, not with always"),
        ('[[limit]]\nalways = "a.b <"\n', "line 2, column 1: 'a.b <' cannot be read"),
        ('[[limit]]\nalways = "a.b < 1"\nwithin = "1 s"\n', "within goes with eventually"),
        (LIMIT + 'when = "a.b > 1"\n', "when goes with always and eventually"),
        (LIMIT + 'from = "5 s"\nto = "4 s"\n', "the window ends at 4 s and begins at 5 s"),
        (LIMIT + 'from = "5 m"\n', "differ in kind"),
        (LIMIT + 'from = "soon"\n', "'soon' is no number with a unit"),
        (LIMIT + 'runs = "most"\n', "line 5, column 1: 'most' is no percentage"),
        (LIMIT + 'runs = "120 %"\n', "'120 %' is not between 0 and 100 %"),
        (LIMIT + 'confidence = "99 %"\n', "confidence goes with runs"),
        (LIMIT.replace("rmse", "nees"), "nees needs sigma"),
        (LIMIT + 'sigma = "plumb.tilt_std"\n', "sigma goes with nees"),
        (LIMIT.replace("rmse", "finite"), "finite has no bound"),
        ("stop_time = [1]\n" + LIMIT, "line 1, column 1"),
    ],
)
def test_a_fault_is_told_with_file_line_and_what_to_do(text: str, said: str, tmp_path: Path) -> None:
    path = written(tmp_path, text)
    with pytest.raises(LimitsError) as raised:
        read_limits(path)
    message = str(raised.value)
    assert message.startswith(str(path))
    assert said in message
    assert "\n" not in message


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.limits.toml"
    path.write_bytes(b"\xff\xfe\x00limits")
    with pytest.raises(LimitsError, match="not a text file"):
        read_limits(path)


@pytest.mark.parametrize(
    ("text", "kind", "statistic", "bound"),
    [
        ("plumb.tilt.max < 2 deg", "statistic", "max", "2 deg"),
        ("abs(plumb.roll - plant.roll).p95 <= 1.5e-1 rad", "statistic", "p95", "0.15 rad"),
        ("plumb.tilt < 2 deg", "always", "", "None"),
    ],
)
def test_a_limit_of_the_command_line_is_a_statistic_or_a_condition(
    text: str, kind: str, statistic: str, bound: str
) -> None:
    limit = required(text)
    assert (limit.kind, limit.statistic, str(limit.at_most)) == (kind, statistic, bound)


def test_at_least_is_written_with_the_other_sign() -> None:
    assert str(required("plant.speed.highest > 50 km/h").at_least) == "50 km/h"


def test_the_limits_file_of_the_documentation_is_one(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "gate.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    limits = read_limits(written(tmp_path, block)).limits
    assert [limit.kind for limit in limits] == ["statistic", "always", "eventually"]


def test_the_schema_for_editors_names_every_key_and_what_it_is() -> None:
    schema = json.loads(files("imufmu.gate").joinpath("limits.schema.json").read_text(encoding="utf-8"))
    keys = schema["$defs"]["limit"]["properties"]
    assert all(key in keys for key in re.findall(r"^(\w+) =", GOOD.partition("[[limit]]")[2], re.MULTILINE))
    assert all("description" in value or key in ("at_most", "at_least") for key, value in keys.items())
