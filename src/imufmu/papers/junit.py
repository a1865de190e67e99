"""Verdicts as a JUnit XML file: what CI servers (Jenkins, GitLab, GitHub actions) read as test results."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from lxml import etree

from ..files.atomic import atomic_write
from .experiment import Check
from .validate import Verdict
from .verdicts import limit_text, value_text

_SUITE = "imufmu.validate"
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # characters XML 1.0 cannot hold


def write_junit(path: Path, verdicts: Sequence[Verdict]) -> None:
    """Write one suite per paper and one case per check; a paper that broke off is one case with an error.

    The checks of a paper share its seconds equally, as they come from the same runs. Raises WriteError.
    """
    root = etree.Element("testsuites", name=_SUITE)
    for verdict in verdicts:
        root.append(_suite(verdict))
    for count in ("tests", "failures", "errors"):
        root.set(count, str(sum(int(suite.get(count)) for suite in root)))
    root.set("time", _seconds(sum(verdict.seconds for verdict in verdicts)))
    with atomic_write(path) as temporary:
        # Written by Python, as lxml tells a full disk by an error of its own.
        temporary.write_bytes(etree.tostring(root, encoding="UTF-8", xml_declaration=True, pretty_print=True))


def _suite(verdict: Verdict) -> etree._Element:
    cases = [_case(verdict, check) for check in verdict.checks] or [_broken_off(verdict)]
    suite = etree.Element(
        "testsuite",
        name=f"{_SUITE}.{verdict.name}",
        tests=str(len(cases)),
        failures=str(len(verdict.failed)),
        errors="0" if verdict.checks else "1",
        skipped="0",
        time=_seconds(verdict.seconds),
    )
    suite.extend(cases)
    if verdict.remarks:
        _add(suite, "system-out", "\n".join(verdict.remarks))
    return suite


def _case(verdict: Verdict, check: Check) -> etree._Element:
    case = _named(verdict, check.name, verdict.seconds / len(verdict.checks))
    found = f"{value_text(check)}, limit {limit_text(check)}"
    if check.passed:
        _add(case, "system-out", found)
    else:
        _add(case, "failure", f"{check.name}: {found}\n{check.reason}", type="limit", message=found)
    return case


def _broken_off(verdict: Verdict) -> etree._Element:
    case = _named(verdict, "experiments run to their end", verdict.seconds)
    trace = verdict.error.strip() or "nothing was checked"
    _add(case, "error", trace, type="exception", message=trace.splitlines()[-1])
    return case


def _named(verdict: Verdict, name: str, seconds: float) -> etree._Element:
    case = etree.Element("testcase", classname=f"{_SUITE}.{verdict.name}", time=_seconds(seconds))
    case.set("name", _NOT_XML.sub("?", name))
    return case


def _add(parent: etree._Element, tag: str, text: str, **attributes: str) -> None:
    child = etree.SubElement(parent, tag, {name: _NOT_XML.sub("?", value) for name, value in attributes.items()})
    child.text = _NOT_XML.sub("?", text)


def _seconds(value: float) -> str:
    return f"{value:.3f}"
