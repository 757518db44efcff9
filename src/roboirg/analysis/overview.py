"""The overview of the page: success by policy, task and setting, as a heat map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from roboirg.analysis.statistics import EXPLICIT, Cell, Panel, Variant, make_panels
from roboirg.analysis.tables import ALL_TASKS, count_text, gap_text, percent, points
from roboirg.episode import DIFFICULTIES
from roboirg.evaluation.record import Record

FEW = 20
"""Cells with fewer episodes say how many."""


@dataclass(frozen=True, slots=True)
class HeatCell:
    """A cell of the overview."""

    policy: str
    task: str | None
    setting: str
    split: str
    max_steps: int
    difficulty: str
    rate: float | None
    text: str
    gap: str
    gap_is_muted: bool
    count: str
    note: str
    is_complete: bool


class HeatRow(NamedTuple):
    """A row of the overview: a policy as a whole, or one of its tasks."""

    name: str
    is_policy: bool
    trials: str
    cells: tuple[HeatCell | None, ...]


class Level(NamedTuple):
    """The overview of one difficulty; empty for all together."""

    difficulty: str
    rows: tuple[HeatRow, ...]


def present(records: Sequence[Record], name: str, order: Sequence[str]) -> tuple[str, ...]:
    """The values that a field of the records has, in the given order."""
    values = {str(getattr(record, name)) for record in records}
    return tuple(value for value in order if value in values)


def make_levels(
    records: Sequence[Record], panels: Sequence[Panel], variants: Sequence[Variant]
) -> list[Level]:
    """The overview of everything, and of each difficulty where there are several."""
    levels = [("", panels)]
    found = present(records, "difficulty", DIFFICULTIES)
    if len(found) > 1:
        # What is planned and not played has no difficulty yet; it counts among everything.
        levels += [
            (level, make_panels([record for record in records if record.difficulty == level]))
            for level in found
        ]
    return [
        Level(
            difficulty,
            tuple(row for panel in own for row in _heat_rows(panel, variants, difficulty)),
        )
        for difficulty, own in levels
    ]


def _heat_rows(panel: Panel, variants: Sequence[Variant], difficulty: str) -> list[HeatRow]:
    def row(task: str | None, name: str, *, is_policy: bool) -> HeatRow:
        cells = (_heat_cell(panel, task, variant, difficulty) for variant in variants)
        return HeatRow(name, is_policy, count_text(*panel.trials([task])), tuple(cells))

    whole = row(None, panel.label, is_policy=True)
    if len(panel.tasks) == 1:
        return [whole]
    return [whole, *(row(task, task, is_policy=False) for task in panel.tasks)]


def _heat_cell(
    panel: Panel, task: str | None, variant: Variant, difficulty: str
) -> HeatCell | None:
    cell = panel.cells.get((task, variant))
    if cell is None:
        return None
    return HeatCell(
        policy=panel.condition.policy,
        task=task,
        setting=variant.label,
        split=panel.condition.split,
        max_steps=panel.condition.max_steps,
        rate=cell.rate,
        text="–" if cell.rate is None else percent(cell.rate),
        difficulty=difficulty,
        gap="" if variant == EXPLICIT else gap_text(cell),
        gap_is_muted=cell.is_at_floor,
        count=_count(cell),
        note=_note(
            cell,
            ", ".join(filter(None, (panel.label, task or ALL_TASKS, difficulty, variant.label))),
            is_reference=variant == EXPLICIT,
        ),
        is_complete=cell.is_complete,
    )


def _count(cell: Cell) -> str:
    """How sure the rate is: few episodes are counted, and the interval is said always."""
    if cell.interval is None:
        return ""
    interval = "–".join(map(percent, cell.interval))
    return f"{cell.successes}/{cell.trials} · {interval}" if cell.trials < FEW else interval


def _note(cell: Cell, where: str, *, is_reference: bool) -> str:
    """A cell in words, for tool tips and screen readers."""
    words = [f"{where}: {cell.successes} of {cell.trials} succeeded"]
    if cell.interval is not None:
        low, high = cell.interval
        words.append(f"95 % interval {percent(low)} to {percent(high)} %")
    if cell.gap is not None and not is_reference:
        words.append(f"{points(cell.gap)} points to explicit on {cell.pairs} same episodes")
        if cell.is_at_floor:
            words.append("nothing succeeded there, so the gap says nothing")
    if cell.errors:
        words.append(f"{cell.errors} ended in an error")
    if cell.missing:
        words.append(f"{cell.missing} still to be played")
    return "; ".join(words)
