"""A report on answers in Markdown: scores, breakdowns, and what was understood instead."""

from __future__ import annotations

import os
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from roboirg.analysis.tables.rendering.markdown import markdown
from roboirg.apps.grounding.answer_scores import GroundingScore, JudgedItem
from roboirg.apps.grounding.items.verdicts import right_reply
from roboirg.apps.grounding.score_tables import QUESTIONS, breakdown_tables, score_table
from roboirg.core.plain_text import counted

NO_ANSWER = "no answer"
MOST_MISTAKES = 40


def report_text(scores: Sequence[GroundingScore], data: Path, target: Path) -> str:
    """Return a report in Markdown: scores, breakdowns and examples of wrong answers.

    Args:
        scores: of one or several models.
        data: folder of the dataset; its pictures are linked.
        target: file that the report is written to, from which links lead.
    """
    parts = ["# Grounding: what was understood", markdown(score_table(scores))]
    for score in scores:
        parts.append(f"## {score.name}, {QUESTIONS[score.kind]}")
        parts += map(markdown, breakdown_tables(score))
        parts += _mistakes(score, Path(os.path.relpath(data, target.parent)))
    stripped = [part.rstrip("\n") for part in parts]
    return "\n\n".join(stripped) + "\n"


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
    by_rank = defaultdict(list)
    for answered in wrong:
        group = answered.item.task, answered.item.setting
        by_rank[seen[group]].append(answered)
        seen[group] += 1
    shown: list[JudgedItem] = []
    for rank in sorted(by_rank):
        shown += by_rank[rank]
    return shown[:MOST_MISTAKES]
