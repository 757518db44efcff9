"""Measure the floors of every setting and task, and write them where they are read.

python scripts/measure_floors.py [--scenes 400]

Writes the file of the installed version of the language, with the settings that count for the
headline number, and the tables of docs/floors.md. With --tables only the tables, from that file.
Tasks without words are left out.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from written_parts import with_part

from roboirg.analysis.measures import measured_floors as stored
from roboirg.analysis.measures.measured_floors import FloorKey, Floors
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.plain_text import counted
from roboirg.language.settings import all_settings
from roboirg.language.word_sampler import LANGUAGE_VERSION
from roboirg.shortcuts import SURFACE_RULES
from roboirg.shortcuts.goal_learner import InstructedEpisode
from roboirg.shortcuts.shortcut_scores import counted_slots
from roboirg.shortcuts.shortcut_tables import (
    LEARNING_SCENES,
    MARGIN,
    Group,
    ShortcutRow,
    excess_text,
    score_texts,
    tabulate,
)
from roboirg.tasks import all_tasks
from roboirg.util.csv_text import csv_lines

PAGE = Path(__file__).parent.parent / "docs" / "floors.md"
SCENES = 400
"""Random scenes of each task that are tested."""


def measure(tasks: Sequence[str], scenes: int, learning: int) -> list[ShortcutRow]:
    """Return the rows of all settings of some tasks, on random scenes and on the test split."""

    def groups_of(told: InstructedEpisode) -> Iterator[tuple[Group, Sequence[str]]]:
        episode, instruction = told
        slots, split, setting = counted_slots(told), episode.split, instruction.setting
        if slots:
            yield FloorKey(split, setting), slots
            yield FloorKey(split, setting, episode.task), slots
        for slot in slots:
            yield FloorKey(split, setting, episode.task, slot), (slot,)

    names = tuple(name for name, one in all_settings().items() if one.implicit)
    scored = score_texts(
        tasks, ("test",), names, InstructionOptions(), seeds=scenes, learning=learning
    )
    rows = tabulate(scored, groups_of)
    places = {name: place for place, name in enumerate(names)}
    return sorted(rows, key=lambda row: (row.group[0], places[row.group[1]], bool(row.group[2])))


def file_text(rows: Sequence[ShortcutRow]) -> str:
    """Return the rows as a file that `measured_floors` reads."""
    heads = (*FloorKey._fields, "texts", *stored.NAMES, *(f"{one} goals" for one in stored.NAMES))
    lines: list[tuple[object, ...]] = [(*heads, "excess", "error")]
    for row in rows:
        shares = dict(row.shares)
        best = max(SURFACE_RULES, key=lambda name: shares[name].slots or 0)
        shares["rules"] = shares[best]
        numbers = [
            *(shares[name].slots for name in stored.NAMES),
            *(shares[name].goals for name in stored.NAMES),
            *(row.excess or ()),
        ]
        lines.append((*row.group, row.count, *(f"{number:.4f}" for number in numbers)))
    return csv_lines(lines)


def tables(floors: Floors) -> str:
    """Return the tables of the documentation."""
    return "\n\n".join((_by_setting(floors), _by_task(floors), _claims(floors)))


def _by_setting(floors: Floors) -> str:
    keys = [key for key in floors if key == FloorKey(stored.RANDOM, key.setting)]
    lines = [
        (
            f"Language version {LANGUAGE_VERSION}, percent of the slots that count, on random "
            "scenes (in brackets: on the test split), all tasks together:"
        ),
        "",
        f"| setting | texts | {' | '.join(stored.NAMES)} | text-only over chance |",
        f"| --- | ---: |{' ---: |' * (len(stored.NAMES) + 1)}",
    ]
    for key in keys:
        one, test = floors[key], floors[key._replace(split=stored.TEST)]
        cells = (f"{_percent(one, name)} ({_percent(test, name)})" for name in stored.NAMES)
        excess = excess_text(one.excess, len(keys))
        lines.append(f"| `{key.setting}` | {one.count:,} | {' | '.join(cells)} | {excess} |")
    note = (
        "Over chance: points above the larger of chance and majority, with 95 % intervals, "
        f"Bonferroni-adjusted for {counted(len(keys), 'row')}."
    )
    return "\n".join([*lines, "", note])


def _by_task(floors: Floors) -> str:
    settings = list(dict.fromkeys(key.setting for key in floors))
    lines = [
        "Text-only by task, on random scenes, with the larger of chance and majority in brackets:",
        "",
        f"| task | {' | '.join(f'`{name}`' for name in settings)} |",
        f"| --- |{' ---: |' * len(settings)}",
    ]
    for task in all_tasks():
        cells = []
        for setting in settings:
            one = floors.get(FloorKey(stored.RANDOM, setting, task))
            if one is None:
                cells.append("–")
                continue
            least = max(("chance", "majority"), key=lambda name: one.shares[name].slots or 0)
            cells.append(f"{_percent(one, 'text-only')} ({_percent(one, least)})")
        lines.append(f"| {task} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _percent(row: ShortcutRow, name: str) -> str:
    return f"{100 * (row.shares[name].slots or 0):.0f}"


def _claims(floors: Floors) -> str:
    """Return which settings count for the headline, and in how many slots they exceed chance."""
    counting = stored.settings_at_chance(floors)
    names = ", ".join(f"`{name}`" for name in counting)
    tested = {key: one for key, one in floors.items() if key.slot and key.setting in counting}
    above = []
    for key, one in tested.items():
        if one.excess and one.excess.interval(len(tested))[0] > MARGIN:
            where = f"{key.task} {key.slot} in `{key.setting}`, {key.split}"
            above.append(f"{where}: {excess_text(one.excess, len(tested))}")
    listed = f": {'; '.join(above)}" if above else ""
    exceed = f"{len(above) or 'none'} {'exceeds' if len(above) < 2 else 'exceed'}"  # noqa: PLR2004
    return (
        f"Words alone are at most {100 * MARGIN:.0f} points above chance in "
        f"{names or 'no setting'}, over all tasks. After Bonferroni adjustment for the "
        f"{counted(len(tested), 'slot')} of their tasks, on random scenes and on the test split, "
        f"{exceed} this threshold{listed}."
    )


def page_text() -> str:
    """Return the page with the tables of the stored floors."""
    floors = stored.measured_floors(LANGUAGE_VERSION) or {}
    return with_part(PAGE.read_text(encoding="utf-8"), "floors", tables(floors))


def main() -> None:
    """Measure, and write both files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=SCENES)
    parser.add_argument("--learning", type=int, default=LEARNING_SCENES)
    parser.add_argument("--tables", action="store_true")
    given = parser.parse_args()
    if not given.tables:
        begin = time.perf_counter()
        rows = measure(tuple(all_tasks()), given.scenes, given.learning)
        file = Path(stored.__file__).with_name(stored.floors_name(LANGUAGE_VERSION))
        file.write_text(file_text(rows), encoding="utf-8")
        stored.measured_floors.cache_clear()
        print(f"{file}: {len(rows)} lines in {time.perf_counter() - begin:.0f} s")
    PAGE.write_text(page_text(), encoding="utf-8")


if __name__ == "__main__":
    main()
