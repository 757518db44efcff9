"""The plan of a study: all trials and demonstrations in order.

A block is one arrangement. It has one trial of every condition (a policy and a setting), in a
random order. So drift (light, grip, the operator) affects all conditions equally, and comparisons
are between neighbors. The seed decides the orders and nothing else.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from roboirg.apps.real.study.counterbalancing import counterbalanced_episodes, target_kind
from roboirg.core.episode import Episode
from roboirg.core.errors import InvalidValueError, RoboIRGError, UnknownNameError, check_names
from roboirg.core.field_types import MOST_WHOLE, check_policy_name, check_whole
from roboirg.core.instruction_options import InstructionOptions, identifying
from roboirg.core.policy_ref import unknown_policy
from roboirg.evaluation.plan.option_parsing import name_and_spec
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.play.job_instruction import instruct_job
from roboirg.evaluation.records.record import Job
from roboirg.language import instruct
from roboirg.language.settings import plain_settings, settings_of
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.atomic_write import write_atomically
from roboirg.util.random_draws import shuffled
from roboirg.util.short_hash import short_hash

PLAN_FILE = "plan.json"
TRIAL_SPLIT = "val"
"""The smallest of the three splits with all eight arrangements of PickByCount."""
DEMONSTRATION_SPLIT = "train"
DEFAULT_TRIALS = 10
"""Trials per task, setting and policy (paper)."""
DEFAULT_DEMONSTRATIONS = 50
"""Demonstrations per task, with explicit instructions only (paper)."""
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"


class PlannedTrial(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One trial.

    Attributes:
        name: unique in the plan and independent of the seed. It holds the policy's letter instead
            of its name, so that the operator can be blind to the policy.
        block: number of its block, from 1.
        job: to play; it identifies the trial's record.
    """

    name: str
    block: int
    job: Job

    @property
    def identity(self) -> Job:
        """The job without the policy's spec."""
        return msgspec.structs.replace(self.job, ref=None)

    @property
    def episode(self) -> Episode:
        """The arrangement and the goal."""
        return get_episode(self.job.task, self.job.split, self.job.episode)

    @property
    def turns(self) -> tuple[str, ...]:
        """The utterances in the order in which they are spoken."""
        return instruct_job(self.job).turns

    @property
    def meaning(self) -> str:
        """The command in explicit words, for the operator who judges the trial."""
        return instruct(self.episode).command


class PlannedDemonstration(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One demonstration for fine-tuning, in the explicit setting.

    Attributes:
        name: unique in the plan.
        task: name of the task.
        number: of the episode in the split of demonstrations.
    """

    name: str
    task: str
    number: int

    @property
    def episode(self) -> Episode:
        """The arrangement and the goal."""
        return get_episode(self.task, DEMONSTRATION_SPLIT, self.number)

    @property
    def turns(self) -> tuple[str, ...]:
        """The utterances, which are explicit."""
        return instruct(self.episode).turns


class StudyPlan(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All trials and demonstrations of a study, in order.

    Attributes:
        version: of the format.
        seed: of the orders.
        policies: names in the order of their letters, A first.
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
    def twin_plans(self) -> dict[str, Plan]:
        """For each task the plan with which ``roboirg run`` plays its trials in simulation."""
        policies = {one.job.policy: one.job.ref for one in self.trials if one.job.ref is not None}
        jobs: dict[str, list[Job]] = {}
        for trial in self.trials:
            jobs.setdefault(trial.job.task, []).append(trial.job)
        return {
            task: Plan(
                policies=tuple(policies[name] for name in sorted(policies)),
                tasks=(task,),
                settings=tuple(sorted({job.setting for job in own})),
                split=TRIAL_SPLIT,
                episodes=tuple(sorted({job.episode for job in own})),
            )
            for task, own in jobs.items()
        }

    @property
    def fingerprint(self) -> str:
        """Digest that identifies the plan."""
        written = msgspec.to_builtins(self)
        for one, trial in zip(written["trials"], self.trials, strict=True):
            one["job"]["options"] = identifying(trial.job.options)
            del one["job"]["ref"]["makeup"]  # which plans did not have
        return short_hash(msgspec.json.encode(written))

    def trial(self, name: str) -> PlannedTrial:
        """Return the trial of that name.

        Raises:
            UnknownNameError: the plan has no such trial.
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
) -> StudyPlan:
    """Return a balanced plan in a random order.

    Args:
        policies: specs, ``NAME=SPEC``, or labels of policies that other software runs.
        tasks: for a real robot.
        settings: of the instructions; None for all settings that the tasks share.
        trials: arrangements per task; each policy meets each of them in every setting.
        demonstrations: per task.
        seed: of the orders.
    """
    named = [name_and_spec(policy) for policy in policies]
    names = [name for name, _ in named]
    settings = _shared_settings(tasks) if settings is None else settings
    _check(names, tasks, settings, trials, demonstrations, seed)
    rng = np.random.default_rng(seed)
    chosen = {task: counterbalanced_episodes(task, TRIAL_SPLIT, trials) for task in tasks}
    conditions = list(product(settings, range(len(named))))
    planned: list[PlannedTrial] = []
    for block, (task, episode) in enumerate(_blocks(chosen, rng), 1):
        for setting, policy in shuffled(rng, conditions):
            name, spec = named[policy]
            job = Job(
                policy=name,
                # Unread, as it may be a label of what other software runs.
                ref=replace(unknown_policy(name), spec=spec),
                task=task,
                split=TRIAL_SPLIT,
                episode=episode,
                options=InstructionOptions(setting),
            )
            trial_name = f"{task}-{episode:02d}-{setting}-{LETTERS[policy]}"
            planned.append(PlannedTrial(name=trial_name, block=block, job=job))
    return StudyPlan(
        seed=seed,
        policies=tuple(names),
        trials=tuple(planned),
        demonstrations=_demonstrations(tasks, demonstrations, rng),
    )


