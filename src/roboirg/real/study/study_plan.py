"""The plan of a study: every trial and demonstration, in the order in which they are done.

A block is one arrangement; in it every condition (a policy, told in one setting) is tried once, in
a random order. So whatever drifts (light, grip, the operator) is the same for all conditions, and
comparisons are between neighbors. The seed decides the orders and nothing else.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from roboirg.core.episode import Episode
from roboirg.core.errors import InvalidValueError, RoboIRGError, UnknownNameError
from roboirg.episodes.splits import get_episode
from roboirg.evaluation.plan_parsing import name_and_spec
from roboirg.language.settings import setting_names, settings_of
from roboirg.real.study.counterbalancing import balanced_episodes, kind_of
from roboirg.records.record import DEFAULT_MAX_STEPS, Job
from roboirg.records.store import write_atomically
from roboirg.tasks import get_task

PLAN_FILE = "plan.json"
FINGERPRINT_LENGTH = 12
"""Hexadecimal digits."""

TRIAL_SPLIT = "val"
"""Arrangements of trials: of the three splits the smallest that has all of PickByCount's eight."""
DEMONSTRATION_SPLIT = "train"
DEFAULT_TRIALS = 10
"""Per task, setting and policy (paper)."""
DEFAULT_DEMONSTRATIONS = 50
"""Per task, explicit instructions only (paper)."""
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"


