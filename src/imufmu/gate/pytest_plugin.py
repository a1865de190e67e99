"""Limits files as tests of pytest: ``pytest models/`` collects every ``*.limits.toml``, one test per limit.

All limits of a file are judged by the same runs, made when the first of them is asked for.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from .verdict import Outcome

_SUFFIX = ".limits.toml"  # written here, too: the plugin is loaded by every pytest, and reads nothing until it must


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Limits files."""
    return LimitsFile.from_parent(parent, path=file_path) if file_path.name.endswith(_SUFFIX) else None


class LimitsFile(pytest.File):
    """One limits file."""

    def collect(self) -> Iterator[pytest.Item]:
        """A test per limit."""
        from .request import requested

        try:
            self._plan, self._limits, self._seeds = requested(str(self.path), None, (), None)
        except (ValueError, OSError) as error:
            raise self.CollectError(str(error)) from None
        for place, limit in enumerate(self._limits):
            yield LimitItem.from_parent(self, name=limit.name, place=place)

    @cached_property
    def outcome(self) -> Outcome:
        """The verdict on all limits."""
        from .verdict import check_system

        return check_system(self._plan, self._limits, self._seeds, jobs=1)


class LimitItem(pytest.Item):
    """One limit."""

    parent: LimitsFile

    def __init__(self, *, place: int, **keywords: object) -> None:
        super().__init__(**keywords)  # type: ignore[arg-type]
        self._place = place

    def runtest(self) -> None:
        """Fails where the limit is broken."""
        from ..scoring.checks import limit_text, value_text

        try:
            check = self.parent.outcome.checks[self._place]
        except (ValueError, OSError) as error:
            pytest.fail(str(error), pytrace=False)
        found = f"{value_text(check)}, limit {limit_text(check)}" + (f", {check.where}" if check.where else "")
        self.add_report_section("call", "limit", found)
        if not check.passed:
            pytest.fail(f"{check.name}: {found}\n{check.reason}".strip(), pytrace=False)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Where it stands."""
        return self.path, None, self.name
