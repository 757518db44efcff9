"""Ask RoboMME's repository for the sentence of every goal.

Only one file of it is loaded, by its path: the one with the function ``get_language_goal``. It gets
a stand-in for RoboMME's objects that has the attributes that it reads.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from types import ModuleType, SimpleNamespace

from roboirg.core.episode import COLORS, DIFFICULTIES, Goal
from roboirg.core.errors import InvalidValueError

FILE = Path("src/robomme/robomme_env/utils/task_goal.py")
FUNCTION = "get_language_goal"
_MODULE = "roboirg_robomme_task_goal"

SentenceFunction = Callable[[object, str], object]
"""``get_language_goal(self, env)``, where ``env`` is a task's name."""


class SentenceError(Exception):
    """RoboMME's function gives no usable sentence for a goal; says why."""


def load_function(root: Path) -> SentenceFunction:
    """Load the function from a clone of RoboMME's repository.

    Raises:
        InvalidValueError: the folder lacks the file, or the file cannot be loaded or lacks the
            function.
    """
    path = root / FILE
    if not path.is_file():
        raise InvalidValueError(
            f"There is no {FILE} in {str(root)!r}; name the folder of a clone of RoboMME's "
            "repository."
        )
    function = getattr(_load(path), FUNCTION, None)
    if not callable(function):
        raise InvalidValueError(f"{str(path)!r} has no function {FUNCTION}.")
    return function  # type: ignore[no-any-return]


def _load(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(_MODULE, path)
    if spec is None or spec.loader is None:
        raise InvalidValueError(f"{str(path)!r} is no Python file.")
    module = importlib.util.module_from_spec(spec)
    wrote = sys.dont_write_bytecode
    sys.dont_write_bytecode = True  # the folder is not ours
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise InvalidValueError(
            f"{str(path)!r} cannot be loaded: {type(error).__name__}: {error}."
        ) from error
    finally:
        sys.dont_write_bytecode = wrote
    return module


def ask(function: SentenceFunction, task: str, goal: Goal, difficulties: Iterable[str]) -> str:
    """Return the first sentence for a goal.

    Args:
        function: RoboMME's.
        task: name of the task.
        goal: one of its goals.
        difficulties: those of the scenes that have such goals; all must give the same sentence.

    Raises:
        SentenceError: there is no such sentence.
    """
    said = {_call(function, task, goal, difficulty) for difficulty in difficulties}
    if len(said) > 1:
        raise SentenceError(f"the sentence depends on the difficulty: {' / '.join(sorted(said))}")
    (sentence,) = said
    if not sentence.strip() or set(sentence) & set("{}[]"):
        raise SentenceError(f"{sentence!r} is empty or has brackets")
    if not (sentence.isascii() and sentence.isprintable()):
        raise SentenceError(f"{sentence!r} is not printable ASCII on one line")
    return sentence


def _call(function: SentenceFunction, task: str, goal: Goal, difficulty: str) -> str:
    try:
        said = function(stand_in(goal, difficulty), task)
    except Exception as error:
        raise SentenceError(f"{FUNCTION} raised {type(error).__name__}: {error}") from error
    first = said[0] if isinstance(said, (list, tuple)) and said else said
    if not isinstance(first, str):
        raise SentenceError(f"{FUNCTION} returned {said!r}, not a list of sentences")
    return first


def stand_in(goal: Goal, difficulty: str) -> SimpleNamespace:
    """Return an object with what RoboMME's function reads of a task, for a goal of ours."""
    slots = goal.as_mapping()
    found: dict[str, object] = {"difficulty": difficulty}
    if "counts" in slots:
        counts = dict(zip(goal.texts("colors"), goal.numbers("counts"), strict=True))
        found |= {f"{color}_cubes_target_number": counts.get(color, 0) for color in COLORS}
    elif "colors" in slots:
        colors = goal.texts("colors")
        found["color_names"] = [*colors, *(one for one in COLORS if one not in colors)]
        found["pick_times"] = len(colors)
        found["configs"] = {one: {"pick": len(colors)} for one in DIFFICULTIES}
    names = {
        "color": "target_color_name",
        "repeats": "num_repeats",
        "visit": "stop_time",
        "relation": "target_target_language",
        "placement": "which_in_subset",
    }
    found |= {names[slot]: value for slot, value in slots.items() if slot in names}
    task = SimpleNamespace(**found)
    task.env = task.unwrapped = task
    return task
