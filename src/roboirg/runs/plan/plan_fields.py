"""What a plan says: its options, checked as they are typed.

Options are grouped in *sections*, such as `environment`; most of them may also stand alone in a
plan.
"""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import asdict, fields, is_dataclass
from functools import partial
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationInfo,
    field_serializer,
    field_validator,
    model_validator,
)

from roboirg import tasks
from roboirg.core.arms import TOLD
from roboirg.core.environment_options import EnvironmentOptions, check_demonstration_frames
from roboirg.core.errors import InvalidValueError, check_names
from roboirg.core.field_types import CONTROLS
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.policy_ref import PolicyRef
from roboirg.core.word_pools import POOLS
from roboirg.language.scenarios.wording_store import open_wordings
from roboirg.language.settings import SETTING_GROUPS, expand_settings
from roboirg.policies.by_name.finding import read_policy
from roboirg.policies.contract.option_checking import flags_as_words
from roboirg.records.film import VideoMode
from roboirg.runs.plan.option_parsing import (
    Names,
    Numbers,
    distinct,
    name_and_spec,
    parse_arms,
    parse_episodes,
    parse_forms,
    parse_names,
    parse_numbers,
    parse_policies,
    parse_stage_sets,
)
from roboirg.runs.plan.plan_sections import (
    Attempts,
    Hosting,
    ModelUse,
    StopRule,
    WorkerNeeds,
    names_of,
)
from roboirg.util.short_hash import short_hash

MOST_JOBS = 1_000_000
REQUIRED = "required"
"""Instead of a wording file in a plan: one must be given when the plan is run."""

AXES = ("setting", "form", "stages")
"""Options of instructions of which a plan plays several."""
_UNDERSCORED_NUMBER = re.compile(r"[\d._]*_[\d._]*")
"""``1_000``, which Python would read as a number."""


def _read_policies(given: object) -> object:
    """Return references of policies that are typed, such as ``"oracle,mine=lab:Walk"``.

    Anything that is no text or list of texts is returned unchanged: pydantic calls this first, then
    accepts references and refuses the rest.
    """
    texts = [given] if isinstance(given, str) else given
    if not isinstance(texts, list | tuple) or not all(isinstance(text, str) for text in texts):
        return given
    policies = []
    for text in parse_policies(texts):
        named = name_and_spec(text)
        policies.append(read_policy(named.spec, named.name))
    return distinct(policies)


def _read_tasks(given: object) -> Names:
    """Return names of tasks and suites as tasks; `Plan.checked` refuses unknown ones."""
    names = parse_names("task", given)
    with contextlib.suppress(InvalidValueError):
        return tasks.find_tasks(names)
    return names


def _read_settings(given: object) -> Names:
    """Return the names of settings, and of groups of them, in a typed text or list.

    If a group, such as ``all``, contains all others that are named, it alone is returned:
    ``"direct,All"`` becomes ``("all",)``.
    """
    words = []
    for name in parse_names("setting", given):
        is_group = name.lower() in SETTING_GROUPS
        words.append(name.lower() if is_group else name)

    meant = {*expand_settings(words)}
    for word in words:
        if word in SETTING_GROUPS and {*expand_settings([word])} == meant:
            return (word,)
    return tuple(words)


class ChosenWordings(NamedTuple):
    """The wordings of a plan: a wording file, or a pool of the package's own words.

    Attributes:
        file: path of the wording file, or the name of the pool.
        identity: hash of the file's content, or the name of the pool.
    """

    file: str
    identity: str


def _open_wordings(given: object) -> object:
    """Return the wordings that a text or a path names: a wording file, or a pool of our words.

    None and wordings that are stored in a plan are returned as they are, for pydantic.
    """
    if given == REQUIRED:
        raise InvalidValueError(
            "This plan needs RoboMME's sentences: make a wording file with `roboirg language "
            "import-robomme PATH --out robomme.toml`, where PATH is a clone of RoboMME's "
            "repository, and give it with --wordings robomme.toml."
        )
    if given is None or isinstance(given, list | tuple | Mapping):
        return given
    name = str(given)
    file = name if name in POOLS else os.path.realpath(name)
    return ChosenWordings(file, str(open_wordings(file)))


def _option(default: Any, text: str) -> Any:  # noqa: ANN401 - as it may be typed
    """Return a field of a plan with its default and the text that explains it."""
    return Field(default=default, description=text)