class _StudyModel(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class PlannedTrial(_StudyModel):
    """One trial.

    Attributes:
        name: unique in the plan, and the same whatever the seed. It does not tell the policy's
            name but its letter, so that who sets up and judges need not know it.
        block: number of its block, from 1.
        job: what is played: the identity of its record.
    """

    name: str
    block: int
    job: Job

    @property
    def identity(self) -> Job:
        """The job, whatever makes the policy."""
        return self.job.model_copy(update={"spec": None})

    @property
    def episode(self) -> Episode:
        """The arrangement and what is meant."""
        return get_episode(self.job.task, self.job.split, self.job.episode)


class PlannedDemonstration(_StudyModel):
    """One demonstration for fine-tuning, told in the explicit setting.

    Attributes:
        name: unique in the plan.
        task: its name.
        number: of the episode in the split for demonstrations.
    """

    name: str
    task: str
    number: int

    @property
    def episode(self) -> Episode:
        """The arrangement and what is meant."""
        return get_episode(self.task, DEMONSTRATION_SPLIT, self.number)


class StudyPlan(_StudyModel):
    """All that is to be done, in order.

    Attributes:
        version: of this table of fields.
        seed: of the orders.
        policies: names by letter, A first.
        trials: in order.
        demonstrations: in order.
    """

    version: Literal[1] = 1
    kind: Literal["real"] = "real"
    seed: int
    policies: tuple[str, ...]
    trials: tuple[PlannedTrial, ...]
    demonstrations: tuple[PlannedDemonstration, ...] = ()

    @property
    def fingerprint(self) -> str:
        """Tells this plan from every other."""
        return hashlib.sha256(self.model_dump_json().encode()).hexdigest()[:FINGERPRINT_LENGTH]

    def trial(self, name: str) -> PlannedTrial:
        """The trial of that name.

        Raises:
            UnknownNameError: there is none.
        """
        for trial in self.trials:
            if trial.name == name:
                return trial
        raise UnknownNameError("trial", name, [trial.name for trial in self.trials[:3]] + ["…"])


def make_study(
    policies: Sequence[str],
    *,
    tasks: Sequence[str],
    settings: Sequence[str] | None = None,
    trials: int = DEFAULT_TRIALS,
    demonstrations: int = DEFAULT_DEMONSTRATIONS,
    seed: int = 0,
    split: str = TRIAL_SPLIT,
    max_steps: int = DEFAULT_MAX_STEPS,
) -> StudyPlan:
    """A balanced plan in a random order.

    Args:
        policies: specs, ``NAME=SPEC``, or labels of what is not run by `roboirg real run`.
        tasks: of the real robot.
        settings: in which each arrangement is told; by default all.
        trials: arrangements per task; each policy is tried on each in every setting.
        demonstrations: per task.
        seed: of the orders.
        split: whose episodes the trials are.
        max_steps: control periods of a trial.

    Raises:
        UnknownNameError: a task, setting or split does not exist.
        InvalidValueError: a number is out of range, or a name is given twice.
    """
    named = [name_and_spec(policy) for policy in policies]
    names = [name for name, _ in named]
    settings = setting_names() if settings is None else settings
    _check(names, tasks, settings, trials, demonstrations, seed, max_steps)
    rng = np.random.default_rng(seed)
    chosen = {task: balanced_episodes(task, split, trials) for task in tasks}
    conditions = list(product(settings, range(len(named))))
    planned: list[PlannedTrial] = []
    for block, (task, episode) in enumerate(_blocks(chosen, rng), 1):
        for index in rng.permutation(len(conditions)):
            setting, policy = conditions[index]
            name, spec = named[policy]
            job = Job(
                policy=name,
                spec=None if spec == name else spec,
                task=task,
                split=split,
                episode=episode,
                setting=setting,
                max_steps=max_steps,
            )
            title = f"{task}-{episode:02d}-{setting}-{LETTERS[policy]}"
            planned.append(PlannedTrial(name=title, block=block, job=job))
    return StudyPlan(
        seed=seed,
        policies=tuple(names),
        trials=tuple(planned),
        demonstrations=_demonstrations(tasks, demonstrations, rng),
    )


def write_study(plan: StudyPlan, folder: Path) -> Path:
    """Write ``plan.json``, whole or not at all.

    Raises:
        InvalidValueError: the folder has another plan already.
        StoreError: it cannot be written.
    """
    path = folder / PLAN_FILE
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidValueError(f"Cannot write to {folder}: {error.strerror}.") from error
    if path.exists() and read_study(folder) != plan:
        raise InvalidValueError(
            f"{folder} holds another plan; give the options it was made with, or another --out."
        )
    write_atomically(path, plan.model_dump_json(indent=1) + "\n")
    return path


def read_study(folder: Path) -> StudyPlan:
    """The plan of a folder.

    Raises:
        InvalidValueError: there is none, or it is no plan of a study with a real robot.
    """
    path = folder / PLAN_FILE
    try:
        return StudyPlan.model_validate_json(path.read_bytes())
    except OSError as error:
        raise InvalidValueError(
            f"There is no plan in {folder} ({error.strerror}); make one with roboirg real plan."
        ) from error
    except (ValidationError, RoboIRGError) as error:
        raise InvalidValueError(
            f"{path} is no plan of a study with a real robot; make one with roboirg real plan."
        ) from error


def _blocks(
    chosen: Mapping[str, Sequence[int]], rng: np.random.Generator
) -> Iterator[tuple[str, int]]:
    """Task and episode of each block: tasks take turns, each with its episodes in random order."""
    tasks = list(chosen)
    drawn = {task: rng.permutation(chosen[task]) for task in tasks}
    for turn in range(len(drawn[tasks[0]])):
        for index in rng.permutation(len(tasks)):
            yield tasks[index], int(drawn[tasks[index]][turn])


def _demonstrations(
    tasks: Sequence[str], count: int, rng: np.random.Generator
) -> tuple[PlannedDemonstration, ...]:
    """Tasks take turns, each with its arrangements in a random order."""
    drawn = {
        task: rng.permutation(balanced_episodes(task, DEMONSTRATION_SPLIT, count)) for task in tasks
    }
    return tuple(
        PlannedDemonstration(
            name=f"demo-{task}-{int(drawn[task][turn]):02d}",
            task=task,
            number=int(drawn[task][turn]),
        )
        for turn in range(count)
        for task in tasks
    )


def _check(
    policies: Sequence[str],
    tasks: Sequence[str],
    settings: Sequence[str],
    trials: int,
    demonstrations: int,
    seed: int,
    max_steps: int,
) -> None:
    for kind, names in (("policy", policies), ("task", tasks), ("setting", settings)):
        if not names:
            raise InvalidValueError(f"No {kind} was given.")
        twice = [name for name in names if list(names).count(name) > 1]
        if twice:
            raise InvalidValueError(f"The {kind} {twice[0]!r} is given twice.")
    if len(policies) > len(LETTERS):
        raise InvalidValueError(f"{len(policies)} policies are too many; at most {len(LETTERS)}.")
    for name, value, least in (
        ("trials", trials, 1),
        ("demonstrations", demonstrations, 0),
        ("seed", seed, 0),
        ("max_steps", max_steps, 1),
    ):
        if value < least:
            raise InvalidValueError(f"{name} is {value}; it must be at least {least}.")
    for task in tasks:
        kind_of(task)
        for setting in settings:
            has = settings_of(get_task(task))
            if setting not in has:
                raise UnknownNameError(f"setting of {task}", setting, has)
