"""The settings, one file each; a file that defines ``SETTING`` is a setting of the language.

Installed packages add theirs through entry points of the group ``roboirg.settings``.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Mapping

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.language.setting import Setting
from roboirg.tasks import Task
from roboirg.util.discovery import discover

__all__ = ["EXPLICIT", "all_settings", "get_setting", "setting_names", "settings_of"]

EXPLICIT = "explicit"
"""The setting that every other one is compared with."""


@functools.cache
def all_settings() -> Mapping[str, Setting]:
    """Every setting by name, explicit first."""
    found = discover(sys.modules[__name__], "SETTING", Setting, "roboirg.settings")
    return {one.name: one for one in sorted(found, key=lambda one: (one.order, one.name))}


def setting_names() -> tuple[str, ...]:
    """The names of all settings, explicit first."""
    return tuple(all_settings())


def settings_of(task: Task) -> tuple[str, ...]:
    """The names of the settings in which a task can be stated, explicit first."""
    return tuple(one.name for one in all_settings().values() if one.applies_to(task))


def get_setting(name: str, task: Task) -> Setting:
    """The setting of that name.

    Raises:
        UnknownNameError: there is none.
        InvalidValueError: it is not defined for the task.
    """
    if name not in all_settings():
        raise UnknownNameError("setting", name, all_settings())
    if not all_settings()[name].applies_to(task):
        raise InvalidValueError(
            f"{task.name} has no {name} setting; its settings are {', '.join(settings_of(task))}."
        )
    return all_settings()[name]
