"""Plans: which episodes to play, checked before anything starts."""

from __future__ import annotations

import functools
import itertools
import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, replace
from typing import Any, Literal, get_args

import msgspec
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    field_serializer,
    field_validator,
    model_validator,
)

from roboirg import language, tasks
from roboirg.core.actions import find_action_space
from roboirg.core.arms import TOLD, check_arm
from roboirg.core.delivery import TURNS
from roboirg.core.environment_options import (
    DEFAULT_MESHES,
    ENVIRONMENT_OPTIONS,
    MAX_STEPS,
    DemonstrationFrames,
    EnvironmentOptions,
    check_demonstration_frames,
    check_observe_every,
)
from roboirg.core.errors import InvalidValueError
from roboirg.core.field_types import CONTROLS, MOST_SECONDS, NAME
from roboirg.core.instruction_options import (
    ALL_STAGES,
    DEFAULT_FRAME,
    OPTION_NAMES,
    InstructionOptions,
)
from roboirg.core.plain_text import is_encodable
from roboirg.core.policy_ref import PolicyRef
from roboirg.core.word_pools import POOLS
from roboirg.evaluation.hosting.host_pool import DEFAULT_BATCH, HostSettings
from roboirg.evaluation.hosting.policy_opening import open_policy
from roboirg.evaluation.plan.option_parsing import check_names, name_and_spec, parse_policies
from roboirg.evaluation.plan.worker_needs import WorkerNeeds
from roboirg.evaluation.play.job_instruction import instruct_job
from roboirg.evaluation.records.film import VideoMode
from roboirg.evaluation.records.record import (
    ErrorKind,
    Job,
)
from roboirg.evaluation.records.record_codec import RecordKey, identity_key
from roboirg.language.generator import check_options, find_refusal
from roboirg.language.settings import EXPLICIT, SETTING_GROUPS, all_settings, expand_settings
from roboirg.language.wordings.wording_store import open_wordings
from roboirg.policies.by_name.finding import read_policy
from roboirg.tasks.splits import splits
from roboirg.tasks.splits.private_splits import MissingSaltError, is_private
from roboirg.util.short_hash import short_hash

MOST_JOBS = 1_000_000
REQUIRED = "required"
"""Instead of a wording file in a plan: one must be given when the plan is run."""


SettingsName = Literal["all", "every"]
SETTINGS_NAMES: tuple[SettingsName, ...] = get_args(SettingsName)

PolicyProcessMode = Literal["own", "shared"]

LongPrompts = Literal["send", "refuse"]
LONG_PROMPTS: tuple[LongPrompts, ...] = get_args(LongPrompts)

MESHES = ("faithful", "light")

AXES = ("setting", "form", "stages")
"""Options of instructions of which a plan plays several."""

RETRYABLE: tuple[ErrorKind, ...] = ("connection", "environment", "infrastructure")
"""Kinds of errors that may not occur again when the episode is retried."""


