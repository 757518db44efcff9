"""The settings, one file each; a file that defines ``SETTING`` is a setting of the language."""

from __future__ import annotations

import functools
import sys
from collections.abc import Mapping

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.language.instruction import SETTINGS
from roboirg.language.request import Setting
from roboirg.tasks import Task
from roboirg.util.discovery import discover

__all__ = ["all_settings", "get_setting"]


@functools.cache
def all_settings() -> Mapping[str, Setting]:
    """Every setting by name, explicit first."""
    rules: list[Setting] = discover(sys.modules[__name__], "SETTING")
    return {rule.name: rule for rule in sorted(rules, key=lambda rule: SETTINGS.index(rule.name))}


def get_setting(name: str, task: Task) -> Setting:
    """The setting of that name.

    Raises:
        UnknownNameError: there is none.
        InvalidValueError: it is not defined for the task.
    """
    if name not in all_settings():
        raise UnknownNameError("setting", name, all_settings())
    if name not in task.settings:
        raise InvalidValueError(
            f"{task.name} has no {name} setting; its settings are {', '.join(task.settings)}."
        )
    return all_settings()[name]
