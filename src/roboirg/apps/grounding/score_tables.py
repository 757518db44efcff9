"""Tables of scores: each set of options, and gaps by kind of words."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

from roboirg.analysis.measures.breakdowns import BREAKDOWNS
from roboirg.analysis.results.frame import as_column
from roboirg.analysis.tables.diagnostic_tables import make_breakdown_table
from roboirg.analysis.tables.table import Row, Table, named_columns
from roboirg.apps.grounding.answer_scores import GroundingScore, ScoreRow, score_rows
from roboirg.apps.grounding.items.grounding_item import GroundingItem
from roboirg.core.instruction_options import options_label
from roboirg.core.plain_text import counted
from roboirg.stats.intervals import TOO_FEW, Interval
from roboirg.stats.rates import NOT_APPLICABLE, gap_words, half_up

COLUMNS = named_columns(
    "items", "right", "95 % interval", "random", "above random", "command", "hidden slots", "gap",
    "p",
)  # fmt: skip
QUESTIONS = {"slots": "slots", "choice": "choices", "points": "points"}


def score_table(scores: Iterable[GroundingScore]) -> Table:
    """Return the table of scores: a row for each model, kind of question and set of options.

    `scores` may be read only once; the table has notes on what was unreadable or missing.
    """
    scores = tuple(scores)
    rows = []
    for score in scores:
        for row in score_rows(score):
            label = options_label(row.summary.key.options)
            rows.append(Row(_title(score), label, _words(row)))
    return Table(
        key="grounding",
        title="Grounding",
        heads=("model and question", "setting"),
        columns=COLUMNS,
        rows=tuple(rows),
        notes=tuple(_notes(scores)),
    )


def _title(score: GroundingScore) -> str:
    """Return the model and the question, as in ``my-model, choices``."""
    return f"{score.name}, {QUESTIONS[score.kind]}"


def breakdown_tables(score: GroundingScore) -> Iterator[Table]:
    """Yield tables of success by kinds of instructions, with gaps to explicit ones.

    Kinds are reasoning patterns, referring expressions, and values that the command leaves to its
    context: a table for each that some item has. An item may have several labels of one kind.
    """
    for name, labels_of in _LABELS.items():
        labels = [tuple(labels_of(item)) for item in score.frame["item"]]
        frame = score.frame.extended({name: as_column(labels)})
        if any(labels):
            yield make_breakdown_table(BREAKDOWNS[name], frame)


def _words(row: ScoreRow) -> tuple[str, ...]:
    """Return the texts of a row of the table of scores, one for each of `COLUMNS`.

    Rates are in percent, the gap to explicit in points.
    """
    summary = row.summary
    value, _, p_value = gap_words(summary.gap, summary.p_holm)
    rate = None if summary.rate is None else float(summary.rate)
    return (
        str(summary.counts.trials),
        _percent(rate),
        _interval(summary.interval),
        _percent(row.chance),
        _percent(row.corrected),
        _percent(row.command_chance),
        _percent(row.hidden),
        value,
        p_value,
    )


def _notes(scores: Sequence[GroundingScore]) -> Iterator[str]:
    """Yield the notes below the table: its columns, and answers that are unreadable or missing.

    One sentence for each score that has some of them.
    """
    yield (
        "Percent correct, as means over tasks. Random: goals of the scene, letters or pixels "
        "drawn at random. Above random: 0 is random, 100 all correct. Command: a guess among the "
        "goals that fit the command alone. Hidden slots: those that the command leaves to its "
        "context, each counted once. Gap: difference to explicit on the same episodes in points, "
        "with the p-value of the exact paired test after Holm's correction."
    )
    for score in scores:
        name = _title(score)
        if score.unparsed:
            replies = counted(score.unparsed, "unreadable reply", "unreadable replies")
            yield f"{name}: {replies}, counted as wrong."
        if score.missing:
            items = counted(score.missing, "item")
            yield f"{name}: {items} not answered and left out of the rates."


def _percent(rate: float | None) -> str:
    """Return a rate in percent, as in ``−5.0``; a dash if there is none."""
    if rate is None:
        return NOT_APPLICABLE
    return str(half_up(100 * rate, 1)).replace("-", "−")


def _interval(interval: Interval | None) -> str:
    """Return an interval in percent, as in ``40.0 to 60.0``."""
    if interval is None:
        return TOO_FEW
    low, high = interval
    return f"{_percent(low)} to {_percent(high)}"


_LABELS: Mapping[str, Callable[[GroundingItem], Sequence[str]]] = {
    "pattern": lambda item: () if item.pattern is None else (item.pattern,),
    "expression": lambda item: item.expressions,
    "slots": lambda item: item.hidden_slots,
}
"""The labels of an item by the name of a breakdown."""
