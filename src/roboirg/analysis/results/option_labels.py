"""Names and order of instruction options in tables, figures and on the page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.plain_text import counted
from roboirg.language import STAGE_SETS
from roboirg.language.settings import EXPLICIT, all_settings, setting_names

SortKey = tuple[object, ...]
"""What something is sorted by, compared value by value."""

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
REFERENCE_OPTIONS = InstructionOptions(EXPLICIT)
"""Those that a gap refers to."""


def options_label(options: InstructionOptions) -> str:
    """Return how instruction options are printed: ``relational (resolved, 2 distractors)``.

    In brackets behind the setting are the options that differ from their defaults.
    """
    phrases = []
    for name, value in asdict(options).items():
        is_default = value == getattr(_DEFAULTS, name)
        if is_default or name in ("setting", "wordings"):
            continue
        phrase_of = _PHRASES.get(name, f"{name} {{}}".format)
        phrases.append(phrase_of(value))

    if not phrases:
        return options.setting
    return f"{options.setting} ({', '.join(phrases)})"


def options_sort_key(options: InstructionOptions) -> SortKey:
    """Sort by setting; within a setting the implicit form first, then by label."""
    is_implicit = options.form == _DEFAULTS.form
    return (*setting_sort_key(options.setting), not is_implicit, options_label(options))


def setting_sort_key(setting: str) -> tuple[int, str]:
    """Sort settings in the order of the language; unknown settings of old records come last."""
    return place_in(setting_names(), setting), setting


def place_in(known: Sequence[str], name: str) -> int:
    """Return the place of a name among those that are known; an unknown one is behind them all."""
    if name not in known:
        return len(known)
    return known.index(name)


def is_usual(options: InstructionOptions) -> bool:
    """Whether all options but the setting are the defaults."""
    return options == InstructionOptions(options.setting)


def has_default_options(options: InstructionOptions) -> bool:
    """Whether the setting is none of the harder ones, and the options are the usual ones."""
    setting = all_settings().get(options.setting)
    return (setting is None or setting.plain is None) and is_usual(options)


def staged_options() -> tuple[InstructionOptions, ...]:
    """Return the options of the setting with stages, one for each set of stages, shortest first."""
    staged = [name for name, setting in all_settings().items() if "stages" in setting.reads]
    return tuple(InstructionOptions(staged[0], stages=stages) for stages in STAGE_SETS)
