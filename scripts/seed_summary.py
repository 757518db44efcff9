"""Show the progress of seed selection, and summarize which seeds were rejected and why."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.markup import escape
from rich.table import Table
from seed_selection import REASONS, EpisodeSlot, SelectedSeed

from roboirg.cli.progress_bar import progress_bars
from roboirg.core.episode import DIFFICULTIES
from roboirg.util.console_width import widen


def follow_progress(
    found: Iterable[SelectedSeed], slots: Sequence[EpisodeSlot]
) -> tuple[SelectedSeed, ...]:
    """Collect results, which come in any order, in that of the slots; show the progress."""
    collected: dict[EpisodeSlot, SelectedSeed] = {}
    with progress_bars() as report:
        for one in found:
            collected[one.slot] = one
            report("episodes", len(collected), len(slots), one.slot.key)
    return tuple(collected[slot] for slot in slots)


def summary_table(found: Sequence[SelectedSeed]) -> Table:
    """Return a table by task and difficulty: episodes, seeds tried, and rejections by reason."""
    table = Table(title="Rejected seeds", title_justify="left", title_style="bold")
    table.add_column("task")
    table.add_column("difficulty")
    for name in ("episodes", "seeds tried", *REASONS, "rejected"):
        table.add_column(name, justify="right")
    for task in dict.fromkeys(one.slot.task for one in found):
        table.add_section()
        for difficulty in DIFFICULTIES:
            group = [
                one for one in found if one.slot.task == task and one.slot.difficulty == difficulty
            ]
            reasons = Counter(rejection.reason for one in group for rejection in one.rejections)
            tried = len(group) + reasons.total()
            counts = (str(reasons[reason] or "") for reason in REASONS)
            share = f"{100 * reasons.total() / tried:.0f} %" if tried else ""
            table.add_row(task, difficulty, str(len(group)), str(tried), *counts, share)
    return table


def cause_lines(found: Sequence[SelectedSeed]) -> list[str]:
    """Return the causes by task, each with an example; without those for lack of room."""
    counts: Counter[tuple[str, str, str]] = Counter()
    examples: dict[tuple[str, str, str], str] = {}
    for one in found:
        for seed, reason, cause in one.rejections:
            key = (one.slot.task, reason, cause)
            if reason != "no room":
                counts[key] += 1
                examples.setdefault(key, f"{one.slot.key}, seed {seed}")
    return [
        f"{task}: {count} × {reason}: {cause} (first: {examples[task, reason, cause]})"
        for (task, reason, cause), count in counts.items()
    ]


def print_summary(found: Sequence[SelectedSeed], console: Console) -> None:
    """Print the table and, below it, the causes."""
    table = summary_table(found)
    widen(console, table)
    console.print(table)
    for line in cause_lines(found):
        console.print(escape(line), highlight=False, soft_wrap=True)
