"""Names and order of instruction options in tables, figures and on the page."""

from __future__ import annotations

from collections.abc import Sequence

from roboirg.core.instruction_options import InstructionOptions, options_label
from roboirg.language import STAGE_SETS
from roboirg.language.settings import EXPLICIT, all_settings, setting_names

SortKey = tuple[object, ...]
"""What something is sorted by, compared value by value."""

REFERENCE_OPTIONS = InstructionOptions(EXPLICIT)
"""Those that a gap refers to."""


def options_sort_key(options: InstructionOptions) -> SortKey:
    """Sort by setting; within a setting the implicit form first, then by label."""
    is_implicit = options.form == REFERENCE_OPTIONS.form
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
