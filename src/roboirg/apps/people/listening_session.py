"""The people of a study: where each of them is, and what they answer.

Nothing is kept in memory that is not on the disk, so a server that was killed goes on where it was.
"""

from __future__ import annotations

import datetime as dt
import math
import secrets
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from roboirg.apps.people.answer_form import FormAnswer, answer_of, checked_answer, goal_of
from roboirg.apps.people.listener_answers import (
    AnswerLog,
    AnswerUndone,
    PersonAnswered,
    PersonJoined,
    standing_answers,
)
from roboirg.apps.people.listening_study import PersonQuestion, read_listening_study, words_of
from roboirg.apps.people.question_view import PersonView, view_question
from roboirg.core.episode import Episode
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.grounding_items.grounding_item import ITEMS_FILE, GroundingItem, read_items
from roboirg.evaluation.grounding_items.question_set import EpisodeName, read_media
from roboirg.language.wordings.wording_store import open_wordings
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.shortcuts.command_chance import is_right
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.short_hash import short_hash

QUESTIONS = "questions"
"""Folder of the dataset with words and pictures."""
_CODE_LETTERS = "23456789abcdefghjkmnpqrstuvwxyz"
_CODE_LENGTH = 8


class OutOfDateError(InvalidValueError):
    """The page shows another question than the one that is asked."""


