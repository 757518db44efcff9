"""A report on answers in Markdown: scores, confusions, what was meant and what was understood."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from roboirg.analysis.tables.rendering.markdown import markdown
from roboirg.analysis.tables.table import Column, Entry, Row, Table
from roboirg.apps.grounding.answer_scores import GroundingScore, JudgedItem, hidden_fields
from roboirg.apps.grounding.items.verdicts import right_reply
from roboirg.apps.grounding.score_tables import QUESTIONS, breakdown_tables, score_table
from roboirg.core.plain_text import counted

NO_ANSWER = "no answer"
MOST_MISTAKES = 40
_CONFUSION_NOTE = (
    "Number of instructions whose command leaves the slot to the context, by the value "
    "understood. Correct values are in bold."
)


class Confusion(NamedTuple):
    """The value of a slot that was meant, and the one that was understood, in words."""

    meant: str
    understood: str


def report_text(scores: Sequence[GroundingScore], data: Path, target: Path) -> str:
    """Return a report in Markdown: scores, breakdowns, confusions and examples of wrong answers.

    Args:
        scores: of one or several models.
        data: folder of the dataset; its pictures are linked.
        target: file that the report is written to, from which links lead.
    """
    parts = ["# Grounding: what was understood", markdown(score_table(scores))]
    for score in scores:
        parts.append(f"## {score.name}, {QUESTIONS[score.kind]}")
        tables = list(breakdown_tables(score))
        if score.kind == "slots":
            tables += confusion_tables(score)
        parts += [markdown(table) for table in tables]
        parts += _mistakes(score, Path(os.path.relpath(data, target.parent)))
    stripped = [part.rstrip("\n") for part in parts]
    return "\n\n".join(stripped) + "\n"


def confusion_tables(score: GroundingScore) -> Iterator[Table]:
    """Yield a confusion table for each field of answers, such as ``color``: meant by understood.

    An instruction counts in the fields that its command leaves to its context. Explicit ones, whose
    command names all, count in none. An unreadable answer counts as `NO_ANSWER`.
    """
    found: dict[str, Counter[Confusion]] = {}
    for item, verdict in score.judged:
        meant = json.loads(item.answer)
        understood = json.loads(verdict.understood or "{}")
        for field in hidden_fields(item):
            value = _text(understood[field]) if understood else NO_ANSWER
            counts = found.setdefault(field, Counter())
            counts[Confusion(_text(meant[field]), value)] += 1
    for field, counts in sorted(found.items()):
        yield _confusion_table(field, counts)


def _confusion_table(field: str, counts: Counter[Confusion]) -> Table:
    """Return the table of how often which value was understood where another one was meant.

    A row for each value that was meant, and a column for each that was understood, `NO_ANSWER`
    last; right ones are marked. ``Confusion("red", "blue"): 3`` is 3 in row *red*, column *blue*.

    Args:
        field: of the answers, such as ``color``.
        counts: by the values that were meant and understood.
    """
    every_meant = {pair.meant for pair in counts}
    every_understood = {pair.understood for pair in counts}
    columns = sorted(every_understood - {NO_ANSWER})
    if NO_ANSWER in every_understood:
        columns.append(NO_ANSWER)
    rows = []
    for meant in sorted(every_meant):
        entries = []
        for understood in columns:
            count = counts[Confusion(meant, understood)]
            entries.append(Entry(word=str(count or "–"), best=meant == understood))
        rows.append(Row(field, meant, tuple(entries)))
    return Table(
        key=f"confusion_{field}",
        title=f"Confusion of {field}",
        heads=("slot", "meant"),
        columns=tuple(Column(value) for value in columns),
        rows=tuple(rows),
        notes=(_CONFUSION_NOTE,),
    )


def _text(value: object) -> str:
    """Return the value of a slot in words: ``["red", "blue"]`` is ``red, blue``."""
    if isinstance(value, list):
        return ", ".join(str(part) for part in value)
    return str(value)


def _mistakes(score: GroundingScore, pictures: Path) -> Iterator[str]:
    """Yield a section of the report with some wrong answers, and links to what was seen.

    Args:
        score: of a model, in one kind of question.
        pictures: folder of the dataset, as seen from the report.
    """
    wrong = [answered for answered in score.judged if not answered.verdict.right]
    if not wrong:
        return
    shown = _spread(wrong)
    yield f"### What was understood instead: {len(shown)} of {counted(len(wrong), 'mistake')}"
    for item, verdict in shown:
        meant = right_reply(item, score.kind)
        links = f"[picture]({pictures / item.picture})"
        if item.video is not None:
            links += f", [video]({pictures / item.video})"
        yield (
            f"- {item.task}, {item.setting}, episode {item.episode} ({links}; `{item.id}`):\n"
            f"  *{item.text}*\n"
            f"  meant `{meant}`, understood `{verdict.understood or NO_ANSWER}`"
        )


def _spread(wrong: Iterable[JudgedItem]) -> list[JudgedItem]:
    """Choose at most `MOST_MISTAKES` wrong answers from as many tasks and settings as possible.

    They are the first one of every task and setting, then the second one of each, and so on. Groups
    A A A B -> A B A A.
    """
    seen: Counter[tuple[str, str]] = Counter()
    by_rank: dict[int, list[JudgedItem]] = {}
    for answered in wrong:
        group = answered.item.task, answered.item.setting
        by_rank.setdefault(seen[group], []).append(answered)
        seen[group] += 1
    shown: list[JudgedItem] = []
    for rank in sorted(by_rank):
        shown += by_rank[rank]
    return shown[:MOST_MISTAKES]
