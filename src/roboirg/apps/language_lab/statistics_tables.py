"""Tables of instruction statistics for the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from statistics import fmean, median

from rich.table import Table

from roboirg.apps.language_lab import corpus_statistics
from roboirg.apps.language_lab.corpus_statistics import ClassCounts
from roboirg.language.instruction import Instruction
from roboirg.language.scenarios.relations import EVERY_RELATION
from roboirg.language.settings import setting_names
from roboirg.language.token_counts import SHORT_LIMIT, USUAL_LIMIT, count_tokens
from roboirg.tasks import every_task

_METADATA_ENTRY_BY_TITLE = {
    "Reasoning patterns (scenes)": "pattern",
    "Relations (scenes)": "relation",
    "Landmark classes (targets)": "landmark_classes",
    "Rivals (scenes), by reference": "rival_reference",
}
"""The entry of the metadata that each table counts."""


def overview_tables(instructions: Sequence[Instruction]) -> Iterator[Table]:
    """Yield tables for the terminal: lengths of the texts, and how often each kind of words occurs.

    They are by setting, and those of metadata entries, such as ``pattern``, by task. Of the latter,
    a table of an entry that no instruction has is left out.
    """
    yield _word_count_table(instructions)
    yield _token_count_table(instructions)
    yield expression_table(corpus_statistics.expression_counts(instructions))
    for title, name in _METADATA_ENTRY_BY_TITLE.items():
        counts = corpus_statistics.metadata_counts(instructions, name)
        if counts:
            classes = sorted(corpus_statistics.classes_in(counts))
            if name == "relation":
                classes = list(EVERY_RELATION)
            yield _count_table(title, "task", counts, list(every_task()), classes)


def expression_table(counts: ClassCounts) -> Table:
    """Return the number of scenes with each class of referring expression, by setting."""
    classes = corpus_statistics.expression_order(counts)
    title = "Referring expressions (each once per scene)"
    return _count_table(title, "setting", counts, setting_names(), classes)


def _word_count_table(instructions: Sequence[Instruction]) -> Table:
    """Return a table of the mean, smallest and largest number of words, by setting."""
    table = _table("Words per instruction", "setting", ("mean", "fewest", "most"))
    found = corpus_statistics.by_setting(instructions, lambda text: len(text.split()))
    for setting, words in found.items():
        table.add_row(
            setting,
            f"{fmean(words):.1f}",
            str(min(words)),
            str(max(words)),
        )
    return table


def _token_count_table(instructions: Sequence[Instruction]) -> Table:
    """Return a table of the median and largest number of tokens, by setting.

    Two more columns have the share of instructions that exceed usual limits of policies.
    """
    columns = ("median", "most", f"over {SHORT_LIMIT}", f"over {USUAL_LIMIT}")
    table = _table("Tokens per instruction (vocabulary of 32,000)", "setting", columns)
    found = corpus_statistics.by_setting(instructions, count_tokens)
    for setting, counts in found.items():
        table.add_row(
            setting,
            f"{median(counts):.0f}",
            str(max(counts)),
            _share_over(counts, SHORT_LIMIT),
            _share_over(counts, USUAL_LIMIT),
        )
    return table


def _share_over(counts: Sequence[int], limit: int) -> str:
    """Return which share of counts is over a limit, as a percentage: ``12.5%``."""
    return f"{fmean(count > limit for count in counts):.1%}"


def _count_table(
    title: str, kind: str, counts: ClassCounts, rows: Sequence[str], columns: Sequence[str]
) -> Table:
    """Return a table of counts: how often each setting uses each class of expression, for example.

    Args:
        title: above the table.
        kind: heads the first column: what the rows are, ``setting``.
        counts: by row, then by column: ``{"direct": {"it": 50}}``.
        rows: names of all rows in order; those without counts are left out.
        columns: names of all columns in order; those without counts are left out.
    """
    counted = corpus_statistics.classes_in(counts)
    used = [name for name in columns if name in counted]
    table = _table(title, kind, used)
    for name in rows:
        if name in counts:
            numbers = [str(counts[name].get(column, "")) for column in used]
            table.add_row(name, *numbers)
    return table


def _table(title: str, first: str, numbers: Sequence[str]) -> Table:
    """Return an empty table with a column of names, and columns of numbers.

    Args:
        title: above the table.
        first: heads the column of names.
        numbers: head the columns of numbers.
    """
    table = Table(title=title, title_justify="left", title_style="bold")
    table.add_column(first)
    for name in numbers:
        table.add_column(name, justify="right")
    return table
