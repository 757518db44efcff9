"""Score answers to the grounding dataset: verdicts, and cells for the statistics."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from roboirg.analysis.measures.measure import ALL_TASKS, Measured, ScopeKey, summarize
from roboirg.analysis.results.frame import MISSING, Frame, as_column, task_order
from roboirg.analysis.results.option_labels import options_sort_key
from roboirg.analysis.results.policy_run import EvalConditions, PolicyRun
from roboirg.analysis.results.run_cells import cells_of
from roboirg.apps.grounding.items.answer_file import Answer
from roboirg.apps.grounding.items.grounding_item import (
    QUESTION_KINDS,
    GroundingItem,
    QuestionKind,
)
from roboirg.apps.grounding.items.verdicts import ReplyVerdict, guess_chance, judge_reply
from roboirg.core.arms import TOLD
from roboirg.core.errors import InvalidValueError
from roboirg.core.versions import Versions

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
        return sum(judged.verdict.understood is None for judged in self.judged)

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
    """Score a model's answers to grounding questions, apart for each kind of question.

    Kinds are slots (the values of the goal), choice (a letter) and points (pixels). An unreadable
    reply is wrong. An item without an answer is missing: it is in no rate.

    Args:
        items: of the dataset, all of one split and one wording.
        answers: to questions of the items.
        name: of the model that answered.

    Returns:
        A score for each kind of which there is an answer, in the order of `QUESTION_KINDS`.

    Raises:
        InvalidValueError: the items are of several splits or wordings, or there is no answer.
        UnknownNameError: a task is not installed.
    """
    # Replies by the ids of their items.
    by_kind: dict[QuestionKind, dict[str, str]] = {}
    for answer in answers:
        by_kind.setdefault(answer.kind, {})[answer.id] = answer.reply
    if not by_kind:
        raise InvalidValueError("There are no answers to score.")
    run = _policy_run(items, name)
    scores = []
    for kind in QUESTION_KINDS:
        replies = by_kind.get(kind)
        if replies:
            scores.append(_score(items, replies, run, kind))
    return tuple(scores)


def score_rows(score: GroundingScore) -> tuple[ScoreRow, ...]:
    """Return a row for each set of instruction options, over all tasks.

    Rows have intervals, and p-values of the gap to explicit after Holm's correction.
    """
    summaries = summarize(cells_of(score.frame))
    return tuple(
        _row(score, summary) for key, summary in summaries.items() if key.scope == ALL_TASKS
    )


def _policy_run(items: Sequence[GroundingItem], name: str) -> PolicyRun:
    """Describe a model's answers as the run of a policy, so that runs' statistics apply to them.

    `PolicyRun` holds the model's name, the split and words, and the versions.

    Raises:
        InvalidValueError: the items differ in split, words or versions.
    """
    runs = {_run_of(item, name) for item in items}
    if len(runs) != 1:
        raise InvalidValueError(
            "The items come from several splits, wordings or versions, whose scores are not "
            "averaged; export and score each separately."
        )
    return runs.pop()


def _run_of(item: GroundingItem, name: str) -> PolicyRun:
    """Return the run of an item, which is to be the same for all that are scored together."""
    wordings = None if item.wordings == OWN_WORDS else item.wordings
    versions = Versions(
        policy_version=ANSWERS_VERSION,
        language_version=item.language_version,
        environment_version=item.environment_version,
    )
    return PolicyRun(name, EvalConditions(item.split, wordings=wordings), versions)


def _score(
    items: Sequence[GroundingItem], replies: Mapping[str, str], run: PolicyRun, kind: QuestionKind
) -> GroundingScore:
    """Judge a model's replies to one kind of question.

    Args:
        items: all of the dataset, answered or not.
        replies: by the ids of their items.
        run: describes the model and its conditions.
        kind: slots, choice or points.
    """
    verdicts = {}
    judged = []
    for item in items:
        if item.id in replies:
            verdicts[item.id] = judge_reply(item, kind, replies[item.id])
            judged.append(JudgedItem(item, verdicts[item.id]))
    return GroundingScore(run.policy, kind, tuple(judged), _frame(items, verdicts, run))


def _frame(
    items: Sequence[GroundingItem], verdicts: Mapping[str, ReplyVerdict], run: PolicyRun
) -> Frame:
    """Return the verdicts as a table for the statistics of runs, with a row for each item.

    Args:
        items: all of the dataset, which the table has sorted by task, options and episode.
        verdicts: by the ids of the items that were answered; others are missing.
        run: describes the model and its conditions.
    """
    rows = []
    for item in _sorted(items):
        rows.append({"run": run, "item": item, **_frame_row(item, verdicts.get(item.id))})
    columns = {}
    for name in rows[0]:
        columns[name] = as_column([row[name] for row in rows])
    return Frame(columns)


def _sorted(items: Sequence[GroundingItem]) -> list[GroundingItem]:
    """Sort items by task, instruction options and number of the episode."""
    tasks = task_order({item.task for item in items})

    def place(item: GroundingItem) -> tuple[Any, ...]:
        return tasks.index(item.task), options_sort_key(item.options), item.episode

    return sorted(items, key=place)


def _frame_row(item: GroundingItem, verdict: ReplyVerdict | None) -> dict[str, Any]:
    """Return the columns of an item that the statistics need; items know no seed and no arm."""
    return {
        "options": item.options,
        "task": item.task,
        "episode": item.episode,
        "policy_seed": 0,
        "arm": TOLD,
        "outcome": _outcome(verdict),
    }


def _outcome(verdict: ReplyVerdict | None) -> str:
    """Return how an item counts in the statistics; without an answer it is missing."""
    if verdict is None:
        return MISSING
    return "success" if verdict.right else "failure"


def _row(score: GroundingScore, summary: Measured[ScopeKey]) -> ScoreRow:
    """Return the row of a table of scores: success of one set of instruction options.

    It includes the success of random answers and, if the items have it, of a guess from the command
    alone. Both are means over tasks, as the rate is, so that the three can be compared.
    """
    options = summary.key.options
    judged = [answered for answered in score.judged if answered.item.options == options]
    hidden = None
    if score.kind == "slots":
        hidden = _hidden_share(judged)
    return ScoreRow(
        summary,
        chance=_mean_over_tasks(judged, lambda item: guess_chance(item, score.kind)),
        command_chance=_mean_over_tasks(judged, lambda item: item.command_chance),
        hidden=hidden,
    )


def _mean_over_tasks(
    judged: Iterable[JudgedItem], read: Callable[[GroundingItem], float | None]
) -> float:
    """Return the mean over tasks of each task's mean of a value of its items; 0 without values.

    Of the values 1 and 0 in PickXtimes and 1 in BinFill it is 0.75: tasks weigh the same, as in
    the rates.

    Args:
        judged: the items.
        read: returns the value of an item; None if it has none.
    """
    values_by_task = defaultdict(list)
    for item, _ in judged:
        value = read(item)
        if value is not None:
            values_by_task[item.task].append(value)
    means = [float(np.mean(values)) for values in values_by_task.values()]
    return float(np.mean(means)) if means else 0.0


def _hidden_share(judged: Iterable[JudgedItem]) -> float | None:
    """Return the share of hidden slots that are right; None if nothing is hidden."""
    shares = []
    for item, verdict in judged:
        shares += [verdict.parts[field] for field in hidden_fields(item)]
    return float(np.mean(shares)) if shares else None


def hidden_fields(item: GroundingItem) -> tuple[str, ...]:
    """Return the fields of the right answer that the command does not name, such as ``("color",)``.

    They are those of the goal's slots (its named values) that must be found in the context. Answers
    that count cubes of each color, ``{"red": 2, "blue": 1}``, have colors instead of slots as their
    fields; if anything is hidden there, all fields count.
    """
    fields = json.loads(item.answer)
    hidden = tuple(field for field in fields if field in item.hidden_slots)
    has_amounts = bool(item.hidden_slots) and not hidden
    return tuple(fields) if has_amounts else hidden
