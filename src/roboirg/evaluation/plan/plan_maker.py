"""Make a plan from options as typed on the command line."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from pydantic import TypeAdapter, ValidationError

from roboirg import tasks as task_registry
from roboirg.core.arms import TOLD
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.policy_ref import PolicyRef
from roboirg.evaluation.plan.option_parsing import (
    ALL,
    check_names,
    parse_arms,
    parse_episodes,
    parse_names,
    parse_numbers,
    parse_stage_sets,
)
from roboirg.evaluation.plan.plan import (
    LONG_PROMPTS,
    REQUIRED,
    RETRYABLE,
    SETTINGS_NAMES,
    Plan,
    SettingsName,
    nest_options,
)
from roboirg.evaluation.records.film import VIDEO_MODES
from roboirg.evaluation.records.record import ERROR_KINDS, ErrorKind
from roboirg.language.settings import SETTING_GROUPS, find_settings


def make_plan(
    policies: Iterable[str | PolicyRef],
    *,
    tasks: str = ALL,
    settings: str = ALL,
    forms: str = "implicit",
    episodes: str = "4",
    policy_seeds: str = "0",
    arms: str = TOLD,
    stages: str = "1-5",
    retry_on: str = ",".join(RETRYABLE),
    devices: str = "",
    in_turns: str = "",
    **options: object,
) -> Plan:
    """Return a checked plan from options as typed on the command line.

    Args:
        policies: names or addresses; names may be separated by commas.
        tasks: names separated by commas; ``all`` anywhere selects all.
        settings: names separated by commas; ``all`` stands for all but the harder ones, ``every``
            for these, too.
        forms: names separated by commas.
        episodes: ``4`` for the first four, a list such as ``0,3,5-9``, or difficulties: ``hard``.
        policy_seeds: a list of numbers.
        arms: names separated by commas, such as ``told,other-goal,paraphrase:3``.
        stages: a list of numbers, or several lists separated by semicolons.
        retry_on: kinds of errors separated by commas, or ``none``.
        devices: names separated by commas; none for one process on any device.
        in_turns: names of settings, separated by commas; none for no setting.
        **options: other fields of `Plan`, and options of instructions by their own names.

    Raises:
        UnknownNameError: a name does not exist; the message suggests the nearest.
        InvalidValueError: a number or combination is out of range.
    """
    split = str(options.get("split", "test"))
    names = task_registry.find_tasks(parse_names("task", tasks))
    if options.get("wordings") == REQUIRED:
        raise InvalidValueError(
            "This plan needs RoboMME's sentences: make a wording file with `roboirg language "
            "import-robomme PATH --out robomme.toml`, where PATH is a clone of RoboMME's "
            "repository, and give it with --wordings robomme.toml."
        )
    check_names("video mode", [options.get("video", "off")], VIDEO_MODES)
    check_names("way to handle long prompts", [options.get("long_prompts", "send")], LONG_PROMPTS)
    try:
        plan = Plan(
            policies=tuple(policies),  # type: ignore[arg-type]
            tasks=names,
            settings=_settings(settings),
            forms=parse_names("form", forms),
            episodes=parse_episodes(episodes, split, names),
            policy_seeds=parse_numbers("policy seed", policy_seeds),
            arms=parse_arms(arms),
            stages=parse_stage_sets(stages),
            retry_on=_error_kinds(retry_on),
            devices=parse_names("device", devices) if devices else (),
            in_turns=parse_names("setting", in_turns) if in_turns else (),
            **nest_options(options),
        )
    except ValidationError as error:
        raise _explain(error) from error
    return plan.checked()


def word_options(*, stages: str = "1-5", **options: object) -> InstructionOptions:
    """Return options of instructions as typed for a plan, one value each; opens the wording file.

    Raises:
        InvalidValueError: a value is out of range, or there are several sets of stages.
    """
    sets = parse_stage_sets(stages)
    if len(sets) > 1:
        raise InvalidValueError(f"stages is {stages!r}; here it must be one set, such as 1,5.")
    fields = nest_options(options)
    try:
        plan = Plan(policies=(), tasks=(), episodes=(), stages=sets, **fields)
    except ValidationError as error:
        raise _explain(error) from error
    return replace(plan.options, stages=sets[0])


def as_typed_field(name: str, kind: Any, value: object) -> Any:  # noqa: ANN401 - of that type
    """Return a value from a file as a field of a type.

    Raises:
        InvalidValueError: it cannot be one.
    """
    try:
        return TypeAdapter(kind).validate_python(value)
    except ValidationError as error:
        raise InvalidValueError(f"{name} is {value!r}: {error.errors()[0]['msg']}.") from error


def _explain(error: ValidationError) -> InvalidValueError:
    first = error.errors()[0]
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, InvalidValueError):
        return cause
    name = ".".join(str(part) for part in first["loc"])
    return InvalidValueError(f"{name} is {first['input']!r}: {first['msg']}.")


def _settings(text: str) -> tuple[str, ...] | SettingsName:
    words = tuple(
        word.lower() if word.lower() in SETTING_GROUPS else word
        for word in parse_names("setting", text)
    )
    found = {*find_settings(words)}
    same = (name for name in SETTINGS_NAMES if name in words and {*find_settings([name])} == found)
    return next(same, words)


def _error_kinds(text: str) -> tuple[ErrorKind, ...]:
    if text.strip().lower() == "none":
        return ()
    names = parse_names("kind of error", text)
    check_names("kind of error", names, ERROR_KINDS)
    return tuple(kind for kind in ERROR_KINDS if kind in names)
