"""A study of people as listeners: who is asked what, in which order.

Every person sees every episode once. In which setting follows from a balanced Latin square, so that
as many people as there are settings answer each episode once in each of them: together they are one
seed of the policy ``people``.
"""

from __future__ import annotations

import functools
import itertools
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Literal, NamedTuple

import msgspec
import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from roboirg.apps.people.people_listener import STUDY_FILE, study_content
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import DEFAULT_DELIVERY, InstructionOptions
from roboirg.evaluation.grounding_items.question_set import EpisodeName, ExportRequest
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.records.record import Job
from roboirg.language.settings import EXPLICIT
from roboirg.tasks.splits.splits import SIZES
from roboirg.util.atomic_write import write_atomically

PEOPLE = "people"
"""Name of the policy in records."""
TRAINING: Literal["train"] = "train"
"""Split of practice and checks."""

QuestionKind = Literal["practice", "check", "item"]

CONSENT = """\
You are shown a table with a robot arm, sometimes a short video first, and what was said to the
robot. You say what is meant: you point at things in the picture and choose numbers.

Taking part is voluntary. You may stop at any time by closing the page, and you need give no
reason.

What is stored: your answers, how long each of them took, how often you watched a video, and date
and time. No name, no address and nothing about your browser or computer is stored.
"""
"""Text that a person agrees to, unless the study has one of its own."""


class PersonQuestion(NamedTuple):
    """One question to one person.

    Attributes:
        kind: practice, which is explained afterwards; check, whether the person pays attention; or
            item, which counts.
        job: the episode and its words; of an item the job of the answer's record.
    """

    kind: QuestionKind
    job: Job