def write_study(plan: StudyPlan, folder: Path) -> Path:
    """Write ``plan.json`` atomically; returns its path.

    Raises:
        InvalidValueError: the folder holds another plan, or the file cannot be written.
    """
    path = folder / PLAN_FILE
    if path.exists() and read_study(folder) != plan:
        raise InvalidValueError(
            f"{folder} holds another plan; repeat its options, or choose another --out."
        )
    write_atomically(path, msgspec.json.format(msgspec.json.encode(plan), indent=1).decode() + "\n")
    return path


def read_study(folder: Path) -> StudyPlan:
    """Read the plan of a folder.

    Raises:
        InvalidValueError: the folder has no plan, or the plan is not for a real robot.
    """
    path = folder / PLAN_FILE
    try:
        return msgspec.json.decode(path.read_bytes(), type=StudyPlan)
    except OSError as error:
        raise InvalidValueError(
            f"There is no plan in {folder} ({error.strerror}); make one with roboirg real plan."
        ) from error
    except (msgspec.DecodeError, RoboIRGError) as error:
        raise InvalidValueError(
            f"{path} is not the plan of a real-robot study; make one with roboirg real plan."
        ) from error


def _blocks(
    chosen: Mapping[str, Sequence[int]], rng: np.random.Generator
) -> Iterator[tuple[str, int]]:
    """Yield the task and episode of each block: tasks alternate, their episodes in random order."""
    tasks = list(chosen)
    drawn = {task: rng.permutation(chosen[task]) for task in tasks}
    for position in range(len(drawn[tasks[0]])):
        for task in shuffled(rng, tasks):
            yield task, int(drawn[task][position])


def _demonstrations(
    tasks: Sequence[str], count: int, rng: np.random.Generator
) -> tuple[PlannedDemonstration, ...]:
    """Return the demonstrations: tasks alternate, their episodes in random order."""
    drawn = {
        task: rng.permutation(counterbalanced_episodes(task, DEMONSTRATION_SPLIT, count))
        for task in tasks
    }
    numbered = [(task, int(drawn[task][index])) for index in range(count) for task in tasks]
    return tuple(
        PlannedDemonstration(name=f"demo-{task}-{number:02d}", task=task, number=number)
        for task, number in numbered
    )


def _shared_settings(tasks: Sequence[str]) -> tuple[str, ...]:
    """Return the settings that all tasks have, in the registry's order."""
    available = [settings_of(get_task(task)) for task in tasks]
    return tuple(name for name in plain_settings() if all(name in names for names in available))


def _check(
    policies: Sequence[str],
    tasks: Sequence[str],
    settings: Sequence[str],
    trials: int,
    demonstrations: int,
    seed: int,
) -> None:
    for kind, names in (("policy", policies), ("task", tasks), ("setting", settings)):
        if not names:
            raise InvalidValueError(f"No {kind} was given.")
        repeated = [name for name in names if list(names).count(name) > 1]
        if repeated:
            raise InvalidValueError(f"The {kind} {repeated[0]!r} is given twice.")
    if len(policies) > len(LETTERS):
        raise InvalidValueError(f"{len(policies)} policies are too many; at most {len(LETTERS)}.")
    check_whole("trials", trials)
    check_whole("demonstrations", demonstrations, least=0)
    check_whole("seed", seed, least=0, most=MOST_WHOLE)
    for policy in policies:
        check_policy_name(policy)
    for task in tasks:
        target_kind(task)
        available = settings_of(get_task(task))
        check_names(f"setting of {task}", settings, available)
