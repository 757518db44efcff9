"""Measure the floors of every setting and task, and write them where they are read.

python scripts/measure_floors.py [--scenes 400]

Writes the file of the installed version of the language, with the settings that count for the
headline number, and the tables of docs/controls.md. With --tables only the tables, from that file.
Tasks without words are left out.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import typer
from written_parts import table, with_part

from roboirg.analysis.measures import measured_floors as stored
from roboirg.analysis.measures.measured_floors import FloorKey, Floors
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.plain_text import counted
from roboirg.language.settings import all_settings
from roboirg.language.word_sampler import LANGUAGE_VERSION
from roboirg.shortcuts.goal_learner import InstructedEpisode
from roboirg.shortcuts.shortcut_scores import counted_slots
from roboirg.shortcuts.shortcut_shares import MARGIN, Group, ShortcutRow
from roboirg.shortcuts.shortcut_tables import (
    LEARNING_SCENES,
    excess_text,
    score_texts,
    tabulate,
)
from roboirg.shortcuts.surface_rules import SURFACE_RULES
from roboirg.tasks import all_tasks
from roboirg.util.csv_text import csv_lines

PAGE = Path(__file__).parent.parent / "docs" / "controls.md"
SCENES = 400
"""Random scenes of each task that are tested."""

_BY_SETTING = """\
Language version {version}, percent of slots (parts of the goal, such as `color`) that are right, \
on random scenes (in brackets: on the test split), all tasks together. The slots count that have \
to be seen; if there are none, those that the command leaves out.

{table}

Over chance: points above the larger of chance and majority, with 95 % intervals, \
Bonferroni-adjusted for {rows}."""

_BY_TASK = """\
Text-only by task, on random scenes, with the larger of chance and majority in brackets:

{table}"""


def measure(tasks: Sequence[str], scenes: int, learning: int) -> list[ShortcutRow]:
    """Return the rows of all settings of some tasks, on random scenes and on the test split."""

    def groups_of(told: InstructedEpisode) -> Iterator[tuple[Group, Sequence[str]]]:
        episode, instruction = told
        slots = counted_slots(told)
        whole = FloorKey(episode.split, instruction.setting)
        of_task = whole._replace(task=episode.task)
        if slots:
            yield whole, slots
            yield of_task, slots
        for slot in slots:
            yield of_task._replace(slot=slot), (slot,)

    def place(row: ShortcutRow) -> tuple[str, int, bool]:
        key = FloorKey(*row.group)
        return key.split, names.index(key.setting), bool(key.task)

    names = [name for name, setting in all_settings().items() if setting.implicit]
    scored = score_texts(
        tasks, ("test",), names, InstructionOptions(), seeds=scenes, learning=learning
    )
    return sorted(tabulate(scored, groups_of), key=place)


def file_text(rows: Sequence[ShortcutRow]) -> str:
    """Return the rows as a file that `measured_floors` reads."""
    goal_heads = [f"{name} goals" for name in stored.NAMES]
    heads = (*FloorKey._fields, "texts", *stored.NAMES, *goal_heads, "excess", "error")
    lines: list[tuple[object, ...]] = [heads]
    for row in rows:
        shares = dict(row.shares)
        best = max(SURFACE_RULES, key=lambda name: _slots(row, name))
        shares["rules"] = shares[best]
        floors = [shares[name] for name in stored.NAMES]
        numbers = [floor.slots for floor in floors]
        numbers += [floor.goals for floor in floors]
        numbers += row.excess or ()
        cells = [f"{number:.4f}" for number in numbers]
        lines.append((*row.group, row.count, *cells))
    return csv_lines(lines)


def tables(floors: Floors) -> str:
    """Return the tables of the documentation."""
    return "\n\n".join([_by_setting(floors), _by_task(floors), _claims(floors)])


def _by_setting(floors: Floors) -> str:
    keys = [key for key in floors if key == FloorKey(stored.RANDOM, key.setting)]
    rows = []
    for key in keys:
        floor = floors[key]
        test = floors[key._replace(split=stored.TEST)]
        cells = [f"{_percent(floor, name)} ({_percent(test, name)})" for name in stored.NAMES]
        excess = excess_text(floor.excess, len(keys))
        rows.append((f"`{key.setting}`", f"{floor.count:,}", *cells, excess))
    numbers = ("texts", *stored.NAMES, "text-only over chance")
    return _BY_SETTING.format(
        version=LANGUAGE_VERSION,
        table=table(("setting", *numbers), rows, numbers),
        rows=counted(len(keys), "row"),
    )


def _by_task(floors: Floors) -> str:
    settings = list(dict.fromkeys(key.setting for key in floors))
    rows = []
    for task in all_tasks():
        cells = [_cell(floors.get(FloorKey(stored.RANDOM, name, task))) for name in settings]
        rows.append((task, *cells))
    numbers = [f"`{name}`" for name in settings]
    return _BY_TASK.format(table=table(("task", *numbers), rows, numbers))


def _cell(floor: ShortcutRow | None) -> str:
    """Return what the words alone give away, and in brackets what needs no words."""
    if floor is None:
        return "–"
    least = max("chance", "majority", key=lambda name: _slots(floor, name))
    return f"{_percent(floor, 'text-only')} ({_percent(floor, least)})"


def _percent(row: ShortcutRow, name: str) -> str:
    return f"{100 * _slots(row, name):.0f}"


def _slots(row: ShortcutRow, name: str) -> float:
    """Return the share of slots of a floor, which has some in every stored row."""
    return row.shares[name].slots or 0


def _claims(floors: Floors) -> str:
    """Return which settings count for the headline, and in how many slots they exceed chance."""
    counting = stored.settings_at_chance(floors)
    tested = [key for key in floors if key.slot and key.setting in counting]
    above = []
    for key in tested:
        excess = floors[key].excess
        if excess and excess.interval(len(tested))[0] > MARGIN:
            where = f"{key.task} {key.slot} in `{key.setting}`, {key.split}"
            above.append(f"{where}: {excess_text(excess, len(tested))}")
    names = ", ".join(f"`{name}`" for name in counting)
    return (
        f"`text-only` is at most {100 * MARGIN:.0f} points above chance in "
        f"{names or 'no setting'}, over all tasks. Single slots in which it is surely above this "
        "threshold, on random scenes or on the test split (intervals Bonferroni-adjusted for "
        f"{counted(len(tested), 'slot')}): {'; '.join(above) or 'none'}."
    )


def page_text() -> str:
    """Return the page with the tables of the stored floors."""
    floors = stored.measured_floors(LANGUAGE_VERSION) or {}
    return with_part(PAGE.read_text(encoding="utf-8"), "floors", tables(floors))


def main(scenes: int = SCENES, learning: int = LEARNING_SCENES, *, tables: bool = False) -> None:
    """Measure, and write the file and the page; with --tables only the page."""
    if not tables:
        begin = time.perf_counter()
        rows = measure(tuple(all_tasks()), scenes, learning)
        file = Path(stored.__file__).with_name(stored.floors_name(LANGUAGE_VERSION))
        file.write_text(file_text(rows), encoding="utf-8")
        stored.measured_floors.cache_clear()
        print(f"{file}: {len(rows)} lines in {time.perf_counter() - begin:.0f} s")
    PAGE.write_text(page_text(), encoding="utf-8")


if __name__ == "__main__":
    typer.run(main)
