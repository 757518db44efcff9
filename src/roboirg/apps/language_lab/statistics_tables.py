"""Tables of instruction statistics for the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from statistics import fmean, median

from rich.table import Table

from roboirg.apps.language_lab import corpus_statistics
from roboirg.apps.language_lab.corpus_statistics import ClassCounts
from roboirg.language.instruction import Instruction
from roboirg.language.settings import setting_names
from roboirg.language.templates.derivations import COUNTED_STEPS, RELATIONS, STEPS
from roboirg.language.token_counts import SHORT_LIMIT, USUAL_LIMIT, count_tokens
from roboirg.tasks import every_task


def overview_tables(instructions: Sequence[Instruction]) -> Iterator[Table]:
    """Yield tables of lengths, expressions, patterns, relations and landmark classes."""
    yield _lengths(instructions)
    yield _tokens(instructions)
    yield expression_table(corpus_statistics.expression_counts(instructions))
    yield from phrase_tables(corpus_statistics.phrase_counts(instructions))
    by_task = (
        ("Reasoning patterns (scenes)", "pattern", None),
        ("Relations (scenes)", "relation", _RELATIONS),
        ("Landmark classes (targets)", "landmark_classes", None),
        ("Rivals (scenes), by reference", "rival_reference", None),
    )
    for title, name, order in by_task:
        if counts := corpus_statistics.metadata_counts(instructions, name):
            names = {name for one in counts.values() for name in one}
            yield _count_table(title, "task", counts, [*every_task()], order or sorted(names))


_RELATIONS = [*(one.name for one in (*RELATIONS, *COUNTED_STEPS, *STEPS)), "neighbor"]


def expression_table(counts: ClassCounts) -> Table:
    """Return the number of scenes with each class of referring expression, by setting."""
    classes = corpus_statistics.expression_order(counts)
    title = "Referring expressions (each once per scene)"
    return _count_table(title, "setting", counts, setting_names(), classes)


def phrase_tables(counts: ClassCounts) -> Iterator[Table]:
    """Yield how often each phrase of the paper occurs, a table for each setting."""
    for setting, by_phrase in counts.items():
        table = _table(f"Phrases of the paper, {setting} (commands)", "phrase", ("texts",))
        for phrase, count in by_phrase.items():
            table.add_row(phrase, str(count))
        yield table


def _lengths(instructions: Sequence[Instruction]) -> Table:
    table = _table("Words per instruction", "setting", ("mean", "fewest", "most"))
    found = corpus_statistics.by_setting(instructions, lambda text: len(text.split()))
    for setting, words in found.items():
        table.add_row(setting, f"{fmean(words):.1f}", str(min(words)), str(max(words)))
    return table


def _tokens(instructions: Sequence[Instruction]) -> Table:
    columns = ("median", "most", f"over {SHORT_LIMIT}", f"over {USUAL_LIMIT}")
    table = _table("Tokens per instruction (vocabulary of 32,000)", "setting", columns)
    found = corpus_statistics.by_setting(instructions, count_tokens)
    for setting, counts in found.items():
        over = (fmean(one > limit for one in counts) for limit in (SHORT_LIMIT, USUAL_LIMIT))
        shares = (f"{one:.1%}" for one in over)
        table.add_row(setting, f"{median(counts):.0f}", str(max(counts)), *shares)
    return table


def _count_table(
    title: str, kind: str, counts: ClassCounts, rows: Sequence[str], columns: Sequence[str]
) -> Table:
    used = [name for name in columns if any(name in one for one in counts.values())]
    table = _table(title, kind, used)
    for name in rows:
        if name in counts:
            table.add_row(name, *(str(counts[name].get(column, "")) for column in used))
    return table


def _table(title: str, first: str, numbers: Sequence[str]) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold")
    table.add_column(first)
    for name in numbers:
        table.add_column(name, justify="right")
    return table
