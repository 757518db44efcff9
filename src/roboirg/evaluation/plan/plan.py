"""Plans: which episodes to play, checked before anything starts."""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
import operator
import os
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import asdict, fields, is_dataclass, replace
from functools import partial
from typing import Annotated, Any, Literal, NamedTuple

import msgspec
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    SerializationInfo,
    ValidationInfo,
    field_serializer,
    field_validator,
    model_validator,
)

from roboirg import tasks
from roboirg.core.arms import TOLD
from roboirg.core.delivery import TURNS
from roboirg.core.environment_options import EnvironmentOptions, check_demonstration_frames
from roboirg.core.errors import InvalidValueError, check_names
from roboirg.core.field_types import CONTROLS, check_policy_name
from roboirg.core.instruction_options import DEFAULT_FRAME, InstructionOptions, identifying
from roboirg.core.policy_ref import PolicyRef
from roboirg.core.word_pools import POOLS
from roboirg.evaluation.hosting.policy_opening import open_policy
from roboirg.evaluation.plan.option_parsing import (
    Names,
    Numbers,
    name_and_spec,
    parse_arms,
    parse_episodes,
    parse_names,
    parse_numbers,
    parse_policies,
    parse_stage_sets,
)
from roboirg.evaluation.plan.plan_sections import Attempts, Hosting, ModelUse, WorkerNeeds, names_of
from roboirg.evaluation.play.job_instruction import instruct_job
from roboirg.evaluation.records.film import VideoMode
from roboirg.evaluation.records.record import Job, Summary
from roboirg.evaluation.records.record_codec import RecordKey, identity_key
from roboirg.language.generator import check_options, find_refusal
from roboirg.language.scenarios.wording_store import open_wordings
from roboirg.language.settings import (
    EXPLICIT,
    SETTING_GROUPS,
    all_settings,
    expand_settings,
    find_settings,
    get_setting,
    settings_of,
)
from roboirg.policies.by_name.finding import read_policy
from roboirg.policies.by_name.key_variables import check_variables
from roboirg.policies.contract.option_checking import flags_as_words
from roboirg.tasks.splits import splits
from roboirg.tasks.splits.private_splits import MissingSaltError, is_private
from roboirg.util.short_hash import short_hash

MOST_JOBS = 1_000_000
_HASHED = "hashed"
"""The context in which a plan is written for its fingerprint."""
REQUIRED = "required"
"""Instead of a wording file in a plan: one must be given when the plan is run."""

AXES = ("setting", "form", "stages")
"""Options of instructions of which a plan plays several."""


def _policies(given: object) -> object:
    """Return policies as references, which texts are read into; one may name several."""
    texts = [given] if isinstance(given, str) else given
    if not isinstance(texts, list | tuple) or not all(isinstance(one, str) for one in texts):
        return given
    found = (read_policy(*reversed(name_and_spec(one))) for one in parse_policies(texts))
    return tuple(dict.fromkeys(found))


def _tasks(given: object) -> Names:
    """Return names of tasks and suites as tasks; `Plan.checked` refuses unknown ones."""
    names = parse_names("task", given)
    with contextlib.suppress(InvalidValueError):
        return tasks.find_tasks(names)
    return names


def _settings(given: object) -> Names:
    """Return names of settings, or the one word that stands for the same ones."""
    names = parse_names("setting", given)
    words = tuple(name.lower() if name.lower() in SETTING_GROUPS else name for name in names)
    found = {*expand_settings(words)}
    for word in words:
        if word in SETTING_GROUPS and {*expand_settings([word])} == found:
            return (word,)
    return words


class ChosenWordings(NamedTuple):
    """The wordings of a plan.

    Attributes:
        file: path of the wording file, or the name of a pool of our words.
        identity: of the file's content; the name of the pool.
    """

    file: str
    identity: str


def _open_wordings(given: object) -> object:
    if given == REQUIRED:
        raise InvalidValueError(
            "This plan needs RoboMME's sentences: make a wording file with `roboirg language "
            "import-robomme PATH --out robomme.toml`, where PATH is a clone of RoboMME's "
            "repository, and give it with --wordings robomme.toml."
        )
    if given is None or isinstance(given, list | tuple | Mapping):
        return given
    file = str(given) if given in POOLS else os.path.realpath(str(given))
    return ChosenWordings(file, str(open_wordings(file)))


def _option(default: Any, text: str) -> Any:  # noqa: ANN401 - as it may be typed
    return Field(default=default, description=text)


