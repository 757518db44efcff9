"""Print what each group of tests costs: items, processor time and seconds, the most costly first.

``make test`` leaves a report in build/fast-tests.xml, as pytest's option --junitxml does:

    python scripts/test_costs.py build/fast-tests.xml [MORE.xml ...] [--by file] [--top 30]

Fixtures are included, and in processor time the processes that a test has started and that have
ended. Seconds are the clock's: what workers did side by side counts for each.
"""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Annotated, Literal, NamedTuple
from xml.etree import ElementTree as ET

import typer

By = Literal["folder", "file", "function", "item"]
PROCESSOR = "./properties/property[@name='processor']"


class TimedTest(NamedTuple):
    """One test of a report.

    Attributes:
        file: the file in which it stands, without suffix, such as ``tests/judging/test_judge``.
        name: its name with its parameters.
        processor_s: the processor time that it took.
        seconds: how long it took.
    """

    file: str
    name: str
    processor_s: float
    seconds: float

    def group(self, by: By) -> str:
        """Return the group to which it belongs."""
        if by == "folder":
            return self.file.rpartition("/")[0]
        if by == "file":
            return self.file
        if by == "function":
            return f"{self.file}::{self.name.partition('[')[0]}"
        return f"{self.file}::{self.name}"


def read_report(path: Path) -> list[TimedTest]:
    """Return the tests of a JUnit XML that pytest has written."""
    tests = []
    for case in ET.parse(path).iterfind(".//testcase"):  # noqa: S314 - our own
        file = case.get("classname", "").replace(".", "/")
        processor = case.find(PROCESSOR)
        processor_s = 0.0
        if processor is not None:
            processor_s = float(processor.get("value", ""))
        seconds = float(case.get("time", "0"))
        tests.append(TimedTest(file, case.get("name", ""), processor_s, seconds))
    return tests


def table(tests: list[TimedTest], by: By, top: int) -> str:
    """Return a line for each of the most costly groups, and one for all tests."""
    groups: dict[str, list[TimedTest]] = defaultdict(list)
    for test in tests:
        groups[test.group(by)].append(test)
    rows = sorted((_row(name, group) for name, group in groups.items()), reverse=True)
    lines = ["  items  processor  seconds  group"]
    for spent, seconds, items, name in [*rows[:top], _row("all", tests)]:
        lines.append(f"{items:7} {spent:10.1f} {seconds:8.1f}  {name}")
    return "\n".join(lines)


def _row(name: str, tests: list[TimedTest]) -> tuple[float, float, int, str]:
    """Return the processor time and the seconds of some tests, their number, and their name."""
    processor_s = sum(test.processor_s for test in tests)
    seconds = sum(test.seconds for test in tests)
    return processor_s, seconds, len(tests), name


def main(
    reports: list[Path],
    by: By = "file",
    top: Annotated[int, typer.Option(help="The number of groups.")] = 30,
) -> None:
    """Print the table of the tests in some reports."""
    tests = []
    for path in reports:
        tests += read_report(path)
    print(table(tests, by, top))


if __name__ == "__main__":
    typer.run(main)
