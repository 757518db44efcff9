"""Print what each group of tests costs: items and seconds, the most costly group first.

``make test`` leaves a report in build/fast-tests.xml, as pytest's option --junitxml does:

    python scripts/test_costs.py build/fast-tests.xml [MORE.xml ...] [--by file] [--top 30]

Seconds of the clock, fixtures included; what two workers did side by side counts for both.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from pathlib import Path
from typing import Literal, NamedTuple
from xml.etree import ElementTree as ET

By = Literal["folder", "file", "function", "item", "marker"]
GROUPS: tuple[By, ...] = ("folder", "file", "function", "item", "marker")
DEFAULT_TOP = 30


class TimedTest(NamedTuple):
    """One test of a report.

    Attributes:
        file: the file in which it stands, without suffix, such as ``tests/judging/test_judge``.
        name: its name with its parameters.
        markers: names of its markers, separated by spaces.
        seconds: how long it took, fixtures included.
    """

    file: str
    name: str
    markers: str
    seconds: float

    def group(self, by: By) -> str:
        """Return the group to which it belongs."""
        function = self.name.partition("[")[0]
        groups: dict[By, str] = {
            "folder": self.file.rpartition("/")[0],
            "file": self.file,
            "function": f"{self.file}::{function}",
            "item": f"{self.file}::{self.name}",
            "marker": self.markers or "(none)",
        }
        return groups[by]


def read_report(path: Path) -> list[TimedTest]:
    """Return the tests of a JUnit XML that pytest has written."""
    return [
        TimedTest(
            case.get("classname", "").replace(".", "/"),
            case.get("name", ""),
            next((one.get("value", "") for one in case.iterfind("./properties/property")), ""),
            float(case.get("time", "0")),
        )
        for case in ET.parse(path).iterfind(".//testcase")  # noqa: S314 - our own
    ]


def table(tests: list[TimedTest], by: By, top: int) -> str:
    """Return a line for each of the most costly groups, and one for all tests."""
    groups: dict[str, list[float]] = defaultdict(list)
    for test in tests:
        groups[test.group(by)].append(test.seconds)
    costly = sorted(groups.items(), key=lambda entry: sum(entry[1]), reverse=True)
    rows = [*costly[:top], ("all", [test.seconds for test in tests])]
    return "\n".join(
        ["  items  seconds  group"]
        + [f"{len(seconds):7} {sum(seconds):8.1f}  {name}" for name, seconds in rows]
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("reports", type=Path, nargs="+", metavar="XML")
    parser.add_argument("--by", choices=GROUPS, default="file", help="default: %(default)s")
    parser.add_argument(
        "--top", type=int, default=DEFAULT_TOP, help="the number of groups; default: %(default)s"
    )
    options = parser.parse_args()
    tests = [test for path in options.reports for test in read_report(path)]
    print(table(tests, options.by, options.top))


if __name__ == "__main__":
    main()
