"""The numbers of an experiment in tables and sentences of pages."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
from written_parts import table, with_part

from experiment.measures import MEAN, OVER, SHARE
from roboirg.analysis.measures.measure import ALL_TASKS
from roboirg.stats.rates import NOT_APPLICABLE, points, whole_percent

PAGES = ("README.md", "docs/results.md")
"""Those that show numbers, if they are in the folder around the results."""
NUMBERS = "numbers.csv"
FACTS = "facts.json"
SETTINGS = ("explicit", "direct", "reasoning", "contextual", "spatial")
ORDER = {
    "memory": ["none", "ttt", "framesamp", "subgoal", "keyframes", "recurrent"],
    "reader": ["published", "explicit", "resolve-surface", "all", "truth"],
    "setting": [*SETTINGS, MEAN],
    "number": [],
}
"""What comes first in tables; other values follow as they come."""


class Part(NamedTuple):
    """A table of a page, for all tasks and, behind its name, for each suite; a row is a policy.

    Attributes:
        shown: which numbers, a query of pandas.
        columns: what its columns are named by.
    """

    shown: str
    columns: str = "setting"


_POLICY = ["memory", "reader"]
PARTS = {
    "results": Part(
        "number == 'success' and setting in @SETTINGS and reader in ('explicit', 'all', '–')"
    ),
    "paper": Part(
        "number == 'success' and setting in @SETTINGS and reader in ('published', 'explicit')"
    ),
    "rates": Part("number == 'success' and reader != 'published' and ~setting.str.endswith(')')"),
    "forms": Part("number == 'success' and setting.str.endswith(')')"),
    "shares": Part("number == @SHARE"),
    "differences": Part("number.str.startswith('success over') and setting == @MEAN", "number"),
    "gap": Part(
        "number.str.endswith('over explicit words') and setting == @MEAN and reader != 'truth'",
        "number",
    ),
}
"""By name of the part: ``results`` of all tasks, ``results counting`` of a suite."""


def write_pages(results: Path) -> None:
    """Write the numbers of a folder of results into `PAGES`."""
    numbers = read_numbers(results / NUMBERS)
    facts = json.loads((results / FACTS).read_text(encoding="utf-8"))
    for name in PAGES:
        path = results.resolve().parent / name
        if path.exists():
            page = path.read_text(encoding="utf-8")
            path.write_text(with_numbers(page, numbers, facts), encoding="utf-8")


def read_numbers(path: Path) -> pd.DataFrame:
    """Return numbers, `Measure` by `Measure`, in the order of tables.

    A column is new: `text`, what pages show.
    """
    numbers = pd.read_csv(path)
    numbers["text"] = [_text(line) for line in numbers.to_dict("records")]
    for name, first in ORDER.items():
        numbers[name] = pd.Categorical(numbers[name], dict.fromkeys([*first, *numbers[name]]))
    return numbers.sort_values(list(ORDER), kind="stable")


def _text(line: Mapping[str, Any]) -> str:
    """Return a rate as ``78<br>74–82``, in percent; a difference as ``−3<br>−8 to +2``, in points.

    The interval has a line of its own, so that tables are narrow.
    """
    show: Callable[[float], str] = whole_percent
    between = "–"
    if OVER in line["number"]:
        show = points
    if OVER in line["number"] or line["number"] == SHARE:
        between = " to "
    text = show(line["value"])
    if not pd.isna(line["low"]):
        text += f"<br>{show(line['low'])}{between}{show(line['high'])}"
    return text.replace("-", "−")


def with_numbers(page: str, numbers: pd.DataFrame, facts: Mapping[str, str]) -> str:
    """Return a page with its tables written and its slots filled.

    A slot is ``<!-- counting, recurrent, all, direct, success -->78<!-- -->``: scope, memory,
    reader, setting and number of a `Measure`; it shows no interval.

    Raises:
        KeyError: there is no number for a slot.
    """
    for name in re.findall("<!-- end of ([^<>]+) -->", page):
        page = with_part(page, name, _table(name, numbers, facts))
    texts = {}
    for scope, memory, reader, setting, number, *_, text in numbers.itertuples(index=False):
        texts[f"{scope}, {memory}, {reader}, {setting}, {number}"] = text.split("<br>")[0]
    slot = r"(<!-- (\w[^<>]+,[^<>]+) -->)[^<]*(?=<!-- -->)"
    return re.sub(slot, lambda found: found[1] + texts[found[2]], page)


def _table(name: str, numbers: pd.DataFrame, facts: Mapping[str, str]) -> str:
    """Return the table that is the part of a name."""
    if name == "facts":
        return table(["what", "how much"], facts.items())
    kind, _, suite = name.partition(" ")
    part = PARTS[kind]
    scope = suite or ALL_TASKS
    shown = numbers[numbers["scope"] == scope].query(part.shown)
    wide = shown.pivot(index=_POLICY, columns=part.columns, values="text")
    wide = wide.sort_index().fillna(NOT_APPLICABLE)
    cells = wide.reset_index().to_numpy().tolist()
    return table([*_POLICY, *wide.columns], cells, wide.columns)
