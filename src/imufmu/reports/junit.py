"""Verdicts as a JUnit XML file: what CI servers (Jenkins, GitLab, GitHub actions) read as test results."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from lxml import etree

from ..files.atomic import atomic_write
from ..scoring.checks import Check, Suite, limit_text, value_text

_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # characters XML 1.0 cannot hold


def write_junit(path: Path, verb: str, suites: Sequence[Suite]) -> None:
    """Write one case per check; a suite that broke off is one case with an error. verb: as ``check``.

    The checks of a suite share its seconds equally, as they come from the same runs. Raises WriteError.
    """
    root = etree.Element("testsuites", name=f"imufmu.{verb}")
    for suite in suites:
        root.append(_suite(f"imufmu.{verb}.{suite.name}", suite))
    for count in ("tests", "failures", "errors"):
        root.set(count, str(sum(int(suite.get(count)) for suite in root)))
    root.set("time", _seconds(sum(suite.seconds for suite in suites)))
    with atomic_write(path) as temporary:
        # Written by Python, as lxml tells a full disk by an error of its own.
        temporary.write_bytes(etree.tostring(root, encoding="UTF-8", xml_declaration=True, pretty_print=True))


def _suite(name: str, suite: Suite) -> etree._Element:
    cases = [_case(name, suite, check) for check in suite.checks] or [_broken_off(name, suite)]
    element = etree.Element(
        "testsuite",
        name=name,
        tests=str(len(cases)),
        failures=str(len(suite.failed)),
        errors="0" if suite.checks else "1",
        skipped="0",
        time=_seconds(suite.seconds),
    )
    element.extend(cases)
    if suite.remarks:
        _add(element, "system-out", "\n".join(suite.remarks))
    return element


def _case(name: str, suite: Suite, check: Check) -> etree._Element:
    case = _named(name, check.name, suite.seconds / len(suite.checks))
    found = f"{value_text(check)}, limit {limit_text(check)}" + (f", {check.where}" if check.where else "")
    if check.passed:
        _add(case, "system-out", found)
    else:
        _add(case, "failure", f"{check.name}: {found}\n{check.reason}", type="limit", message=found)
    return case


def _broken_off(name: str, suite: Suite) -> etree._Element:
    case = _named(name, "experiments run to their end", suite.seconds)
    trace = suite.error.strip() or "nothing was checked"
    _add(case, "error", trace, type="exception", message=trace.splitlines()[-1])
    return case


def _named(suite: str, name: str, seconds: float) -> etree._Element:
    case = etree.Element("testcase", classname=suite, time=_seconds(seconds))
    case.set("name", _NOT_XML.sub("?", name))
    return case


def _add(parent: etree._Element, tag: str, text: str, **attributes: str) -> None:
    child = etree.SubElement(parent, tag, {name: _NOT_XML.sub("?", value) for name, value in attributes.items()})
    child.text = _NOT_XML.sub("?", text)


def _seconds(value: float) -> str:
    return f"{value:.3f}"
