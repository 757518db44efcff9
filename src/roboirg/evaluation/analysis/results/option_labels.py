"""Names and order of instruction options in tables, figures and on the page."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from roboirg.core.instruction_options import DEFAULT_LANGUAGE, InstructionOptions
from roboirg.core.plain_text import counted
from roboirg.language import STAGE_SETS
from roboirg.language.settings import EXPLICIT, all_settings, setting_names

_DEFAULTS = InstructionOptions()
_PHRASES: dict[str, Callable[[Any], str]] = {
    "form": str,
    "stages": lambda stages: "stages " + ",".join(map(str, stages)),
    "distractor": "{} distractor".format,
    "distractors": lambda count: counted(count, "distractor"),
    "frame": "{} frame".format,
    "delivery": "in {}".format,
}
"""How labels name the value of an option; of any other option, by its name."""


@functools.cache  # asked for every record
def reference_of(options: InstructionOptions) -> InstructionOptions:
    """Return the options that a gap refers to: explicit, in the same language."""
    return InstructionOptions(EXPLICIT, language=options.language)


def options_label(options: InstructionOptions) -> str:
    """Return the setting and, in brackets, the options that differ from the defaults."""
    changed = [
        _PHRASES.get(name, f"{name} {{}}".format)(value)
        for name, value in asdict(options).items()
        if name not in ("setting", "wordings") and value != getattr(_DEFAULTS, name)
    ]
    return f"{options.setting} ({', '.join(changed)})" if changed else options.setting


def options_sort_key(options: InstructionOptions) -> tuple[object, ...]:
    """Sort by setting; within a setting the implicit form first, then by label."""
    is_implicit = options.form == _DEFAULTS.form
    return (*setting_sort_key(options.setting), not is_implicit, options_label(options))


def setting_sort_key(setting: str) -> tuple[int, str]:
    """Sort settings in the order of the language; unknown settings of old records come last."""
    known = setting_names()
    return (known.index(setting) if setting in known else len(known), setting)


def is_usual(options: InstructionOptions) -> bool:
    """Whether all options but setting and language are the defaults."""
    return options == InstructionOptions(options.setting, language=options.language)


def has_default_options(options: InstructionOptions) -> bool:
    """Whether the setting is none of the harder ones, and the options are the usual ones."""
    setting = all_settings().get(options.setting)
    return (setting is None or setting.plain is None) and is_usual(options)


def staged_options(language: int = DEFAULT_LANGUAGE) -> tuple[InstructionOptions, ...]:
    """Return the options of the setting with stages, one for each set of stages, shortest first."""
    setting = next(name for name, one in all_settings().items() if "stages" in one.reads)
    return tuple(
        InstructionOptions(setting, stages=stages, language=language) for stages in STAGE_SETS
    )
