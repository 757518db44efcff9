"""Print what each group of tests costs: items, processor time and seconds, the most costly first.

``make test`` leaves a report in build/fast-tests.xml, as pytest's option --junitxml does:

    python scripts/test_costs.py build/fast-tests.xml [MORE.xml ...] [--by file] [--top 30]

Fixtures are included, and in processor time the processes that a test has started and that have
ended. Seconds are the clock's: what workers did side by side counts for each.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from pathlib import Path
from typing import Literal, NamedTuple
from xml.etree import ElementTree as ET

By = Literal["folder", "file", "function", "item"]
GROUPS: tuple[By, ...] = ("folder", "file", "function", "item")
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
        function = self.name.partition("[")[0]
        groups: dict[By, str] = {
            "folder": self.file.rpartition("/")[0],
            "file": self.file,
            "function": f"{self.file}::{function}",
            "item": f"{self.file}::{self.name}",
        }
        return groups[by]


def read_report(path: Path) -> list[TimedTest]:
    """Return the tests of a JUnit XML that pytest has written."""
    return [
        TimedTest(
            case.get("classname", "").replace(".", "/"),
            case.get("name", ""),
            float(next((one.get("value", "") for one in case.iterfind(PROCESSOR)), "0")),
            float(case.get("time", "0")),
        )
        for case in ET.parse(path).iterfind(".//testcase")  # noqa: S314 - our own
    ]


def table(tests: list[TimedTest], by: By, top: int) -> str:
    """Return a line for each of the most costly groups, and one for all tests."""
    groups: dict[str, list[TimedTest]] = defaultdict(list)
    for test in tests:
        groups[test.group(by)].append(test)
    costs = [
        (sum(one.processor_s for one in group), sum(one.seconds for one in group), len(group), name)
        for name, group in [*groups.items(), ("all", tests)]
    ]
    rows = [*sorted(costs[:-1], reverse=True)[:top], costs[-1]]
    return "\n".join(
        ["  items  processor  seconds  group"]
        + [
            f"{items:7} {spent:10.1f} {seconds:8.1f}  {name}"
            for spent, seconds, items, name in rows
        ]
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("reports", type=Path, nargs="+", metavar="XML")
    parser.add_argument("--by", choices=GROUPS, default="file", help="default: %(default)s")
    parser.add_argument(
        "--top", type=int, default=30, help="the number of groups; default: %(default)s"
    )
    options = parser.parse_args()
    tests = [test for path in options.reports for test in read_report(path)]
    print(table(tests, options.by, options.top))


if __name__ == "__main__":
    main()