class Plan(BaseModel):
    """Which policies play which episodes, with which instructions."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    policies: tuple[PolicyRef, ...]
    """Built-in names, package.module:Class, or addresses; NAME=SPEC gives one a name of its own."""
    tasks: tuple[str, ...]
    """Tasks or suites; all for the whole benchmark."""
    settings: tuple[str, ...] | SettingsName = "all"
    """Settings; all for every setting that can express the episode, except the harder ones; every
    adds these. Next to names, tasks may lack any of them: all,grounded."""
    in_turns: tuple[str, ...] = ()
    """Settings that are also played with the utterances one after another."""
    forms: tuple[str, ...] = ("implicit",)
    """implicit, resolved or both."""
    split: str = "test"
    """train, val, test, random, or the name of a private split."""
    episodes: tuple[int, ...]
    """Positions in the split, from 0; a number alone, such as 4, is the first four."""
    policy_seeds: tuple[int, ...] = (0,)
    """Every seed plays every episode."""
    arms: tuple[str, ...] = (TOLD,)
    """told, and control arms of the same scenes: other-goal, silent, silent-empty, scrambled,
    paraphrase:N (N other texts), again (another policy seed). Scenes without such an arm
    are left out."""
    stages: tuple[tuple[int, ...], ...] = (ALL_STAGES,)
    """Sets of stages of the contextual setting; every set is played."""
    options: InstructionOptions = InstructionOptions()
    """Further options of instructions, for settings that read them. Its `wordings` identify those
    of `wordings`; the setting, form and stages are the fields above."""
    wordings: str | None = None
    """Wording file whose commands are used; or train or test: our words of that pool in every
    split."""
    max_steps: int = MAX_STEPS
    """Limit of an episode in control steps, 20 per second."""
    actions: str | None = None
    """Required action space; without one, each policy's own."""
    demonstration_frames: DemonstrationFrames | None = None
    """Frames of the demonstration that policies get: all, none, or their number; without it, as
    each policy asks."""
    observe_every: int | None = None
    """Control steps between two observations; without it, as each policy asks."""
    meshes: str = DEFAULT_MESHES
    """Meshes for rendering: faithful or light."""
    video: VideoMode = "off"
    """Episodes whose video is recorded: off, failures or all. This and all fields below are not
    part of a record's identity."""
    policy_process: PolicyProcessMode = "own"
    """own: a policy that is neither built in nor remote has a process of its own; shared: it runs
    in the simulator's process, for debuggers."""
    batch: int = DEFAULT_BATCH
    """Largest number of episodes that a policy is asked about at once."""
    devices: tuple[str, ...] = ()
    """GPUs, such as 0,1; each policy gets a process on each. If empty, one process on any GPU."""
    long_prompts: LongPrompts = "send"
    """What to do with prompts longer than the limit that a policy declares: send or refuse."""
    policy_timeout_s: float = 600.0
    """Time limit of one call of a policy, seconds."""
    episode_timeout_s: float = 7200.0
    """Time limit of an episode, seconds."""
    max_cost: float | None = Field(default=None, gt=0)
    """Most US dollars that models may cost; then the run stops and can be resumed with more."""
    model_replies: Literal["stored", "anew"] = "stored"
    """stored: replies in the folder are used again; anew: models are asked again."""
    cluster: WorkerNeeds = WorkerNeeds()
    """What a worker reserves on a machine of a Ray cluster, and what it gets from this one."""
    tries: int = 2
    """How often an episode is played if it ends in an error of a kind in `retry_on`."""
    retry_on: tuple[ErrorKind, ...] = RETRYABLE
    """Kinds of errors after which an episode is played again."""

    @model_validator(mode="before")
    @classmethod
    def _identify_wordings(cls, fields: Any) -> Any:  # noqa: ANN401 - whatever is to be validated
        if not isinstance(fields, dict) or fields.get("wordings") is None:
            return fields
        options: Any = fields.get("options", {})
        if isinstance(options, InstructionOptions):
            options = asdict(options)
        if not isinstance(options, dict) or options.get("wordings") is not None:
            return fields
        path = str(fields["wordings"])
        if path not in POOLS:
            path = os.path.realpath(path)
        options = {**options, "wordings": path if path in POOLS else open_wordings(path)}
        return {**fields, "wordings": path, "options": options}

    @field_validator("policies", mode="before")
    @classmethod
    def _read_policies(cls, given: Any) -> Any:  # noqa: ANN401 - whatever is to be validated
        if not isinstance(given, list | tuple) or not any(isinstance(one, str) for one in given):
            return given
        names = [parse_policies([one]) if isinstance(one, str) else [one] for one in given]
        found = [
            read_policy(*reversed(name_and_spec(one))) if isinstance(one, str) else one
            for several in names
            for one in several
        ]
        return tuple(dict.fromkeys(found))

    @field_serializer("options")
    def _write_options(self, options: InstructionOptions) -> dict[str, Any]:
        return {name: value for name, value in asdict(options).items() if name not in AXES}

    @field_validator("demonstration_frames", mode="before")
    @classmethod
    def _check_frames(cls, value: object) -> object:
        return None if value is None else check_demonstration_frames(value)

    @model_validator(mode="after")
    def _check_text(self) -> Plan:
        texts = self.model_dump()
        texts |= texts.pop("options")
        for name, value in texts.items():
            for text in value if isinstance(value, tuple) else (value,):
                if isinstance(text, str) and re.search(f"[{CONTROLS}]", text):
                    raise InvalidValueError(
                        f"The plan has {text[:80]!r} as {name}; it must have no control characters."
                    )
        return self

    @model_validator(mode="after")
    def _check_size(self) -> Plan:
        if not self.policy_seeds:
            raise InvalidValueError("The plan has no policy seeds; it needs at least one.")
        several = (self.policies, self.tasks, self.forms, self.episodes, self.policy_seeds)
        words = (self.setting_names, self.stages, self.arms)
        size = math.prod(map(len, (*several, *words)))
        if size > MOST_JOBS:
            raise InvalidValueError(
                f"The plan has up to {size:,} episodes; a plan has at most {MOST_JOBS:,}."
            )
        return self

    @property
    def setting_names(self) -> tuple[str, ...]:
        """The settings that may be played."""
        return expand_settings(self._setting_words)

    @property
    def _setting_words(self) -> tuple[str, ...]:
        return (self.settings,) if isinstance(self.settings, str) else self.settings

    @property
    def _has_groups(self) -> bool:
        """Whether tasks and episodes may lack a setting, because a word stands for several."""
        return not SETTING_GROUPS.keys().isdisjoint(self._setting_words)

    @property
    def hosting(self) -> HostSettings | None:
        """How policies are hosted; None if they run in the world's process."""
        if self.policy_process == "shared":
            return None
        return HostSettings(self.batch, self.devices, self.policy_timeout_s)

    @property
    def fingerprint(self) -> str:
        """Hash of all fields."""
        return short_hash(self.model_dump_json())

    def checked(self) -> Plan:
        """Return this plan if all of it can be played.

        Raises:
            UnknownNameError: a policy, task, setting, … does not exist; the message suggests the
                nearest.
            InvalidValueError: a number is out of range, or a task lacks a setting.
        """
        specs: dict[str, str] = {}
        for one in self.policies:
            name, spec = one.name, one.spec
            if not is_encodable(f"{name}={spec}"):
                raise InvalidValueError(f"Policy {name!r} is not text: it has lone surrogates.")
            if not re.fullmatch(NAME, name):
                raise InvalidValueError(
                    f"Policy {name[:80]!r} has no valid name for records: at most 1,000 "
                    "characters, without control characters."
                )
            if specs.setdefault(name, spec) != spec:
                raise InvalidValueError(
                    f"Two policies are named {name!r}: {specs[name]} and {spec}."
                )
        self._check_options()
        if is_private(self.split) and self.policy_process == "shared":
            raise InvalidValueError(
                "policy_process is 'shared', so policies would know the salt of private episodes; "
                "it must be 'own'."
            )
        for task in self.tasks:
            for index in (min(self.episodes), max(self.episodes)):
                splits.get_episode(task, self.split, index)
            self._check_settings(task)
        jobs = list(self._instruction_jobs())
        for job in jobs:
            instruct_job(job)  # raises if the options cannot express the episode
        if not jobs:
            raise InvalidValueError(
                f"There is nothing to play: {', '.join(self._setting_words)} cannot express any of "
                "these episodes."
            )
        device = next(iter(self.devices), None)
        opened = [open_policy(one, self.policy_timeout_s, device) for one in self.policies]
        return self.model_copy(update={"policies": tuple(opened)})

    def jobs(self) -> tuple[Job, ...]:
        """Return every job, ordered by policy, task, episode, setting, form, stages and seed.

        Of a scene, what leaves the goal implicit comes first: a policy that keeps what it heard
        has not heard the explicit command of the scene yet.
        """
        # The settings of an episode are slow to find, so all policies share them.
        settings = {
            (task, episode): self.settings_of(task, episode)
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

    def drawable_jobs(self) -> tuple[Job, ...]:
        """Return the jobs whose words can be made here, for counting what a stored run lacks.

        None if the episodes are private and their salt is not known; none of tasks and settings
        whose package is not installed.
        """
        try:
            splits.check_split(self.split)
        except MissingSaltError:
            return ()
        known = tuple(name for name in self.tasks if name in tasks.every_task())
        settings = self.settings
        if not isinstance(settings, str):
            known_words = {*all_settings(), *SETTING_GROUPS}
            settings = tuple(name for name in settings if name in known_words)
        return self.model_copy(update={"tasks": known, "settings": settings}).jobs()

    def settings_of(self, task: str, episode: int) -> tuple[str, ...]:
        """Return the settings in which an episode is played."""
        if not self._has_groups:
            return self.setting_names
        found = language.expressible(splits.get_episode(task, self.split, episode))
        return tuple(name for name in found if name in self.setting_names)

    def _jobs_of(
        self,
        policy: PolicyRef | None,
        task: str,
        episode: int,
        settings: Iterable[str],
        arms: tuple[str, ...],
        seeds: tuple[int, ...],
    ) -> Iterator[Job]:
        said = [options for setting in settings for options in self._options_of(setting)]
        environment = EnvironmentOptions(**{one: getattr(self, one) for one in ENVIRONMENT_OPTIONS})
        for options in sorted(said, key=_names_the_goal):
            if self._is_left_out(task, episode, options):
                continue
            job = Job(
                policy="" if policy is None else policy.name,
                task=task,
                split=self.split,
                episode=episode,
                options=replace(options, wordings=self.options.wordings),
                wordings_file=self.wordings,
                environment=environment,
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
        rule, usual = all_settings()[setting], InstructionOptions(setting)
        chosen = {option: getattr(self.options, option) for option in rule.reads - {"stages"}}
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
        refused = [find_refusal(found, one) is not None for one in (options, easier)]
        return refused == [True, False]

    def _instruction_jobs(self) -> Iterator[Job]:
        """Yield one job for each instruction that the language may not be able to express."""
        # All settings with the default frame are only those that can express the episode.
        usual = self._has_groups and self.options.frame == DEFAULT_FRAME and self.wordings is None
        for task in self.tasks:
            for episode in self.episodes[:1] if usual else self.episodes:
                settings = self.settings_of(task, episode)
                yield from self._jobs_of(None, task, episode, settings, (TOLD,), (0,))

    def _check_options(self) -> None:
        for form, stages in itertools.product(self.forms, self.stages):
            check_options(replace(self.options, form=form, stages=stages))
        check_names("kind of meshes", (self.meshes,), MESHES)
        for arm in self.arms:
            check_arm(arm)
        turned = [name for name, one in all_settings().items() if "delivery" in one.reads]
        check_names("setting in turns", self.in_turns, turned)
        for name in ("max_steps", "tries", "batch"):
            if getattr(self, name) < 1:
                raise InvalidValueError(f"{name} is {getattr(self, name)}; it must be at least 1.")
        for name in ("policy_timeout_s", "episode_timeout_s"):
            if not 0 < getattr(self, name) <= MOST_SECONDS:
                raise InvalidValueError(
                    f"{name} is {getattr(self, name)}; it must be more than 0 and at most "
                    f"{MOST_SECONDS:,} seconds."
                )
        if self.actions is not None:
            find_action_space(self.actions)
        check_observe_every(self.observe_every)

    def _check_settings(self, task: str) -> None:
        has = language.settings_of(tasks.get_task(task))
        for setting in () if self._has_groups else self.setting_names:
            check_names("setting", (setting,), language.setting_names())
            if setting not in has:
                raise InvalidValueError(
                    f"{task} has no {setting} setting; its settings are {', '.join(has)}."
                )


SINGLE_OPTIONS = tuple(name for name in OPTION_NAMES if name not in (*AXES, *Plan.model_fields))
"""Options of instructions of which a plan has one value, in `options`."""


@functools.lru_cache(maxsize=65_536)
def _has_arm(job: Job, arm: str) -> bool:
    """Return whether an instruction, a job without a policy, has an arm."""
    try:
        instruct_job(msgspec.structs.replace(job, arm=arm))
    except InvalidValueError:
        return False
    return True


def _names_the_goal(options: InstructionOptions) -> bool:
    return options.setting == EXPLICIT or options.form == "resolved"


def nest_options(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a plan, with the options of instructions among them in `options`."""
    options = {name: value for name, value in fields.items() if name in SINGLE_OPTIONS}
    others = {name: value for name, value in fields.items() if name not in SINGLE_OPTIONS}
    return {**others, "options": {**fields.get("options", {}), **options}}
