"""The plan of a study: all trials and demonstrations in order.

A block is one arrangement. It has one trial of every condition (a policy and a setting), in a
random order. So drift (light, grip, the operator) affects all conditions equally, and comparisons
are between neighbors. The seed decides the orders and nothing else.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Literal, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from roboirg.apps.real.study.counterbalancing import counterbalanced_episodes, target_kind
from roboirg.core.episode import Episode
from roboirg.core.errors import InvalidValueError, RoboIRGError, UnknownNameError, check_names
from roboirg.core.field_types import MOST_WHOLE, check_policy_name, check_whole
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.policy_ref import PolicyRef, unknown_policy
from roboirg.language import instruct
from roboirg.language.settings import plain_settings, settings_of
from roboirg.records.record import Job
from roboirg.runs.job_instruction import instruct_job
from roboirg.runs.plan.option_parsing import name_and_spec
from roboirg.runs.plan.plan import Plan
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.atomic_write import write_atomically
from roboirg.util.random_draws import shuffled
from roboirg.util.regular_file import read_regular
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
        """For each task the plan with which ``roboirg run`` plays its trials in simulation.

        It has the policies, settings and episodes of the task's trials, sorted.
        """
        jobs: dict[str, list[Job]] = {}
        for trial in self.trials:
            jobs.setdefault(trial.job.task, []).append(trial.job)
        policies = self._policy_refs()
        plans = {}
        for task, of_task in jobs.items():
            settings = {job.setting for job in of_task}
            episodes = {job.episode for job in of_task}
            plans[task] = Plan(
                policies=policies,
                tasks=(task,),
                settings=tuple(sorted(settings)),
                split=TRIAL_SPLIT,
                episodes=tuple(sorted(episodes)),
            )
        return plans

    def _policy_refs(self) -> tuple[PolicyRef, ...]:
        """Return how the policies are made, in the order of their names."""
        refs = {}
        for trial in self.trials:
            if trial.job.ref is not None:
                refs[trial.job.policy] = trial.job.ref
        return tuple(refs[name] for name in sorted(refs))

    @property
    def fingerprint(self) -> str:
        """Digest that identifies the plan."""
        return short_hash(msgspec.json.encode(self))

    def trial(self, name: str) -> PlannedTrial:
        """Return the trial of that name.

        Raises:
            UnknownNameError: the plan has no such trial.
        """
        for trial in self.trials:
            if trial.name == name:
                return trial
        examples = [trial.name for trial in self.trials[:3]]
        raise UnknownNameError("trial", name, [*examples, "…"])


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

    The same arguments give the same plan: blocks and the orders of their trials are drawn in turns,
    then the demonstrations.

    Args:
        policies: specs, ``NAME=SPEC``, or labels of policies that other software runs.
        tasks: for a real robot.
        settings: of the instructions; None for all settings that the tasks share.
        trials: arrangements per task; each policy meets each of them in every setting.
        demonstrations: per task.
        seed: of the orders.

    Raises:
        InvalidValueError: a name is missing, unknown or given twice, or a number is out of range.
    """
    refs = [_planned_policy(policy) for policy in policies]
    names = tuple(ref.name for ref in refs)
    if settings is None:
        settings = _shared_settings(tasks)
    _check_each_once(names, tasks, settings)
    check_whole("trials", trials)
    check_whole("demonstrations", demonstrations, least=0)
    check_whole("seed", seed, least=0, most=MOST_WHOLE)
    _check_known(names, tasks, settings)

    rng = np.random.default_rng(seed)
    blocks = _blocks(tasks, trials, rng)  # drawn in turns with the orders of their trials
    return StudyPlan(
        seed=seed,
        policies=names,
        trials=_trials(blocks, settings, refs, rng),
        demonstrations=_demonstrations(tasks, demonstrations, rng),
    )


def _planned_policy(text: str) -> PolicyRef:
    """Return the policy that a spec, NAME=SPEC or a label names; nothing of it is looked up."""
    name, spec = name_and_spec(text)
    return replace(unknown_policy(name), spec=spec)


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
        return msgspec.json.decode(read_regular(path), type=StudyPlan)
    except OSError as error:
        raise InvalidValueError(
            f"There is no plan in {folder} ({error.strerror}); make one with roboirg real plan."
        ) from error
    except (msgspec.DecodeError, RoboIRGError) as error:
        raise InvalidValueError(
            f"{path} is not the plan of a real-robot study; make one with roboirg real plan."
        ) from error


