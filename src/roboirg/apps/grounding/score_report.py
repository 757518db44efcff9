"""A report on answers in Markdown: scores, confusions, what was meant and what was understood."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from roboirg.apps.grounding.answer_scores import GroundingScore, JudgedItem, hidden_fields
from roboirg.apps.grounding.score_tables import QUESTIONS, breakdown_tables, score_table
from roboirg.core.plain_text import counted
from roboirg.evaluation.analysis.tables.rendering.markdown import markdown
from roboirg.evaluation.analysis.tables.table import Column, Entry, Row, Table
from roboirg.evaluation.grounding_items.verdicts import right_reply

NO_ANSWER = "no answer"
MOST_MISTAKES = 40
_CONFUSION_NOTE = (
    "Number of instructions whose command leaves the slot to the context, by the value "
    "understood. Correct values are in bold."
)


def report_text(scores: Sequence[GroundingScore], data: Path, target: Path) -> str:
    """Return the report.

    Args:
        scores: of one or several models.
        data: folder of the dataset; its pictures are linked.
        target: file that the report is written to, from which links lead.
    """
    parts = ["# Grounding: what was understood", markdown(score_table(scores))]
    for score in scores:
        parts.append(f"## {score.name}, {QUESTIONS[score.kind]}")
        parts += map(markdown, breakdown_tables(score))
        if score.kind == "slots":
            parts += map(markdown, confusion_tables(score))
        parts += _mistakes(score, Path(os.path.relpath(data, target.parent)))
    return "\n\n".join(part.rstrip("\n") for part in parts) + "\n"


def confusion_tables(score: GroundingScore) -> Iterator[Table]:
    """Yield for each field of an answer a table of what was meant and what was understood.

    Only instructions whose command leaves the field to its context count, those with an explicit
    command in none.
    """
    found: dict[str, Counter[tuple[str, str]]] = {}
    for item, verdict in score.judged:
        meant = json.loads(item.answer)
        understood = None if verdict.understood is None else json.loads(verdict.understood)
        for field in hidden_fields(item):
            value = NO_ANSWER if understood is None else _text(understood[field])
            found.setdefault(field, Counter())[_text(meant[field]), value] += 1
    for field, counts in sorted(found.items()):
        yield _confusion_table(field, counts)


def _confusion_table(field: str, counts: Counter[tuple[str, str]]) -> Table:
    meant = sorted({pair[0] for pair in counts})
    understood = sorted({pair[1] for pair in counts} - {NO_ANSWER})
    if any(pair[1] == NO_ANSWER for pair in counts):
        understood.append(NO_ANSWER)
    return Table(
        key=f"confusion_{field}",
        title=f"Confusion of {field}",
        heads=("slot", "meant"),
        columns=tuple(map(Column, understood)),
        rows=tuple(
            Row(
                field,
                value,
                tuple(
                    Entry(word=str(counts[value, other] or "–"), best=value == other)
                    for other in understood
                ),
            )
            for value in meant
        ),
        notes=(_CONFUSION_NOTE,),
    )


def _text(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _mistakes(score: GroundingScore, pictures: Path) -> Iterator[str]:
    wrong = [one for one in score.judged if not one.verdict.right]
    if not wrong:
        return
    shown = _spread(wrong)
    yield f"### What was understood instead: {len(shown)} of {counted(len(wrong), 'mistake')}"
    for item, verdict in shown:
        meant = right_reply(item, score.kind)
        frames = "" if item.video is None else f", [video]({pictures / item.video})"
        links = f"[picture]({pictures / item.picture}){frames}; `{item.id}`"
        yield (
            f"- {item.task}, {item.setting}, episode {item.episode} ({links}):\n"
            f"  *{item.text}*\n"
            f"  meant `{meant}`, understood `{verdict.understood or NO_ANSWER}`"
        )


def _spread(wrong: Sequence[JudgedItem]) -> list[JudgedItem]:
    """Return at most `MOST_MISTAKES`, the first of every task and setting, then the second, ..."""
    ranks: Counter[tuple[str, str]] = Counter()
    ranked = []
    for place, one in enumerate(wrong):
        key = (one.item.task, one.item.setting)
        ranked.append((ranks[key], place, one))
        ranks[key] += 1
    return [one for _, _, one in sorted(ranked, key=lambda entry: entry[:2])[:MOST_MISTAKES]]
