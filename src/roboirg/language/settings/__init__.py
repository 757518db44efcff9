"""The settings of the language: one file each, or installed with another package."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence

from roboirg.core.errors import InvalidValueError, check_names
from roboirg.language.instruction import FORMS
from roboirg.language.settings.setting import Setting
from roboirg.tasks import Task, every_task
from roboirg.util.discovery import discover

__all__ = [
    "ACCEPTANCE_SETTINGS",
    "EXPLICIT",
    "SETTING_GROUPS",
    "all_settings",
    "check_named_settings",
    "expand_settings",
    "find_settings",
    "get_setting",
    "plain_settings",
    "setting_names",
    "settings_of",
]

EXPLICIT = "explicit"
"""The setting with which every other one is compared."""

ACCEPTANCE_SETTINGS = ("explicit", "direct", "reasoning", "contextual", "spatial")
"""Settings that must be able to express an episode for its seed to be accepted into a split.

Frozen: a new setting must not change which episodes the splits hold, or older results could no
longer be compared. A new setting may refuse some of these episodes instead.
"""


@functools.cache
def all_settings() -> Mapping[str, Setting]:
    """Return every setting by name, explicit first."""
    found = discover(__name__, "SETTING", Setting, "roboirg.settings")
    in_order = sorted(found.values(), key=lambda setting: (setting.order, setting.name))
    return {setting.name: setting for setting in in_order}


def setting_names() -> tuple[str, ...]:
    """Return the names of all settings, explicit first: ``("explicit", "direct", …)``."""
    return tuple(all_settings())


def plain_settings(task: Task | None = None) -> tuple[str, ...]:
    """Return the names of the settings that the word ``all`` means: all but the harder ones.

    With a task only the settings that it has, else of every task.
    """
    names = setting_names() if task is None else settings_of(task)
    return tuple(name for name in names if all_settings()[name].plain is None)


SETTING_GROUPS = {"all": plain_settings, "every": setting_names}
"""Words for several settings, and what gives their names."""


def expand_settings(words: Iterable[str]) -> tuple[str, ...]:
    """Return names of settings, with words for groups, ``all``, replaced by the names they mean.

    Each name stands there once, those from groups first. Names are not checked.
    """
    names: list[str] = []
    others = []
    for word in words:
        if word.lower() in SETTING_GROUPS:
            names += SETTING_GROUPS[word.lower()]()
        else:
            others.append(word)
    return tuple(dict.fromkeys([*names, *others]))


def find_settings(words: Iterable[str]) -> tuple[str, ...]:
    """Return the settings meant by names and by words of `SETTING_GROUPS`.

    Raises:
        UnknownNameError: a word is neither.
    """
    names = expand_settings(words)
    for name in names:
        _check(name, *SETTING_GROUPS)
    return names


def check_named_settings(words: Sequence[str], tasks: Sequence[str]) -> None:
    """Raise if a task lacks a setting that a list names; say which have it, and what the rest is.

    Where a word for several, such as ``all``, is in the list, it means what each task has.

    Args:
        words: the list, as in `find_settings`.
        tasks: names.

    Raises:
        InvalidValueError: a task lacks one.
    """
    if any(word.lower() in SETTING_GROUPS for word in words):
        return
    for name in words:
        setting = all_settings()[name]
        having = [task.name for task in every_task().values() if setting.applies_to(task)]
        lacking = [task for task in tasks if task not in having]
        if lacking:
            others = ",".join(word for word in words if word != name)
            raise InvalidValueError(
                f"There is no {name} setting in {', '.join(lacking)}, but in {', '.join(having)}; "
                f"for the rest give --settings {others or 'all'}."
            )


def settings_of(task: Task) -> tuple[str, ...]:
    """Return the names of the settings that a task has, explicit first."""
    return tuple(name for name, setting in all_settings().items() if setting.applies_to(task))


def get_setting(name: str, task: Task) -> Setting:
    """Return a setting of a task by name.

    Raises:
        UnknownNameError: there is no such setting.
        InvalidValueError: the task lacks it.
    """
    _check(name)
    if not all_settings()[name].applies_to(task):
        raise InvalidValueError(
            f"{task.name} has no {name} setting; its settings are {', '.join(settings_of(task))}."
        )
    return all_settings()[name]


def _check(name: str, *groups: str) -> None:
    """Check that there is a setting of a name, or a group of settings such as ``all``.

    Args:
        name: to check.
        groups: the words for groups that are allowed besides.

    Raises:
        UnknownNameError: there is neither.
        InvalidValueError: the name is that of a form, ``resolved``, which is no setting.
    """
    if name in FORMS:
        implicit = [setting.name for setting in all_settings().values() if setting.implicit]
        raise InvalidValueError(
            f"{name!r} is a form of the instruction, not a setting; settings that leave the goal "
            f"implicit are {', '.join(implicit)}."
        )
    check_names("setting", [name], (*all_settings(), *groups))
