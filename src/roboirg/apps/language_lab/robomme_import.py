"""Make a wording file of RoboMME's sentences: one for each goal of its scenes.

Only one file of RoboMME's repository is loaded, by its path: the one with the function
``get_language_goal``. It gets a stand-in for RoboMME's objects, with the attributes that it reads.
"""

from __future__ import annotations

import json
import runpy
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

from roboirg.core.episode import COLORS, DIFFICULTIES, Goal, describe_goal
from roboirg.core.error_words import one_line
from roboirg.core.errors import InvalidValueError
from roboirg.core.word_pools import ROBOMME_NAME
from roboirg.language.goal_fields import goal_fields
from roboirg.language.scenarios.wording_file import Wordings, check_name, parse_wordings
from roboirg.tasks import Task, all_tasks
from roboirg.tasks.splits.published_episodes import PublishedEpisode, published_episode
from roboirg.tasks.splits.splits import SIZES

FILE = Path("src/robomme/robomme_env/utils/task_goal.py")
FUNCTION = "get_language_goal"

SentenceFunction = Callable[[object, str], object]
"""``get_language_goal(self, env)``, where ``env`` is a task's name."""


def import_robomme(root: Path, name: str = ROBOMME_NAME) -> tuple[str, Wordings]:
    """Return the text and the content of a wording file with RoboMME's sentences.

    Args:
        root: folder of a clone of RoboMME's repository.
        name: of the wordings.

    Raises:
        InvalidValueError: the folder lacks the file, the file cannot be loaded or lacks the
            function, the function does not give one usable sentence for each goal, or the
            sentences are not those of the published evaluation and yet named after it.
    """
    where = "The imported wording file"
    check_name(name, where)
    text = _wording_text(_load_function(root), name)
    return text, parse_wordings(text, where)


def _wording_text(function: SentenceFunction, name: str) -> str:
    """Return the text of a wording file, TOML, with RoboMME's sentence for each goal.

    Each goal has an entry such as ``[[literal]]``, ``task = "PickXtimes"``, ``when = { color =
    "red", repeats = 2 }``, ``text = "Pick up the red cube twice."``. The file is read again by
    `parse_wordings`.

    Args:
        function: RoboMME's, which returns the sentences.
        name: of the wordings.

    Raises:
        InvalidValueError: the function does not give one usable sentence for each goal.
    """
    tasks = all_tasks()
    source = f"The first sentences of {FUNCTION} in RoboMME's repository."
    lines = [
        f"name = {json.dumps(name)}",
        f"source = {json.dumps(source)}",
        f"tasks = {json.dumps(list(tasks))}",
    ]
    for task in tasks.values():
        for goal, sentence in _sentences(function, task).items():
            slots = [f"{slot} = {json.dumps(value)}" for slot, value in goal.slots]
            lines += [
                "",
                "[[literal]]",
                f"task = {json.dumps(task.name)}",
                f"when = {{ {', '.join(slots)} }}",
                f"text = {json.dumps(sentence)}",
            ]
    return "\n".join(lines) + "\n"


def _load_function(root: Path) -> SentenceFunction:
    """Return the function `get_language_goal` of a clone of RoboMME's repository.

    The file with it is executed, as nothing else gives its sentences.

    Raises:
        InvalidValueError: the folder lacks its file, or the file cannot be loaded or lacks it.
    """
    path = root / FILE
    if not path.is_file():
        raise InvalidValueError(
            f"There is no {FILE} in {str(root)!r}; name the folder of a clone of RoboMME's "
            "repository."
        )
    try:
        function = runpy.run_path(str(path)).get(FUNCTION)
    except Exception as error:
        raise InvalidValueError(f"{str(path)!r} cannot be loaded: {one_line(error)}.") from error
    if not callable(function):
        raise InvalidValueError(f"{str(path)!r} has no function {FUNCTION}.")
    return function  # type: ignore[no-any-return]


def _sentences(function: SentenceFunction, task: Task) -> dict[Goal, str]:
    """Return RoboMME's sentence for every goal that the published scenes of a task allow.

    Goals count only in scenes whose own goal has as many fields, since the difficulty decides how
    many picks or colors a goal has.

    Raises:
        InvalidValueError: the function gives two sentences for a goal, or none.
    """
    found: dict[Goal, str] = {}
    for episode in _published_episodes(task):
        field_count = len(goal_fields(episode.goal))
        for goal in task.goals(episode.scene):
            # The difficulty decides how many picks or colors a goal has: others do not occur.
            if len(goal_fields(goal)) != field_count:
                continue
            said = _first_sentence(function, task.name, goal, episode.difficulty)
            if found.setdefault(goal, said) != said:
                raise InvalidValueError(
                    f"RoboMME has two sentences for a goal of {task.name} "
                    f"({describe_goal(goal.as_mapping())}): {found[goal]!r} and {said!r}."
                )
    return found


def _published_episodes(task: Task) -> Iterator[PublishedEpisode]:
    """Yield the episodes of a task whose scenes RoboMME has published, in all splits."""
    for split, size in SIZES.items():
        for index in range(size):
            episode = published_episode(task.name, split, index)
            if episode is not None:
                yield episode


def _first_sentence(function: SentenceFunction, task: str, goal: Goal, difficulty: str) -> str:
    """Return the first sentence that RoboMME's function gives for a goal of a task.

    Args:
        function: RoboMME's ``get_language_goal``.
        task: name.
        goal: to be said.
        difficulty: of the episode, ``hard``; the sentence may depend on it.

    Raises:
        InvalidValueError: the function raises, or does not return sentences.
    """
    words = describe_goal(goal.as_mapping())
    about = f"RoboMME's {FUNCTION}, asked for a goal of {task} ({words}),"
    try:
        said = function(stand_in(goal, difficulty), task)
    except Exception as error:
        raise InvalidValueError(f"{about} raised {one_line(error)}.") from error
    first = said
    if isinstance(said, (list, tuple)) and said:
        first = said[0]
    if not isinstance(first, str):
        raise InvalidValueError(f"{about} returned {said!r}; it must be a list of sentences.")
    return first


_ATTRIBUTES = {
    "color": "target_color_name",
    "repeats": "num_repeats",
    "visit": "stop_time",
    "relation": "target_target_language",
    "placement": "which_in_subset",
}
"""RoboMME's attribute for the value of each slot of ours with a single value."""


def stand_in(goal: Goal, difficulty: str) -> SimpleNamespace:
    """Return a stand-in for RoboMME's task object, with the attributes that its function reads.

    The value of a goal of ours becomes an attribute with RoboMME's name: the color red becomes
    ``target_color_name = "red"``.
    """
    slots = goal.as_mapping()
    task = SimpleNamespace(difficulty=difficulty)
    if "counts" in slots:
        counts = dict(goal.amounts)
        for color in COLORS:
            setattr(task, f"{color}_cubes_target_number", counts.get(color, 0))
    elif "colors" in slots:
        colors = goal.texts("colors")
        others = [color for color in COLORS if color not in colors]
        task.color_names = [*colors, *others]
        task.pick_times = len(colors)
        task.configs = {name: {"pick": len(colors)} for name in DIFFICULTIES}
    for slot, value in slots.items():
        if slot in _ATTRIBUTES:
            setattr(task, _ATTRIBUTES[slot], value)
    # The function may reach the task through wrappers of an environment: here, all are the same.
    task.env = task
    task.unwrapped = task
    return task
