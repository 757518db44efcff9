"""Score answers to the grounding dataset: verdicts, and cells for the statistics."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from roboirg.core.arms import TOLD
from roboirg.core.errors import InvalidValueError
from roboirg.core.versions import Versions
from roboirg.evaluation.analysis.results.frame import MISSING, Frame, as_column, task_order
from roboirg.evaluation.analysis.results.option_labels import options_sort_key
from roboirg.evaluation.analysis.results.policy_run import EvalConditions, PolicyRun
from roboirg.evaluation.analysis.stats.cells import cells_of
from roboirg.evaluation.analysis.stats.measure import ALL_TASKS, Measured, ScopeKey, summarize
from roboirg.evaluation.grounding_items.answer_file import Answer
from roboirg.evaluation.grounding_items.grounding_item import (
    QUESTION_KINDS,
    GroundingItem,
    QuestionKind,
)
from roboirg.evaluation.grounding_items.verdicts import ReplyVerdict, guess_chance, judge_reply

ANSWERS_VERSION = "answers"
OWN_WORDS = "own"


class JudgedItem(NamedTuple):
    """An item with the verdict on its answer."""

    item: GroundingItem
    verdict: ReplyVerdict


@dataclass(frozen=True)
class GroundingScore:
    """All answers of one model to one kind of question.

    Attributes:
        name: of the model.
        kind: of question.
        judged: answered items, in the order of the dataset.
        frame: a row for each item, sorted, with columns for the statistics and ``item``; items
            without an answer are missing.
    """

    name: str
    kind: QuestionKind
    judged: tuple[JudgedItem, ...]
    frame: Frame

    @property
    def unparsed(self) -> int:
        """Number of unreadable replies."""
        return sum(one.verdict.understood is None for one in self.judged)

    @property
    def missing(self) -> int:
        """Number of items without an answer."""
        return [*self.frame["outcome"]].count(MISSING)


@dataclass(frozen=True)
class ScoreRow:
    """One set of options, as the unweighted mean over tasks.

    Attributes:
        summary: rate, interval, gap to explicit and its corrected p-value.
        chance: rate of random answers.
        command_chance: rate of a guess among the goals that fit the command alone.
        hidden: share of the hidden slots that are right; None for other questions, or if nothing is
            hidden.
    """

    summary: Measured[ScopeKey]
    chance: float
    command_chance: float
    hidden: float | None

    @property
    def corrected(self) -> float | None:
        """The rate on a scale from random answers, 0, to 1; None if random answers are right."""
        rate = self.summary.rate
        if rate is None or self.chance >= 1:
            return None
        return (float(rate) - self.chance) / (1 - self.chance)


def score_answers(
    items: Sequence[GroundingItem], answers: Iterable[Answer], name: str
) -> tuple[GroundingScore, ...]:
    """Score answers, kind by kind.

    An unreadable reply is wrong. An item without an answer is missing: it is in no rate.

    Args:
        items: of the dataset, all of one split and one wording.
        answers: to questions of the items.
        name: of the model that answered.

    Raises:
        InvalidValueError: the items are of several splits or wordings, or there is no answer.
        UnknownNameError: a task is not installed.
    """
    by_kind: dict[QuestionKind, dict[str, str]] = {}
    for answer in answers:
        by_kind.setdefault(answer.kind, {})[answer.id] = answer.reply
    if not by_kind:
        raise InvalidValueError("There are no answers to score.")
    run = _policy_run(items, name)
    return tuple(
        _score(items, by_kind[kind], run, kind) for kind in QUESTION_KINDS if kind in by_kind
    )


def score_rows(score: GroundingScore) -> tuple[ScoreRow, ...]:
    """Return a row for each set of options, with intervals and corrected tests."""
    found = summarize(cells_of(score.frame))
    return tuple(_row(score, one) for key, one in found.items() if key.scope == ALL_TASKS)


def _policy_run(items: Sequence[GroundingItem], name: str) -> PolicyRun:
    sources = {
        (one.split, one.wordings, one.language_version, one.environment_version) for one in items
    }
    if len(sources) != 1:
        raise InvalidValueError(
            "The items come from several splits, wordings or versions, whose scores are not "
            "averaged; export and score each separately."
        )
    ((split, wordings, language, environment),) = sources
    conditions = EvalConditions(split, wordings=None if wordings == OWN_WORDS else wordings)
    return PolicyRun(
        name,
        conditions,
        Versions(
            policy_version=ANSWERS_VERSION,
            language_version=language,
            environment_version=environment,
        ),
    )


def _score(
    items: Sequence[GroundingItem], replies: Mapping[str, str], run: PolicyRun, kind: QuestionKind
) -> GroundingScore:
    verdicts = {
        item.id: judge_reply(item, kind, replies[item.id]) for item in items if item.id in replies
    }
    judged = tuple(JudgedItem(one, verdicts[one.id]) for one in items if one.id in verdicts)
    tasks = task_order({one.task for one in items})
    ordered = sorted(
        items, key=lambda one: (tasks.index(one.task), options_sort_key(one.options), one.episode)
    )
    columns: dict[str, list[Any]] = {
        "run": [run] * len(ordered),
        "item": ordered,
        "options": [one.options for one in ordered],
        "task": [one.task for one in ordered],
        "episode": [one.episode for one in ordered],
        "policy_seed": [0] * len(ordered),
        "arm": [TOLD] * len(ordered),
        "outcome": [_outcome(verdicts.get(one.id)) for one in ordered],
    }
    frame = Frame({name: as_column(values) for name, values in columns.items()})
    return GroundingScore(run.policy, kind, judged, frame)


def _outcome(verdict: ReplyVerdict | None) -> str:
    return MISSING if verdict is None else "success" if verdict.right else "failure"


def _row(score: GroundingScore, summary: Measured[ScopeKey]) -> ScoreRow:
    own = [one for one in score.judged if one.item.options == summary.key.options]
    return ScoreRow(
        summary,
        chance=_mean_over_tasks((item, guess_chance(item, score.kind)) for item, _ in own),
        command_chance=_mean_over_tasks((item, item.command_chance) for item, _ in own),
        hidden=_hidden_share(own) if score.kind == "slots" else None,
    )


def _mean_over_tasks(values: Iterable[tuple[GroundingItem, float | None]]) -> float:
    """Return the mean over tasks of the known means, weighted as the rates are; 0 without any."""
    by_task: dict[str, list[float]] = defaultdict(list)
    for item, value in values:
        if value is not None:
            by_task[item.task].append(value)
    means = [float(np.mean(own)) for own in by_task.values()]
    return float(np.mean(means)) if means else 0.0


def _hidden_share(judged: Iterable[JudgedItem]) -> float | None:
    shares = [verdict.parts[field] for item, verdict in judged for field in hidden_fields(item)]
    return float(np.mean(shares)) if shares else None


def hidden_fields(item: GroundingItem) -> tuple[str, ...]:
    """Return the fields of the answer that the command leaves to its context.

    An answer has a field for each amount, while the goal has two slots for all of them.
    """
    fields = json.loads(item.answer)
    hidden = tuple(field for field in fields if field in item.hidden_slots)
    is_amounts = bool(item.hidden_slots) and not hidden
    return tuple(fields) if is_amounts else hidden
