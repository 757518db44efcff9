"""The floors that were measured for a version of the language, and what follows from them.

``scripts/measure_floors.py`` writes a file of them, named with the version: a line for each
setting, for each of its tasks, and for each slot of a task, on random scenes and on the test split.
"""

from __future__ import annotations

import csv
import functools
from collections.abc import Iterable, Mapping
from importlib import resources
from typing import NamedTuple

from roboirg.shortcuts.shortcut_shares import MARGIN, Excess, ShortcutRow, ShortcutShares

RANDOM = "random"
TEST = "test"
"""What floors were measured on: random scenes, or the test split."""
NAMES = ("chance", "majority", "rules", "text-only", "scene-only", "union")
"""The floors; of the rules the best."""
LEARNED = NAMES[3:]


class FloorKey(NamedTuple):
    """What a line is about; task and slot are empty for all of them."""

    split: str
    setting: str
    task: str = ""
    slot: str = ""


Floors = Mapping[FloorKey, ShortcutRow]


def floors_name(version: str) -> str:
    """Return the name of the file of a version of the language."""
    return f"floors-{version}.csv"


@functools.cache
def measured_floors(version: str) -> Floors | None:
    """Return the floors of a version of the language; None if they were not measured."""
    file = resources.files(__package__).joinpath(floors_name(version))
    if not file.is_file():
        return None
    return read_floors(file.read_text(encoding="utf-8"))


def read_floors(text: str) -> Floors:
    """Return the floors of a file: for each setting, task or slot how often guessing is right.

    Args:
        text: comma-separated, with the shares of a goal's single values (in ``chance``,
            ``text-only``, …) and of whole goals (in ``chance goals``, …) that each learner or rule
            gets right, 0 to 1.
    """
    floors = {}
    for line in csv.DictReader(text.splitlines()):
        key = FloorKey(line["split"], line["setting"], line["task"], line["slot"])
        shares = {}
        for name in NAMES:
            shares[name] = ShortcutShares(float(line[name]), float(line[f"{name} goals"]))
        excess = Excess(float(line["excess"]), float(line["error"]))
        floors[key] = ShortcutRow(key, int(line["texts"]), shares, excess)
    return floors


def unmeasured_note(floors: Iterable[str], languages: Iterable[str]) -> str:
    """Return a sentence on learned floors that were not measured; empty if there are none.

    A learned floor is the success of a learner that sees the words or the scene alone. It is
    measured apart for each version of the benchmark's language.

    Args:
        floors: the names of those that are asked for.
        languages: the versions of the language that were played.
    """
    learned = [floor for floor in floors if floor in LEARNED]
    played = filter(None, languages)  # the version is empty for episodes that were not played
    missing = {language for language in played if measured_floors(language) is None}
    if not learned or not missing:
        return ""
    return (
        f"No learned floors ({', '.join(learned)}) were measured for language version "
        f"{', '.join(sorted(missing))}."
    )


def settings_at_chance(floors: Floors) -> tuple[str, ...]:
    """Return the settings whose words alone do not give away the goal.

    In these a learner that sees only the words was at most `MARGIN` better than guessing, on random
    scenes.
    """
    settings = []
    for key, row in floors.items():
        is_whole_setting = key == FloorKey(RANDOM, key.setting)  # not of one task or slot
        if is_whole_setting and row.excess and row.excess.value <= MARGIN:
            settings.append(key.setting)
    return tuple(settings)