class _Block(NamedTuple):
    """An arrangement: a task, and the number of one of its episodes."""

    task: str
    episode: int


def _shuffled_episodes(
    tasks: Sequence[str], split: str, count: int, rng: np.random.Generator
) -> dict[str, NDArray[np.intp]]:
    """Return balanced episodes of each task in a random order; the tasks are drawn in turn."""
    episodes = {}
    for task in tasks:
        episodes[task] = rng.permutation(counterbalanced_episodes(task, split, count))
    return episodes


def _blocks(tasks: Sequence[str], trials: int, rng: np.random.Generator) -> Iterator[_Block]:
    """Yield the blocks, one arrangement each: tasks alternate, their episodes in random order.

    A generator on purpose: `_trials` draws from the same `rng` between two blocks, so making it a
    list changes all plans.
    """
    episodes = _shuffled_episodes(tasks, TRIAL_SPLIT, trials, rng)
    for position in range(trials):
        for task in shuffled(rng, list(tasks)):
            yield _Block(task, int(episodes[task][position]))


def _trials(
    blocks: Iterable[_Block],
    settings: Sequence[str],
    refs: Sequence[PolicyRef],
    rng: np.random.Generator,
) -> tuple[PlannedTrial, ...]:
    """Return a trial of each policy in each setting for every block, in a random order there.

    Drawing is lazy: the next block is drawn after the order of the trials of the one before. The
    policies are unread, as they may be labels of what other software runs.
    """
    conditions = list(product(settings, range(len(refs))))
    planned = []
    for number, block in enumerate(blocks, 1):
        for setting, policy in shuffled(rng, conditions):
            job = Job(
                policy=refs[policy].name,
                ref=refs[policy],
                task=block.task,
                split=TRIAL_SPLIT,
                episode=block.episode,
                options=InstructionOptions(setting),
            )
            name = f"{block.task}-{block.episode:02d}-{setting}-{LETTERS[policy]}"
            planned.append(PlannedTrial(name=name, block=number, job=job))
    return tuple(planned)


def _demonstrations(
    tasks: Sequence[str], count: int, rng: np.random.Generator
) -> tuple[PlannedDemonstration, ...]:
    """Return the demonstrations: tasks alternate, their episodes in random order.

    Draws one order for each task, in the order of `tasks`; `count` are those of each task.
    """
    episodes = _shuffled_episodes(tasks, DEMONSTRATION_SPLIT, count, rng)
    planned = []
    for position in range(count):
        for task in tasks:
            number = int(episodes[task][position])
            name = f"demo-{task}-{number:02d}"
            planned.append(PlannedDemonstration(name=name, task=task, number=number))
    return tuple(planned)


def _shared_settings(tasks: Sequence[str]) -> tuple[str, ...]:
    """Return the settings that all tasks have, in the registry's order."""
    shared = list(plain_settings())
    for task in tasks:
        available = settings_of(get_task(task))
        shared = [setting for setting in shared if setting in available]
    return tuple(shared)


def _check_each_once(
    policies: Sequence[str], tasks: Sequence[str], settings: Sequence[str]
) -> None:
    """Check that there are names of each kind, each once, and a letter for each policy.

    Raises:
        InvalidValueError: a kind has none, a name is given twice, or there are over 26 policies.
    """
    for kind, names in (("policy", policies), ("task", tasks), ("setting", settings)):
        if not names:
            raise InvalidValueError(f"No {kind} was given.")
        counts = Counter(names)
        for name in names:
            if counts[name] > 1:
                raise InvalidValueError(f"The {kind} {name!r} is given twice.")
    if len(policies) > len(LETTERS):
        raise InvalidValueError(f"{len(policies)} policies are too many; at most {len(LETTERS)}.")


def _check_known(policies: Sequence[str], tasks: Sequence[str], settings: Sequence[str]) -> None:
    """Check that names may be those of policies, and that tasks are real and have the settings."""
    for policy in policies:
        check_policy_name(policy)
    for task in tasks:
        target_kind(task)
        check_names(f"setting of {task}", settings, settings_of(get_task(task)))
