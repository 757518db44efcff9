"""Print what each group of tests costs: items, processor time and seconds, the most costly first.

``make test`` leaves a report in build/fast-tests.xml, as pytest's option --junitxml does:

    python scripts/test_costs.py build/fast-tests.xml [MORE.xml ...] [--by file] [--top 30]

Fixtures are included, and in processor time the processes that a test has started and that have
ended. Seconds are the clock's: what workers did side by side counts for each.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal
from xml.etree import ElementTree as ET

import pandas as pd
import typer

By = Literal["folder", "file", "function", "item"]
PROCESSOR = "./properties/property[@name='processor']"


def read_reports(paths: list[Path]) -> pd.DataFrame:
    """Return the tests of JUnit XMLs that pytest has written: their groups and what they took."""
    tests = []
    for path in paths:
        for case in ET.parse(path).iterfind(".//testcase"):  # noqa: S314 - our own
            file = case.get("classname", "").replace(".", "/")
            item = f"{file}::{case.get('name')}"
            processor = case.find(PROCESSOR)
            test = {
                "folder": file.rpartition("/")[0],
                "file": file,
                "function": item.partition("[")[0],
                "item": item,
                "items": 1,
                "processor": 0.0 if processor is None else float(processor.get("value", "")),
                "seconds": float(case.get("time", "0")),
            }
            tests.append(test)
    return pd.DataFrame(tests)


def main(
    reports: list[Path],
    by: By = "file",
    top: Annotated[int, typer.Option(help="The number of groups.")] = 30,
) -> None:
    """Print a line for each of the most costly groups of tests, and one for all tests."""
    tests = read_reports(reports)
    costs = tests.groupby(by)[["items", "processor", "seconds"]].sum()
    shown = costs.nlargest(top, "processor")
    shown.loc["all"] = costs.sum()
    print(shown.reset_index(names="group").to_string(index=False, float_format="%.1f"))


if __name__ == "__main__":
    typer.run(main)