class Plan(BaseModel):
    """Which policies play which episodes, with which instructions.

    Values are as typed on a command line, as in YAML, or Python's: ``"0,3,5-9"`` or ``(0, 3)``.
    The options of the sections also stand alone, under their own names: ``max_steps=600``. Those
    from `video` on are not part of a record's identity.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", validate_default=True, allow_inf_nan=False
    )

    policies: Annotated[tuple[PolicyRef, ...], BeforeValidator(_policies)] = Field(
        description="Built-in names, package.module:Class, or addresses; NAME=SPEC gives one a "
        "name of its own."
    )
    tasks: Annotated[Names, BeforeValidator(_tasks)] = _option(
        "all", "Tasks or suites; all for the whole benchmark."
    )
    settings: Annotated[Names, BeforeValidator(_settings)] = _option(
        "all",
        "Settings; all for every setting that can express the episode, except the harder ones; "
        "every adds these. Next to names, tasks may lack any of them: all,grounded.",
    )
    in_turns: Annotated[Names, names_of("setting")] = _option(
        (), "Settings that are also played with the utterances one after another."
    )
    forms: Annotated[Names, BeforeValidator(partial(parse_names, "form"))] = _option(
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
    # Which words each task has, as in records: no option, but what `checked` finds installed.
    words: Names = Field(default=(), exclude_if=operator.not_)

    @model_validator(mode="before")
    @classmethod
    def _nest(cls, given: object) -> object:
        """Put options that stand alone into their sections."""
        if not isinstance(given, Mapping):
            return given
        found = flags_as_words(given)
        check_names("plan key", found, PLAN_KEYS)
        for name, keys in SECTION_KEYS.items():
            section = found.get(name)
            options = section if isinstance(section, Mapping) else {}
            check_names(f"key of {name}", options, keys)
            for option in options:
                if option in found:
                    raise InvalidValueError(
                        f"{option} is {found[option]!r}, but stands in {name}, too; leave one out."
                    )
        for name in FLAT.keys() & found.keys():
            value = found.pop(name)
            section = found.get(FLAT[name], {})
            if is_dataclass(section) and not isinstance(section, type):
                section = asdict(section)
            if isinstance(value, str) and re.fullmatch(r"[\d._]*_[\d._]*", value):
                raise InvalidValueError(
                    f"{name} is {value!r}; write the number without underscores."
                )
            if isinstance(section, Mapping):
                found[FLAT[name]] = {**section, name: value}
        return found

    @field_validator("episodes", mode="before")
    @classmethod
    def _parse_episodes(cls, given: object, info: ValidationInfo) -> Numbers:
        return parse_episodes(given, info.data.get("split", "test"), info.data.get("tasks", ()))

    @field_validator("environment", mode="before")
    @classmethod
    def _check_frames(cls, given: object) -> object:
        frames = given.get("demonstration_frames") if isinstance(given, Mapping) else None
        if frames is not None:
            check_demonstration_frames(frames)
        return given

    @field_serializer("instruction")
    def _write_instruction(
        self, options: InstructionOptions, info: SerializationInfo[Any]
    ) -> dict[str, Any]:
        written = identifying(options) if info.context == _HASHED else asdict(options)
        return {name: one for name, one in written.items() if name in FLAT}

    @model_validator(mode="after")
    def _check_text(self) -> Plan:
        for name, value in self.model_dump().items():
            for text in _texts(value):
                if re.search(rf"[{CONTROLS}\ud800-\udfff]", text):
                    raise InvalidValueError(
                        f"The plan has {text[:80]!r} as {name}; it must be text without control "
                        "characters."
                    )
        return self

    @model_validator(mode="after")
    def _check_size(self) -> Plan:
        played = (self.policies, self.tasks, self.episodes, self.policy_seeds, self.arms)
        worded = (self.setting_names, self.forms, self.stages)
        size = math.prod(map(len, played + worded))
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
    def _has_groups(self) -> bool:
        """Whether tasks and episodes may lack a setting, because a word stands for several."""
        return not SETTING_GROUPS.keys().isdisjoint(self.settings)

    @property
    def fingerprint(self) -> str:
        """Hash of all fields but names of variables and what follows from the others."""
        left_out: Mapping[str, Any] = {
            "hosting": {"policy_env"},
            "policies": {"__all__": {"makeup"}},
        }
        return short_hash(self.model_dump_json(context=_HASHED, exclude=left_out))

    def checked(self) -> Plan:
        """Return this plan if all of it can be played.

        Raises:
            UnknownNameError: a policy, task, setting, … does not exist; the message suggests the
                nearest.
            InvalidValueError: a number is out of range, or a task lacks a setting.
        """
        tasks.find_tasks(self.tasks)
        find_settings(self.settings)
        specs: dict[str, str] = {}
        for one in self.policies:
            check_policy_name(one.name)
            if specs.setdefault(one.name, one.spec) != one.spec:
                raise InvalidValueError(
                    f"Two policies are named {one.name!r}: {specs[one.name]} and {one.spec}."
                )
        for form, stages in itertools.product(self.forms, self.stages):
            check_options(replace(self.instruction, form=form, stages=stages))
        self.environment.check()
        turned = [name for name, one in all_settings().items() if "delivery" in one.reads]
        check_names("setting in turns", self.in_turns, turned)
        if is_private(self.split) and self.hosting.policy_process == "shared":
            raise InvalidValueError(
                "policy_process is 'shared', so policies would know the salt of private episodes; "
                "it must be 'own'."
            )
        for task in self.tasks:
            for index in (min(self.episodes), max(self.episodes)):
                splits.get_episode(task, self.split, index)
            for setting in () if self._has_groups else self.setting_names:
                get_setting(setting, tasks.get_task(task))
        jobs = list(self._instruction_jobs())
        # Raises if the options cannot express an episode.
        words = {str(instruct_job(job).metadata.get("words", "")) for job in jobs} - {""}
        if not jobs:
            raise InvalidValueError(
                f"There is nothing to play: {', '.join(self.settings)} cannot express any of "
                "these episodes."
            )
        check_variables(self.hosting.policy_env, "policies")
        limit = self.hosting.policy_timeout_s
        settings = replace(self.hosting, policy_process="own").settings
        opened = [open_policy(policy, limit, settings) for policy in self.policies]
        return self.model_copy(update={"policies": tuple(opened), "words": tuple(sorted(words))})

    def jobs(self, played: Iterable[Summary] = ()) -> tuple[Job, ...]:
        """Return every job, ordered by policy, task, episode, setting, form, stages and seed.

        Of a scene, what leaves the goal implicit comes first: a policy that keeps what it heard
        has not heard the explicit command of the scene yet.

        Args:
            played: results, to save time: what was said can be said.
        """
        said = {(one.task, one.episode, one.setting) for one in played if one.split == self.split}
        # The settings of an episode are slow to find, so all policies share them.
        settings = {
            (task, episode): self.settings_of(task, episode, said)
            for task in self.tasks
            for episode in self.episodes
        }
        return tuple(
            job
            for policy in self.policies
            for where, expressible in settings.items()
            for job in self._jobs_of(policy, *where, expressible, self.arms, self.policy_seeds)
        )

    def left_out(self, jobs: Iterable[Job]) -> Mapping[str, int]:
        """Return how many jobs each arm lacks, because it has no other goal or cannot be said.

        Args:
            jobs: of this plan.
        """
        trials = {name: set[RecordKey]() for name in self.arms}
        for job in jobs:
            trials[job.arm].add(identity_key(msgspec.structs.replace(job, arm=TOLD)))
        every = set[RecordKey]().union(*trials.values())
        return {name: len(every - found) for name, found in trials.items() if found != every}

    def drawable_jobs(self, played: Iterable[Summary] = ()) -> tuple[Job, ...]:
        """Return the jobs whose words can be made here, for counting what a stored run lacks.

        `played` are its results, see `jobs`. None if the episodes are private and their salt is not
        known; none of tasks and settings whose package is not installed.
        """
        try:
            splits.check_split(self.split)
        except MissingSaltError:
            return ()
        known = tuple(name for name in self.tasks if name in tasks.every_task())
        words = {*all_settings(), *SETTING_GROUPS}
        settings = tuple(name for name in self.settings if name in words)
        return self.model_copy(update={"tasks": known, "settings": settings}).jobs(played)

    def settings_of(
        self, task: str, episode: int, said: Collection[tuple[str, int, str]] = ()
    ) -> Names:
        """Return the settings in which an episode is played.

        `said` has task, episode and setting of what is known to be expressible.
        """
        if not self._has_groups:
            return self.setting_names
        found = splits.get_episode(task, self.split, episode)
        return tuple(
            name
            for name in settings_of(tasks.get_task(task))
            if name in self.setting_names
            if (task, episode, name) in said
            or find_refusal(found, InstructionOptions(name)) is None
        )

    def _jobs_of(
        self,
        policy: PolicyRef | None,
        task: str,
        episode: int,
        settings: Iterable[str],
        arms: Names,
        seeds: Numbers,
    ) -> Iterator[Job]:
        said = [options for setting in settings for options in self._options_of(setting)]
        file, wordings = self.wordings or (None, None)
        for options in sorted(
            said, key=lambda one: one.setting == EXPLICIT or one.form == "resolved"
        ):
            if self._is_left_out(task, episode, options):
                continue
            job = Job(
                policy="" if policy is None else policy.name,
                task=task,
                split=self.split,
                episode=episode,
                options=replace(options, wordings=wordings),
                wordings_file=file,
                environment=self.environment,
                ref=policy,
            )
            # Copying is faster, and there may be very many.
            for arm in arms:
                if arm == TOLD or _has_arm(msgspec.structs.replace(job, policy="", ref=None), arm):
                    for seed in seeds:
                        yield msgspec.structs.replace(job, policy_seed=seed, arm=arm)

    def _options_of(self, setting: str) -> Iterator[InstructionOptions]:
        """Yield the instruction options to play in a setting.

        An option that the setting does not read keeps its default, so that equal words are one job.
        """
        rule = all_settings()[setting]
        usual = InstructionOptions(setting)
        chosen = {option: getattr(self.instruction, option) for option in rule.reads - {"stages"}}
        for form in self.forms if rule.implicit else (usual.form,):
            for stages in self.stages if "stages" in rule.reads else (usual.stages,):
                options = replace(usual, form=form, stages=stages, **chosen)
                yield options
                if setting in self.in_turns and options.delivery != TURNS:
                    yield replace(options, delivery=TURNS)

    def _is_left_out(self, task: str, episode: int, options: InstructionOptions) -> bool:
        """Return whether a harder setting cannot express an episode that its plain one can.

        Some scenes have no second value; a plan over many tasks leaves them out.
        """
        plain = all_settings()[options.setting].plain
        if plain is None:
            return False
        found = splits.get_episode(task, self.split, episode)
        easier = replace(options, setting=plain)
        return find_refusal(found, options) is not None and find_refusal(found, easier) is None

    def _instruction_jobs(self) -> Iterator[Job]:
        """Yield one job for each instruction that the language may not be able to express."""
        # All settings with the default frame are only those that can express the episode.
        usual = (
            self._has_groups and self.instruction.frame == DEFAULT_FRAME and self.wordings is None
        )
        for task in self.tasks:
            for episode in self.episodes[:1] if usual else self.episodes:
                settings = self.settings_of(task, episode)
                yield from self._jobs_of(None, task, episode, settings, (TOLD,), (0,))


SECTIONS: Mapping[str, type[Any]] = {
    name: field.annotation
    for name, field in Plan.model_fields.items()
    if is_dataclass(field.annotation) and isinstance(field.annotation, type)
}
"""The sections of a plan, each with its class."""
SECTION_KEYS = {
    section: [one.name for one in fields(kind) if one.name not in (*AXES, *Plan.model_fields)]
    for section, kind in SECTIONS.items()
}
FLAT = {
    name: section
    for section, names in SECTION_KEYS.items()
    if section != "cluster"
    for name in names
}
"""The section of each option that stands alone, too."""
PLAN_KEYS = (*Plan.model_fields, *FLAT)


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

    def value_in(self, plan: Plan) -> object:
        holder = getattr(plan, self.section) if self.section else plan
        return getattr(holder, self.name)


def plan_options() -> Iterator[PlanOption]:
    """Yield all options, those of sections that stand alone in the place of the section."""
    for name, one in Plan.model_fields.items():
        if one.description is None:  # nothing to choose
            continue
        if name not in FLAT.values():
            default = None if one.is_required() or name in SECTIONS else one.default
            yield PlanOption(name, None, default, one.description)
            continue
        for option in fields(SECTIONS[name]):
            if option.name in FLAT:
                words = option.metadata["help"]
                default = option.default
                default = ",".join(default) if isinstance(default, tuple) else default
                yield PlanOption(option.name, name, default, words)


@functools.lru_cache(maxsize=65_536)
def _has_arm(job: Job, arm: str) -> bool:
    """Return whether an instruction, a job without a policy, has an arm."""
    try:
        instruct_job(msgspec.structs.replace(job, arm=arm))
    except InvalidValueError:
        return False
    return True


def _texts(value: object) -> list[str]:
    """Return all texts in a value."""
    if isinstance(value, Mapping):
        value = (*value, *value.values())
    if isinstance(value, tuple):
        return [text for one in value for text in _texts(one)]
    return [value] if isinstance(value, str) else []
