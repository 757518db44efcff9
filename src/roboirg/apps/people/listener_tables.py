"""Tables of a study of listeners: agreement and time by setting, attention by person.

Success is no part of them: it is that of the records, like any policy's.
"""

from __future__ import annotations

import statistics
from collections import Counter, defaultdict
from collections.abc import Hashable, Iterable, Iterator, Sequence

import numpy as np

from roboirg.apps.people.answer_form import FormAnswer, answer_of
from roboirg.apps.people.listener_answers import (
    AnswerUndone,
    ListenerEvent,
    PersonAnswered,
    PersonJoined,
    person_name,
    standing_answers,
)
from roboirg.evaluation.analysis.tables.table import NOT_APPLICABLE, Column, Entry, Row, Table
from roboirg.language.settings import setting_names
from roboirg.tasks.splits.splits import get_episode

ALL = "all"
_SETTING_NOTE = (
    "Asked twice: questions that several people have answered. Agreement: the share of pairs of "
    "their answers that are equal, in percent; alpha: Krippendorff's, nominal, of each task and "
    "setting, then averaged. Seconds: median from the first words to the answer. Practice and "
    "attention checks are left out."
)
_PERSON_NOTE = (
    "Checks are questions with a plain command. Seconds: median time to an answer. Hidden: total "
    "seconds for which the page was out of sight during questions."
)


def setting_table(events: Sequence[ListenerEvent]) -> Table:
    """Return the table of agreement and time to answer, with a row for each setting."""
    answers = [one for one in standing_answers(events) if one.kind == "item"]
    settings = [name for name in setting_names() if any(one.setting == name for one in answers)]
    groups = [(name, [one for one in answers if one.setting == name]) for name in settings]
    return Table(
        key="listeners",
        title="People as listeners",
        heads=("", "setting"),
        columns=tuple(
            map(
                Column,
                ("people", "answers", "asked twice", "agreement", "alpha", "seconds", "quartiles"),
            )
        ),
        rows=tuple(
            Row("listeners", name, "ours", _words(_setting_words(chosen)))
            for name, chosen in [*groups, (ALL, answers)]
        ),
        notes=(_SETTING_NOTE,),
    )


def person_table(events: Sequence[ListenerEvent]) -> Table:
    """Return the table of attention, with a row for each person."""
    by_person: dict[int, list[PersonAnswered]] = {
        one.person: [] for one in events if isinstance(one, PersonJoined)
    }
    for answer in standing_answers(events):
        by_person[answer.person].append(answer)
    undone = [one.person for one in events if isinstance(one, AnswerUndone)]
    return Table(
        key="people",
        title="Attention",
        heads=("", "person"),
        columns=tuple(map(Column, ("answers", "checks right", "seconds", "hidden", "undone"))),
        rows=tuple(
            Row(
                "people",
                person_name(person),
                "ours",
                _words(_person_words(answers, undone.count(person))),
            )
            for person, answers in by_person.items()
        ),
        notes=(_PERSON_NOTE,),
    )


def _setting_words(answers: Sequence[PersonAnswered]) -> Iterator[str]:
    units: dict[tuple[str, ...], dict[tuple[str, int], list[str]]] = defaultdict(dict)
    for one in answers:
        cell = units[one.task, one.setting]
        category = FormAnswer(one.objects, one.values).category
        cell.setdefault((one.split, one.episode), []).append(category)
    asked = [unit for cell in units.values() for unit in cell.values()]
    alphas = [krippendorff_alpha(cell.values()) for cell in units.values()]
    yield str(len({one.person for one in answers}))
    yield str(len(answers))
    yield str(sum(len(unit) > 1 for unit in asked))
    yield _percent(pairwise_agreement(asked))
    yield _mean([alpha for alpha in alphas if alpha is not None])
    yield from _times([one.seconds for one in answers])


def _person_words(answers: Sequence[PersonAnswered], undone: int) -> Iterator[str]:
    items = [one for one in answers if one.kind == "item"]
    checks = [one for one in answers if one.kind == "check"]
    yield str(len(items))
    yield f"{sum(map(_is_right, checks))} of {len(checks)}"
    yield next(_times([one.seconds for one in items]))
    yield f"{sum(one.hidden_s for one in items):.0f}"
    yield str(undone)


def _is_right(one: PersonAnswered) -> bool:
    episode = get_episode(one.task, one.split, one.episode)
    return FormAnswer(one.objects, one.values) == answer_of(episode, episode.goal)


def _times(seconds: Sequence[float]) -> Iterator[str]:
    if not seconds:
        yield from (NOT_APPLICABLE, NOT_APPLICABLE)
        return
    yield f"{statistics.median(seconds):.1f}"
    low, high = np.quantile(seconds, (0.25, 0.75))
    yield f"{low:.1f} to {high:.1f}"


def _percent(share: float | None) -> str:
    return NOT_APPLICABLE if share is None else f"{100 * share:.1f}"


def _mean(values: Sequence[float]) -> str:
    return f"{statistics.fmean(values):.2f}" if values else NOT_APPLICABLE


def _words(texts: Iterable[str]) -> tuple[Entry, ...]:
    return tuple(Entry(word=text) for text in texts)


Unit = Sequence[Hashable]
"""The answers of different people to one question."""


def pairwise_agreement(units: Iterable[Unit]) -> float | None:
    """Return the share of pairs of answers to the same question that are equal; None without one.

    Every question with two answers or more counts the same.
    """
    shares = []
    for unit in units:
        pairs = len(unit) * (len(unit) - 1)
        if pairs:
            shares.append(sum(count * (count - 1) for count in Counter(unit).values()) / pairs)
    return sum(shares) / len(shares) if shares else None


def krippendorff_alpha(units: Iterable[Unit]) -> float | None:
    """Return Krippendorff's alpha of nominal answers.

    1 is perfect agreement, 0 what answers by chance would have that are as frequent as these.
    Questions with one answer do not count (Krippendorff, Content Analysis, 2004, chapter 11).

    Returns:
        None if no question has two answers, or all answers are equal: chance agrees then as well.
    """
    several = [Counter(unit) for unit in units if len(unit) > 1]
    totals: Counter[Hashable] = Counter()
    for unit in several:
        totals.update(unit)
    count = totals.total()
    expected = count * (count - 1) - sum(one * (one - 1) for one in totals.values())
    if not expected:
        return None
    observed = sum(
        (unit.total() ** 2 - sum(one**2 for one in unit.values())) / (unit.total() - 1)
        for unit in several
    )
    return 1 - (count - 1) * observed / expected