class ListeningSession:
    """Asks people and stores what they answer; for use by several threads.

    Args:
        folder: of the study.
        people: how many may take part, if not as many as planned.

    Attributes:
        study: what is asked.

    Raises:
        InvalidValueError: the folder holds no study, or its pictures are missing.
        StoreError: another process serves the study, or the answers cannot be read.
    """

    def __init__(self, folder: Path, people: int | None = None) -> None:
        self.study = read_listening_study(folder)
        self._most = self.study.people if people is None else people
        self.questions_folder = folder / QUESTIONS
        if self.study.plan.wordings is not None:
            open_wordings(self.study.plan.wordings, self.study.plan.options.wordings)
        if not (self.questions_folder / ITEMS_FILE).exists():
            raise InvalidValueError(
                f"The study {str(folder)!r} has no pictures yet; run roboirg listen plan again."
            )
        self._items: dict[object, GroundingItem] = {
            (one.task, one.split, one.episode, one.options): one
            for one in read_items(self.questions_folder)
        }
        self._asked: dict[int, tuple[PersonQuestion, ...]] = {}
        self._lock = threading.Lock()
        self._log = AnswerLog(folder)
        self._people = {
            one.code: one.person for one in self._log.events if isinstance(one, PersonJoined)
        }
        self._answers: dict[int, dict[int, PersonAnswered]] = {}
        for one in standing_answers(self._log.events):
            self._answers.setdefault(one.person, {})[one.number] = one

    def close(self) -> None:
        """Close the file of answers."""
        self._log.close()

    def join(self) -> str:
        """Return the code of a new person, who has agreed to take part.

        Raises:
            InvalidValueError: the study has all its people.
            StoreError: the answers cannot be written.
        """
        with self._lock:
            person = len(self._people) + 1
            if person > self._most:
                raise InvalidValueError("This study has all the people it needs. Thank you!")
            code = "".join(secrets.choice(_CODE_LETTERS) for _ in range(_CODE_LENGTH))
            consent = short_hash(self.study.consent)
            self._log.append(PersonJoined(person=person, code=code, consent=consent, at=_now()))
            self._people[code] = person
            return code

    def state(self, code: str) -> dict[str, Any]:
        """Return what the page of a person shows now.

        Raises:
            InvalidValueError: no person has this code.
        """
        with self._lock:
            person = self._person(code)
            number, questions = self._current(person), self._questions(person)
            can_undo = number > 1 and questions[number - 2].kind != "practice"
            if number > len(questions):
                return {"state": "done", "code": code, "number": number, "undo": can_undo}
            practice = sum(one.kind == "practice" for one in questions)
            is_practice = number <= practice
            return {
                "state": "question",
                "code": code,
                "number": number,
                "practice": is_practice,
                "place": number if is_practice else number - practice,
                "total": practice if is_practice else len(questions) - practice,
                "undo": can_undo,
                **self._view(questions[number - 1]).shown,
            }

    def answer(self, code: str, number: int, body: Mapping[str, Any]) -> dict[str, Any]:
        """Store an answer; return what the person sees next: after practice, what was meant.

        An answer that was stored already, and whose reply got lost, is not stored again.

        Args:
            code: of the person.
            number: of the question.
            body: ``objects`` (places in the list of things), ``values``, ``seconds``, ``hidden_s``,
                ``plays``.

        Raises:
            OutOfDateError: another question is asked now.
            InvalidValueError: it does not fill the form, or no person has this code.
            StoreError: it cannot be written.
        """
        with self._lock:
            person = self._person(code)
            questions = self._questions(person)
            given = self._answers.get(person, {}).get(number)
            if not 1 <= number <= len(questions) or (
                number != self._current(person) and given is None
            ):
                raise OutOfDateError("This page is out of date.")
            question = questions[number - 1]
            episode, view = _episode(question), self._view(question)
            answer = checked_answer(
                episode, _names(view, body.get("objects")), _mapping(body.get("values"))
            )
            if given is not None and FormAnswer(given.objects, given.values) != answer:
                raise OutOfDateError("This question has already been answered.")
            if given is None:
                self._store(person, number, question, answer, body)
            if question.kind != "practice":
                return {}
            return _explain(episode, view, answer)

    def undo(self, code: str, number: int) -> dict[str, Any]:
        """Take back the newest answer; return what the person sees next, which is nothing.

        Args:
            code: of the person.
            number: of the question that is answered next.

        Raises:
            OutOfDateError: another question is asked now, or there is nothing to take back.
            InvalidValueError: no person has this code.
            StoreError: this cannot be written.
        """
        with self._lock:
            person = self._person(code)
            questions = self._questions(person)
            if number != self._current(person) or number < 2:  # noqa: PLR2004 - the second one
                raise OutOfDateError("This page is out of date.")
            if questions[number - 2].kind == "practice":
                raise OutOfDateError("Practice cannot be answered again.")
            self._log.append(AnswerUndone(person=person, number=number - 1, at=_now()))
            del self._answers[person][number - 1]
            return {}

    def _store(
        self,
        person: int,
        number: int,
        question: PersonQuestion,
        answer: FormAnswer,
        body: Mapping[str, Any],
    ) -> None:
        job, episode = question.job, _episode(question)
        goal = goal_of(episode, answer)
        event = PersonAnswered(
            person=person,
            number=number,
            kind=question.kind,
            task=job.task,
            split=job.split,
            episode=job.episode,
            setting=job.setting,
            form=job.form,
            policy_seed=job.policy_seed,
            objects=answer.objects,
            values=dict(answer.values),
            goal=None if goal is None else goal_schema(job.task).answers[goal],
            seconds=_seconds(body.get("seconds")),
            hidden_s=_seconds(body.get("hidden_s", 0)),
            plays=int(_seconds(body.get("plays", 0))),
            at=_now(),
        )
        self._log.append(event)
        self._answers.setdefault(person, {})[number] = event

    def _person(self, code: str) -> int:
        if code not in self._people:
            raise InvalidValueError("This code does not belong to this study.")
        return self._people[code]

    def _questions(self, person: int) -> tuple[PersonQuestion, ...]:
        if person not in self._asked:
            self._asked[person] = self.study.questions(person - 1)
        return self._asked[person]

    def _current(self, person: int) -> int:
        """Return the number of the first question without an answer, from 1."""
        answered = self._answers.get(person, {})
        return next(one for one in range(1, len(answered) + 2) if one not in answered)

    def _view(self, question: PersonQuestion) -> PersonView:
        job = question.job
        name = EpisodeName(job.task, job.split, job.episode)
        item, media = self._items.get(words_of(job)), read_media(self.questions_folder, name)
        if item is None or media is None:
            raise InvalidValueError(
                f"The pictures of {name} are missing; run roboirg listen plan again."
            )
        return view_question(job, _episode(question), item, media)


def _episode(question: PersonQuestion) -> Episode:
    return get_episode(question.job.task, question.job.split, question.job.episode)


def _explain(episode: Episode, view: PersonView, answer: FormAnswer) -> dict[str, Any]:
    """Return whether a practice answer is right, and what was meant."""
    goal, right = goal_of(episode, answer), answer_of(episode, episode.goal)
    return {
        "right": goal is not None and is_right(goal, episode),
        "objects": [view.things.index(one) for one in right.objects if one in view.things],
        "values": dict(right.values),
    }


def _names(view: PersonView, places: object) -> Sequence[str]:
    """Return the names of the things at places in the list of things."""
    if not isinstance(places, list) or not all(
        type(one) is int and 0 <= one < len(view.things) for one in places
    ):
        raise InvalidValueError("The answer points at things that are not there.")
    return [view.things[one] for one in places]


def _mapping(values: object) -> Mapping[str, object]:
    if not isinstance(values, dict):
        raise InvalidValueError("The answer has no values.")
    return values


def _seconds(value: object) -> float:
    """Return a measured number; 0 for what is none."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return 0.0
    return round(max(0.0, float(value)), 3)


def _now() -> str:
    return dt.datetime.now(dt.UTC).isoformat(timespec="seconds")