class PlanFields(BaseModel):
    """Which policies play which episodes, with which instructions.

    Values are as typed on a command line, as in YAML, or Python's: ``"0,3,5-9"`` or ``(0, 3)``.
    The options of the sections also stand alone, under their own names: ``max_steps=600``. Those
    from `video` on are not part of a record's identity.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", validate_default=True, allow_inf_nan=False
    )

    policies: Annotated[tuple[PolicyRef, ...], BeforeValidator(_read_policies)] = Field(
        description="Built-in names, package.module:Class, or addresses; NAME=SPEC gives one a "
        "name of its own."
    )
    tasks: Annotated[Names, BeforeValidator(_read_tasks)] = _option(
        "all", "Tasks or suites; all for the whole benchmark."
    )
    settings: Annotated[Names, BeforeValidator(_read_settings)] = _option(
        "all",
        "Settings; all for every setting that can express the episode, except the harder ones; "
        "every adds these. Next to names, tasks may lack any of them: all,grounded.",
    )
    in_turns: Annotated[Names, names_of("setting")] = _option(
        (), "Settings that are also played with the utterances one after another."
    )
    forms: Annotated[Names, BeforeValidator(parse_forms)] = _option(
        "implicit", "implicit, resolved or both."
    )
    split: str = _option("test", "train, val, test, random, or the name of a private split.")
    episodes: Numbers = _option(
        "4",
        "Positions in the split, from 0: a list such as 0,3,5-9; 4 for the first four; all; or "
        "easy, medium, hard.",
    )
    policy_seeds: Annotated[Numbers, BeforeValidator(partial(parse_numbers, "policy seed"))] = (
        _option("0", "Every seed plays every episode.")
    )
    arms: Annotated[Names, BeforeValidator(parse_arms)] = _option(
        TOLD,
        "told, and control arms of the same scenes: other-goal, silent, silent-empty, scrambled, "
        "paraphrase:N (N other texts), again (another policy seed). Scenes without such an arm "
        "are left out.",
    )
    stages: Annotated[tuple[Numbers, ...], BeforeValidator(parse_stage_sets)] = _option(
        "1-5",
        "Sets of stages of the contextual setting, separated by semicolons: 1,5;1-5; every set is "
        "played.",
    )
    wordings: Annotated[ChosenWordings | None, BeforeValidator(_open_wordings)] = _option(
        None,
        "Wording file with words of your own; or train or test: our words of that pool in every "
        "split.",
    )
    instruction: InstructionOptions = _option(
        InstructionOptions(), "Further options of instructions, for settings that read them."
    )
    environment: EnvironmentOptions = _option(EnvironmentOptions(), "How episodes are played.")
    video: VideoMode = _option("off", "Episodes whose video is recorded: off, failures or all.")
    long_prompts: Literal["send", "refuse"] = _option(
        "send",
        "What to do with prompts longer than the limit that a policy declares: send or refuse.",
    )
    hosting: Hosting = _option(Hosting(), "How policies are hosted.")
    attempts: Attempts = _option(Attempts(), "How long and how often an episode is played.")
    models: ModelUse = _option(ModelUse(), "What models may cost.")
    cluster: WorkerNeeds = _option(
        WorkerNeeds(),
        "What a worker reserves on a machine of a Ray cluster, and what it gets from this one.",
    )
    stop: StopRule | None = _option(
        None,
        "Play scene by scene, and stop when what is compared is decided: {alpha: 0.05, margin: "
        "10}, with the margin in points; against: NAME for a policy with results in the folder.",
    )
    # Which words each task has, as in records: no option, but what `checked` finds installed.
    words: Names = ()

    @model_validator(mode="before")
    @classmethod
    def _nest(cls, given: object) -> object:
        """Return the given options with those that stand alone moved into their sections.

        ``{"max_steps": 600}`` becomes ``{"environment": {"max_steps": 600}}``; `FLAT` has the
        section of each such option. Pydantic calls this before it checks the values, and refuses
        later what is no mapping.
        """
        if not isinstance(given, Mapping):
            return given
        nested = flags_as_words(given)
        check_names("plan key", nested, PLAN_KEYS)
        _check_sections(nested)

        for option, section in FLAT.items():
            if option not in nested:
                continue
            value = nested.pop(option)
            if isinstance(value, str) and _UNDERSCORED_NUMBER.fullmatch(value):
                raise InvalidValueError(
                    f"{option} is {value!r}; write the number without underscores."
                )
            options = nested.get(section, {})
            if is_dataclass(options) and not isinstance(options, type):  # given from Python
                options = asdict(options)
            if isinstance(options, Mapping):  # pydantic refuses what is no section
                nested[section] = {**options, option: value}
        return nested

    @field_validator("episodes", mode="before")
    @classmethod
    def _parse_episodes(cls, given: object, info: ValidationInfo) -> Numbers:
        return parse_episodes(given, info.data.get("split", "test"), info.data.get("tasks", ()))

    @field_validator("environment", mode="before")
    @classmethod
    def _check_frames(cls, given: object) -> object:
        """Refuse wrong frames in one sentence, where pydantic would name each type."""
        frames = given.get("demonstration_frames") if isinstance(given, Mapping) else None
        if frames is not None:
            check_demonstration_frames(frames)
        return given

    @field_serializer("instruction")
    def _write_instruction(self, options: InstructionOptions) -> dict[str, Any]:
        return {name: value for name, value in asdict(options).items() if name in FLAT}

    @model_validator(mode="after")
    def _check_text(self) -> Self:
        """Raise if a text anywhere in the plan cannot be printed or stored as UTF-8."""
        for name, value in self.model_dump().items():
            for text in _texts(value):
                if re.search(rf"[{CONTROLS}\ud800-\udfff]", text):
                    raise InvalidValueError(
                        f"The plan has {text[:80]!r} as {name}; it must be text without control "
                        "characters."
                    )
        return self

    @model_validator(mode="after")
    def _check_size(self) -> Self:
        """Raise if the plan may have more jobs than a run can hold, before any is made."""
        scenes = len(self.tasks) * len(self.episodes)
        instructions = len(self.setting_names) * len(self.forms) * len(self.stages)
        trials = len(self.policies) * len(self.policy_seeds) * len(self.arms)
        size = scenes * instructions * trials
        if size > MOST_JOBS:
            raise InvalidValueError(
                f"The plan has up to {size:,} episodes; a plan has at most {MOST_JOBS:,}."
            )
        return self

    @property
    def setting_names(self) -> Names:
        """The settings that may be played."""
        return expand_settings(self.settings)

    @property
    def fingerprint(self) -> str:
        """Hash of the plan, for records, without the names of variables and what is derived."""
        excluded: Mapping[str, Any] = {
            "hosting": {"policy_env"},
            "policies": {"__all__": {"makeup"}},
        }
        if self.stop is None:  # then it is the plan that it was before there was such an option
            excluded = {**excluded, "stop": True}
        return short_hash(self.model_dump_json(exclude=excluded))


def _own_keys(section: type[Any]) -> list[str]:
    """Return the options of a section that are not fields of the plan or axes of it."""
    names = [field.name for field in fields(section)]
    return [name for name in names if name not in AXES and name not in PlanFields.model_fields]


def _flat_options() -> dict[str, str]:
    """Return the options that may stand alone, each with its section."""
    flat = {}
    for section, names in SECTION_KEYS.items():
        if section != "cluster":
            flat.update(dict.fromkeys(names, section))
    return flat


SECTIONS: Mapping[str, type[Any]] = {
    name: field.annotation
    for name, field in PlanFields.model_fields.items()
    if is_dataclass(field.annotation) and isinstance(field.annotation, type)
}
"""The sections of a plan, each with its class."""
SECTION_KEYS = {section: _own_keys(kind) for section, kind in SECTIONS.items()}
"""The options of each section."""
FLAT = _flat_options()
"""The section of each option that stands alone, too."""
PLAN_KEYS = (*PlanFields.model_fields, *FLAT)


class PlanOption(NamedTuple):
    """What there is to say of an option of a plan.

    Attributes:
        name: as it stands alone.
        section: None if it is in none.
        default: as it may be typed; None if there is none.
        help: what it means.
    """

    name: str
    section: str | None
    default: object
    help: str

    def value_in(self, plan: PlanFields) -> object:
        holder = getattr(plan, self.section) if self.section else plan
        return getattr(holder, self.name)


def plan_options() -> Iterator[PlanOption]:
    """Yield all options that may be typed for a plan, in order, with their defaults and help.

    A section, such as ``environment``, is replaced by its options, as each may stand alone in a
    plan; one whose options may not is yielded itself.
    """
    for name, field in PlanFields.model_fields.items():
        if field.description is None:  # nothing to choose
            continue
        if name not in FLAT.values():
            has_default = name not in SECTIONS and not field.is_required()
            default = field.default if has_default else None
            yield PlanOption(name, None, default, field.description)
            continue
        for option in fields(SECTIONS[name]):
            if option.name in FLAT:
                default = option.default
                if isinstance(default, tuple):
                    default = ",".join(default)
                yield PlanOption(option.name, name, default, option.metadata["help"])


def _check_sections(options: Mapping[str, Any]) -> None:
    """Raise if a section has an unknown option, or one that also stands outside of the section."""
    for section, keys in SECTION_KEYS.items():
        inside = options.get(section)
        if not isinstance(inside, Mapping):
            continue
        check_names(f"key of {section}", inside, keys)
        for option in inside:
            if option in options:
                raise InvalidValueError(
                    f"{option} is {options[option]!r}, but stands in {section}, too; leave one out."
                )


def _texts(value: object) -> list[str]:
    """Return all texts in a value, at any depth: ``{"a": ("b", 1)}`` has ``["a", "b"]``."""
    if isinstance(value, str):
        return [value]
    if isinstance(value, Mapping):
        value = (*value, *value.values())
    texts: list[str] = []
    if isinstance(value, tuple):
        for part in value:
            texts += _texts(part)
    return texts