class ListeningStudy(BaseModel):
    """What a study asks.

    Attributes:
        plan: episodes and words; its one policy is `PEOPLE`, with as many seeds as needed.
        people: how many take part.
        practice: practice questions for each task.
        checks: attention checks.
        seed: of the order of the episodes, which is the same for all people.
        frames_every: control steps between two frames of a video.
        consent: text that people agree to, paragraphs separated by empty lines.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    plan: Plan
    people: int
    practice: int = 1
    checks: int = 2
    seed: int = 0
    frames_every: int = 4
    consent: str = CONSENT

    def checked(self) -> ListeningStudy:
        """Return this study if it can be carried out.

        Raises:
            InvalidValueError: a number is out of range, or a person would be asked about an
                episode twice.
        """
        for name, least in (
            ("people", 1),
            ("practice", 0),
            ("checks", 0),
            ("frames_every", 1),
            ("seed", 0),
        ):
            if getattr(self, name) < least:
                raise InvalidValueError(
                    f"{name} is {getattr(self, name)}; it must be at least {least}."
                )
        if len(self.plan.forms) > 1 or len(self.plan.stages) > 1:
            raise InvalidValueError("A study has one form and one set of stages.")
        if self.plan.split == TRAINING:
            raise InvalidValueError(
                f"Practice and checks are episodes of the split {TRAINING!r}; choose another split."
            )
        if self.practice + self.checks > SIZES[TRAINING]:
            raise InvalidValueError(
                f"{self.practice} practice questions and {self.checks} checks are more than the "
                f"{SIZES[TRAINING]} episodes they are taken from."
            )
        if not self.consent.strip():
            raise InvalidValueError("The text that people agree to is empty.")
        return self

    def questions(self, place: int) -> tuple[PersonQuestion, ...]:
        """Return the questions of the person at a place, in order.

        Args:
            place: number of people who joined before.
        """
        items = self._items(place)
        checks = self._checks()
        found = [PersonQuestion("practice", job) for job in self._practice()]
        for number, item in enumerate(items, start=1):
            found.append(PersonQuestion("item", item))
            # Evenly spaced, none at the very end.
            due = number * (len(checks) + 1) // len(items)
            before = (number - 1) * (len(checks) + 1) // len(items)
            found += (PersonQuestion("check", job) for job in checks[before:due])
        return tuple(found)

    def export_request(self) -> ExportRequest:
        """Return the dataset with the words and pictures of all questions."""
        plan = self.plan
        episodes = [EpisodeName(task, plan.split, one) for task, one in self._cells]
        training = [*self._practice(), *self._checks()]
        episodes += [EpisodeName(job.task, TRAINING, job.episode) for job in training]
        return ExportRequest(
            episodes=tuple(dict.fromkeys(episodes)),
            settings=tuple(dict.fromkeys((EXPLICIT, *plan.setting_names))),
            forms=plan.forms,
            options=replace(plan.options, stages=plan.stages[0], delivery=DEFAULT_DELIVERY),
            frames_every=self.frames_every,
            wordings_file=plan.wordings,
        )

    @functools.cached_property
    def _cells(self) -> dict[tuple[str, int], list[Job]]:
        """The jobs of each task and episode, one for each setting."""
        plan = self.plan.model_copy(update={"policy_seeds": (0,)})
        cells: dict[tuple[str, int], list[Job]] = {}
        for job in plan.jobs():
            cells.setdefault((job.task, job.episode), []).append(job)
        return cells

    def _items(self, place: int) -> list[Job]:
        cells = list(self._cells.values())
        order = np.random.default_rng(self.seed).permutation(len(cells))
        # Tasks with as many settings share a square, so that each person gets all equally often.
        columns: Counter[int] = Counter()
        found = []
        for jobs in (cells[cell] for cell in order.tolist()):
            found.append(_assign(jobs, place, columns[len(jobs)]))
            columns[len(jobs)] += 1
        return found

    def _practice(self) -> Iterator[Job]:
        for index, task in itertools.product(range(self.practice), self.plan.tasks):
            yield self._training_job(task, index)

    def _checks(self) -> list[Job]:
        tasks = itertools.cycle(self.plan.tasks)
        return [
            self._training_job(task, self.practice + number)
            for number, task in zip(range(self.checks), tasks, strict=False)
        ]

    def _training_job(self, task: str, index: int) -> Job:
        plan = self.plan
        return Job(
            policy=PEOPLE,
            task=task,
            split=TRAINING,
            episode=index,
            options=InstructionOptions(EXPLICIT, wordings=plan.options.wordings),
            wordings_file=plan.wordings,
        )


def _assign(jobs: list[Job], place: int, column: int) -> Job:
    """Return the job of a cell that the person at a place gets as question number `column`."""
    square = balanced_square(len(jobs))
    chosen = [square[one % len(square)][column % len(jobs)] for one in range(place + 1)]
    earlier = chosen[:-1].count(chosen[-1])
    return msgspec.structs.replace(jobs[chosen[-1]], policy_seed=earlier)


def words_of(job: Job) -> tuple[str, str, int, InstructionOptions]:
    """Return what the words of a job depend on, as of an item of the dataset."""
    return job.task, job.split, job.episode, replace(job.column, delivery=DEFAULT_DELIVERY)


def write_listening_study(study: ListeningStudy, folder: Path) -> None:
    """Write a study into its folder, which may hold the same study already.

    Raises:
        InvalidValueError: the folder holds something else, or cannot be written.
    """
    path = folder / STUDY_FILE
    if path.exists():
        if read_listening_study(folder) != study:
            raise InvalidValueError(
                f"{str(folder)!r} holds a study of other questions; give the same options, or "
                "choose another folder."
            )
        return
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InvalidValueError(f"{str(folder)!r} is not an empty folder; choose another one.")
    write_atomically(path, study.model_dump_json(indent=2) + "\n")


def read_listening_study(folder: Path) -> ListeningStudy:
    """Read the study of a folder.

    Raises:
        InvalidValueError: there is none, or it is of another version.
    """
    try:
        return ListeningStudy.model_validate_json(study_content(folder))
    except ValidationError as error:
        raise InvalidValueError(
            f"{folder / STUDY_FILE} is not a study of this version ({error})."
        ) from error


@functools.cache
def balanced_square(conditions: int) -> tuple[tuple[int, ...], ...]:
    """Return the orders of conditions, one row per person.

    Every condition stands once in each row, and in every column equally often; over all rows, each
    condition directly follows each other one equally often. For an even number of conditions there
    are as many rows, for an odd one twice as many, of which the first half is a Latin square too.

    Args:
        conditions: how many there are, at least 1.
    """
    first = [0]
    low, high = 1, conditions - 1
    while low <= high:
        first.append(low)
        if low < high:
            first.append(high)
        low, high = low + 1, high - 1
    rows = [tuple((one + shift) % conditions for one in first) for shift in range(conditions)]
    if conditions % 2 and conditions > 1:
        rows += [row[::-1] for row in rows]
    return tuple(rows)
