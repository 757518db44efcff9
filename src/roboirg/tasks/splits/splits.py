"""The splits: RoboMME's published episodes, and the sampled ones next to them.

The episodes of the benchmark's train, val and test splits are RoboMME's (`published_episodes`).
Sampled are the six that RoboMME's data lacks, the tasks of the suite ``real`` or of another
package, the split ``random`` and private splits. The seed of a sampled episode is ``base + 100 *
index + rejected``, in a private split a keyed hash; its difficulties repeat easy, easy, medium,
hard. The base depends on split and task; `rejected` is the number of seeds passed over: those
without a valid scene and, in the first three splits, those with a setting that cannot be expressed
and those that the oracle does not solve. ``splits.json`` holds these numbers, with a fingerprint of
the episodes of each task that detects changes of scenes; ``scripts/build_splits.py`` writes it.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import json
import operator
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib import resources
from typing import NamedTuple, SupportsIndex

import numpy as np

from roboirg.core.conditions import Fact, facts_of
from roboirg.core.episode import ROBOT, SPLITS, Difficulty, Episode, Goal, Scene, Split, Stage
from roboirg.core.errors import InvalidValueError, SceneRejectedError, check_names, known_name
from roboirg.core.fact_traits import FACT_TRAITS
from roboirg.tasks import Task, get_task
from roboirg.tasks.splits.private_splits import RANDOM, check_salt, is_private, private_seed
from roboirg.tasks.splits.published_episodes import published_episode
from roboirg.tasks.splits.recordings import is_recorded

SIZES: Mapping[Split, int] = {"train": 100, "val": 50, "test": 50, "random": 1_000_000}
CYCLE: tuple[Difficulty, ...] = ("easy", "easy", "medium", "hard")
BASE_SEEDS: Mapping[Split, tuple[int, int]] = {
    "train": (0, 1000),
    "val": (1_000_000, 10_000),
    "test": (500_000, 10_000),
    "random": (10_000_000, 0),
}
"""First seed of a split, and what the task's code adds per unit (train, val, test: RoboMME's)."""
SEED_STRIDE = 100
MAX_REJECTED = SEED_STRIDE - 1
"""Limit of seeds passed over for an episode; the seed after that belongs to the next episode."""
SPLITS_FILE = "splits.json"


class TaskSplits(NamedTuple):
    """Shipped data of the splits of a task.

    Attributes:
        sha256: fingerprint of all its episodes, see `roboirg.tasks.splits.fingerprint`.
        passed_over: numbers of seeds passed over, by sampled episode (``"train/3"``), without
            zeros.
    """

    sha256: str
    passed_over: Mapping[str, int]


def slot_seed(task: Task, split: Split, index: int) -> int:
    """Return the first seed to try for a sampled episode of a public split.

    The next `MAX_REJECTED` seeds also belong to this episode, in case the first ones give no scene.
    """
    base, by_code = BASE_SEEDS[split]
    return base + by_code * task.code + SEED_STRIDE * index


def slot_difficulty(index: int) -> Difficulty:
    """Return the difficulty of sampled episode number `index`; all splits share the cycle.

    Episodes 0 to 3 -> easy, easy, medium, hard; then again.
    """
    return CYCLE[index % len(CYCLE)]


def slot_key(split: Split, index: int) -> str:
    """Return the name of an episode among those of its task, for example ``"test/3"``."""
    return f"{split}/{index}"


def check_split(split: str) -> Split:
    """Return the name as a split whose episodes this process can draw, or raise an error.

    Raises:
        UnknownNameError: there is no such split.
        MissingSaltError: it is private, and its salt is not known here.
    """
    check_salt(split)
    return split if is_private(split) else known_name("split", split, tuple(SIZES))


def split_size(split: str) -> int:
    """Return the number of episodes in a split: ``"test"`` -> 50, a private split -> 1,000,000."""
    checked = check_split(split)
    return SIZES[RANDOM if is_private(checked) else checked]


def check_fixed_split(split: str) -> Split:
    """Return the name as a split of a fixed number of episodes: train, val or test."""
    return known_name("split", split, SPLITS)


def make_episode(
    task_name: str, seed: int, difficulty: Difficulty, split: Split = "random", index: int = 0
) -> Episode:
    """Make the episode of a seed, whether or not it belongs to a split.

    `split` and `index` only label it. Raises SceneRejectedError if the seed gives no scene.
    """
    task = get_task(task_name)
    scene, goal = task.sample(np.random.default_rng(seed), difficulty)
    return assemble_episode(task, seed, difficulty, scene, goal, split=split, index=index)


def assemble_episode(
    task: Task,
    seed: int,
    difficulty: Difficulty,
    scene: Scene,
    goal: Goal,
    *,
    split: Split,
    index: int,
    recorded: bool = False,
) -> Episode:
    """Return the episode of a scene and a goal, with the stages that follow from them.

    `recorded` says that its video is played from a shipped recording. Raises InvalidValueError if
    the task's stages name a fact that can never hold in the scene.
    """
    stages = task.stages(scene, goal)
    demonstration = task.demonstration(scene)
    check_stages(task.name, scene, (*demonstration, *stages))
    return Episode(
        task=task.name,
        split=split,
        index=index,
        seed=seed,
        difficulty=difficulty,
        scene=scene,
        goal=goal,
        stages=stages,
        demonstration=demonstration,
        recorded=recorded,
    )


@functools.cache
def shipped_splits() -> Mapping[str, TaskSplits]:
    """Return the shipped data of the splits, by task."""
    file = resources.files("roboirg.tasks.splits").joinpath(SPLITS_FILE)
    entries = json.loads(file.read_text(encoding="utf-8"))
    return {task: TaskSplits(**entry) for task, entry in entries.items()}


def get_episode(task_name: str, split: str, index: SupportsIndex) -> Episode:
    """Return episode number `index` (from 0) of a split of a task.

    Random episodes, and those of a task that is not in ``splits.json``, such as one of another
    package, use the first seed that gives a scene.

    Raises:
        UnknownNameError: there is no such task or split.
        MissingSaltError: the split is private, and its salt is not known.
        InvalidValueError: the split has no episode of that number.
        SceneRejectedError: no seed of the episode gives a scene.
    """
    task = get_task(task_name)
    checked_split = check_split(split)
    return _episode(task.name, checked_split, _check_index(checked_split, index))


def split_episodes(tasks: Iterable[str], splits: Iterable[Split]) -> Iterator[Episode]:
    """Yield all episodes of tasks in splits: task by task, and for each split by split."""
    for task, split in itertools.product(tasks, splits):
        for index in range(split_size(split)):
            yield get_episode(task, split, index)


def fixed_episode(task: Task, split: Split, index: int, passed_over: Mapping[str, int]) -> Episode:
    """Return an episode of train, val or test: RoboMME's if it is published, else a sampled one.

    `passed_over` has the numbers of seeds passed over by episode, ``{"train/3": 1}``, without
    zeros.
    """
    number = passed_over.get(slot_key(split, index), 0)
    return _published(task, split, index) or _sampled(task, split, index, number)


def _check_index(split: Split, index: SupportsIndex) -> int:
    """Return a number as that of an episode of a split; True and 1.0 are none.

    Accepted is all that can stand in an index, also NumPy's integers. Raises InvalidValueError.
    """
    size = split_size(split)
    number = -1  # is refused below, as any index that is no whole number
    if not isinstance(index, bool):
        with contextlib.suppress(TypeError):
            number = operator.index(index)
    if not 0 <= number < size:
        raise InvalidValueError(
            f"There is no episode {index!r}: split {split!r} has episodes 0 to {size - 1}."
        )
    return number


@functools.lru_cache(maxsize=4096)
def _episode(task_name: str, split: Split, index: int) -> Episode:
    """Return an episode: RoboMME's if it has published it, else from the first seed that works.

    Which seed that is, is shipped for the fixed splits of our tasks; else it is tried out.
    """
    task = get_task(task_name)
    shipped = shipped_splits().get(task_name)
    if shipped is not None and split in SPLITS:
        return fixed_episode(task, split, index, shipped.passed_over)
    for passed_over in range(MAX_REJECTED):
        with contextlib.suppress(SceneRejectedError):
            return _sampled(task, split, index, passed_over)
    return _sampled(task, split, index, MAX_REJECTED)  # raises the error of the last seed


def _published(task: Task, split: Split, index: int) -> Episode | None:
    """Return an episode that RoboMME has published; None if it has not published this one."""
    found = published_episode(task.name, split, index)
    if found is None:
        return None
    recorded = is_recorded(task.name, split, index)
    return assemble_episode(task, *found, split=split, index=index, recorded=recorded)


def _sampled(task: Task, split: Split, index: int, passed_over: int) -> Episode:
    """Return a sampled episode of a split, given the number of seeds passed over for it."""
    if is_private(split):
        seed = private_seed(task.name, split, index, passed_over)
    else:
        seed = slot_seed(task, split, index) + passed_over
    return make_episode(task.name, seed, slot_difficulty(index), split, index)


def check_stages(task: str, scene: Scene, stages: Iterable[Stage]) -> None:
    """Raise InvalidValueError if stages expect or forbid a fact that cannot hold in a scene.

    A task that expects *picked button* has a mistake, which no policy could reveal.
    """
    kinds = {item.name: item.kind for item in scene.objects}
    kinds[ROBOT] = ROBOT
    for fact in _facts_in(stages):
        check_names("kind of fact", [fact.kind], FACT_TRAITS)
        problem = _problem_of(fact, kinds)
        if problem is not None:
            raise InvalidValueError(f"{task}: {fact!r} can never hold: {problem}.")


def _facts_in(stages: Iterable[Stage]) -> Iterator[Fact]:
    """Yield all facts that some stages expect or forbid, stage by stage."""
    for stage in stages:
        for condition in (stage.expects, *stage.forbids):
            yield from facts_of(condition)


def _problem_of(fact: Fact, kinds: Mapping[str, str]) -> str | None:
    """Return why a fact can never hold, given the kind of each object; None if it can.

    *placed cube_red* without a place -> *it needs a place, which is a target or a site*.
    """
    traits = FACT_TRAITS[fact.kind]
    problem = _name_problem(fact.subject, traits.subjects, kinds)
    if fact.place is None:
        if traits.places:
            return f"it needs a place, which is a {' or a '.join(traits.places)}"
        return problem
    if not traits.places:
        return f"{fact.kind} has no place"
    return problem or _name_problem(fact.place, traits.places, kinds)


def _name_problem(name: str, fitting: Sequence[str], kinds: Mapping[str, str]) -> str | None:
    """Return why an object of a name is none of the fitting kinds; None if it is.

    `kinds` has the kind of each object by name. ``"button"``, ``("cube", "tape")`` -> *'button' is
    a button, not a cube or a tape*.
    """
    if name not in kinds:
        return f"the scene has no {name!r}; it has {', '.join(kinds)}"
    if kinds[name] not in fitting:
        return f"{name!r} is a {kinds[name]}, not a {' or a '.join(fitting)}"
    return None
