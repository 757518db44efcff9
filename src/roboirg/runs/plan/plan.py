"""Plans: which episodes to play, checked before anything starts.

A job is one episode that one policy plays. Here a job without a policy stands for an instruction:
what is said of a scene in one setting. Options are grouped in sections, such as `environment`;
most of them may also stand alone in a plan.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
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
from roboirg.core.instruction_options import (
    DEFAULT_FRAME,
    InstructionOptions,
)
from roboirg.core.policy_ref import PolicyRef
from roboirg.core.word_pools import POOLS
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
from roboirg.records.film import VideoMode
from roboirg.records.record import Job, Summary
from roboirg.records.record_codec import RecordKey, identity_key
from roboirg.runs.hosting.policy_opening import open_policy
from roboirg.runs.job_instruction import instruct_job
from roboirg.runs.plan.option_parsing import (
    Names,
    Numbers,
    distinct,
    name_and_spec,
    parse_arms,
    parse_episodes,
    parse_names,
    parse_numbers,
    parse_policies,
    parse_stage_sets,
)
from roboirg.runs.plan.plan_sections import Attempts, Hosting, ModelUse, WorkerNeeds, names_of
from roboirg.tasks.splits import splits
from roboirg.tasks.splits.private_splits import MissingSaltError, is_private
from roboirg.util.short_hash import short_hash

MOST_JOBS = 1_000_000
REQUIRED = "required"
"""Instead of a wording file in a plan: one must be given when the plan is run."""

AXES = ("setting", "form", "stages")
"""Options of instructions of which a plan plays several."""
_UNDERSCORED_NUMBER = re.compile(r"[\d._]*_[\d._]*")
"""``1_000``, which Python would read as a number."""


def _read_policies(given: object) -> object:
    """Read policies that are typed, such as ``"oracle,mine=lab:Walk"``, into references.

    What is no text is returned as it is: pydantic takes references and refuses anything else.
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

    A group that means all that is named stands alone: ``"direct,All"`` becomes ``("all",)``.
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
    """Open the wordings that a text or a path names; stored ones are taken as they are."""
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


class Plan(BaseModel):
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
    words: Names = ()

    @model_validator(mode="before")
    @classmethod
    def _nest(cls, given: object) -> object:
        """Put options that stand alone into their sections, before pydantic checks the values.

        ``{"max_steps": 600}`` becomes ``{"environment": {"max_steps": 600}}``. `FLAT` has the
        section of each such option.
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
            if is_dataclass(options) and not isinstance(options, type):
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
    def _check_text(self) -> Plan:
        """Refuse a text that cannot be printed or stored, wherever it stands."""
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
        """Refuse a plan of more jobs than a run can hold, before any is made."""
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
    def _has_groups(self) -> bool:
        """Whether a word such as ``all`` stands for settings; an episode may then lack some."""
        return not SETTING_GROUPS.keys().isdisjoint(self.settings)

    @property
    def fingerprint(self) -> str:
        """Hash of all fields but names of variables and what follows from the others."""
        excluded: Mapping[str, Any] = {
            "hosting": {"policy_env"},
            "policies": {"__all__": {"makeup"}},
        }
        return short_hash(self.model_dump_json(exclude=excluded))

    def checked(self) -> Plan:
        """Return this plan with opened policies and its words, if all of it can be played.

        Raises:
            UnknownNameError: a policy, task, setting, … does not exist; the message suggests the
                nearest.
            InvalidValueError: a number is out of range, or a task lacks a setting.
        """
        self._check_options()
        self._check_scenes()
        instructions = list(self._instructions_to_check())
        if not instructions:
            raise InvalidValueError(
                f"There is nothing to play: {', '.join(self.settings)} cannot express any of "
                "these episodes."
            )
        words = set()
        for job in instructions:
            instruction = instruct_job(job)  # raises if the options cannot express the episode
            words.add(str(instruction.metadata["words"]))

        check_variables(self.hosting.policy_env, "policies")
        # Each of the user's policies is opened in a process of its own, wherever it plays later.
        host_settings = replace(self.hosting, policy_process="own").settings
        time_limit = self.hosting.policy_timeout_s
        opened = [open_policy(policy, time_limit, host_settings) for policy in self.policies]
        found = {"policies": tuple(opened), "words": tuple(sorted(words))}
        return self.model_copy(update=found)

    def _check_options(self) -> None:
        """Raise if a policy, a name or an option is wrong, which no episode is needed to see."""
        tasks.find_tasks(self.tasks)
        find_settings(self.settings)
        _check_policy_names(self.policies)
        for form, stages in itertools.product(self.forms, self.stages):
            check_options(replace(self.instruction, form=form, stages=stages))
        self.environment.check()
        # Only a setting that reads the option `delivery` can be said in turns.
        in_turns = [name for name, rule in all_settings().items() if "delivery" in rule.reads]
        check_names("setting in turns", self.in_turns, in_turns)
        if is_private(self.split) and self.hosting.policy_process == "shared":
            raise InvalidValueError(
                "policy_process is 'shared', so policies would know the salt of private episodes; "
                "it must be 'own'."
            )

    def _check_scenes(self) -> None:
        """Raise if the split lacks an episode, or a task has no setting of a name that is given."""
        for task in self.tasks:
            # If the first and the last exist, so do all between them.
            splits.get_episode(task, self.split, min(self.episodes))
            splits.get_episode(task, self.split, max(self.episodes))
            if self._has_groups:  # a task may lack some settings of a group
                continue
            for setting in self.setting_names:
                get_setting(setting, tasks.get_task(task))

    def jobs(self, played: Iterable[Summary] = ()) -> tuple[Job, ...]:
        """Return every job, ordered by policy, task, episode, setting, form, stages and seed.

        Of a scene, what leaves the goal implicit comes first: a policy that keeps what it heard
        has not heard the explicit command of the scene yet.

        Args:
            played: results, to save time: what was said can be said.
        """
        said = {
            (result.task, result.episode, result.setting)
            for result in played
            if result.split == self.split
        }

        # What can be said of an episode is slow to find, so all policies share it.
        instructions: list[Job] = []
        for task in self.tasks:
            for episode in self.episodes:
                instructions += self._instructions(task, episode, said)
        jobs: list[Job] = []
        for policy in self.policies:
            for instruction in instructions:
                jobs += self._trials(policy, instruction)
        return tuple(jobs)

    def left_out(self, jobs: Iterable[Job]) -> Mapping[str, int]:
        """Return how many jobs each arm lacks, because it has no other goal or cannot be said.

        Args:
            jobs: of this plan.
        """
        # By arm, what is played in it: the keys of its jobs as if they were of the usual arm, so
        # that jobs which differ only in the arm have the same.
        trials = {arm: set[RecordKey]() for arm in self.arms}
        for job in jobs:
            trials[job.arm].add(identity_key(msgspec.structs.replace(job, arm=TOLD)))
        total = len(set[RecordKey]().union(*trials.values()))
        return {arm: total - len(keys) for arm, keys in trials.items() if len(keys) < total}

    def drawable_jobs(self, played: Iterable[Summary] = ()) -> tuple[Job, ...]:
        """Return the jobs whose words can be made here, for counting what a stored run lacks.

        There are none if the episodes are private and their salt is not known. Tasks and settings
        whose package is not installed are left out.

        Args:
            played: results of the run, as in `jobs`.
        """
        try:
            splits.check_split(self.split)
        except MissingSaltError:
            return ()
        known_tasks = tasks.every_task()
        known_settings = {*all_settings(), *SETTING_GROUPS}
        found_tasks = tuple(name for name in self.tasks if name in known_tasks)
        found_settings = tuple(name for name in self.settings if name in known_settings)
        installed = {"tasks": found_tasks, "settings": found_settings}
        return self.model_copy(update=installed).jobs(played)

    def settings_of(
        self, task: str, episode: int, said: Collection[tuple[str, int, str]] = ()
    ) -> Names:
        """Return the settings in which an episode is played.

        Named settings are all played. Of a group such as ``all``, only those are that the task has
        and that can express this episode.

        Args:
            task: name of its task.
            episode: its position in the split.
            said: task, episode and setting of what is known to be expressible.
        """
        if not self._has_groups:
            return self.setting_names
        scene = splits.get_episode(task, self.split, episode)
        chosen = self.setting_names
        playable = []
        for setting in settings_of(tasks.get_task(task)):
            if setting not in chosen:
                continue
            # Explicit stays, so that a task without words is refused and not left out.
            is_sure = setting == EXPLICIT or (task, episode, setting) in said
            if is_sure or find_refusal(scene, InstructionOptions(setting)) is None:
                playable.append(setting)
        return tuple(playable)

    def _instructions(
        self, task: str, episode: int, said: Collection[tuple[str, int, str]] = ()
    ) -> Iterator[Job]:
        """Yield a job without a policy for each instruction that an episode is played with.

        Instructions that leave the goal implicit come first.

        Args:
            task: name of its task.
            episode: its position in the split.
            said: as in `settings_of`.
        """
        ways: list[InstructionOptions] = []
        for setting in self.settings_of(task, episode, said):
            ways += self._options_of(setting)
        ways.sort(key=_states_goal)
        for options in ways:
            if self._is_left_out(task, episode, options):
                continue
            yield Job(
                policy="",
                task=task,
                split=self.split,
                episode=episode,
                options=replace(options, wordings=self.wordings and self.wordings.identity),
                wordings_file=self.wordings and self.wordings.file,
                environment=self.environment,
            )

    def _trials(self, policy: PolicyRef, instruction: Job) -> Iterator[Job]:
        """Yield the jobs of a policy with an instruction, one for each arm and seed."""
        for arm in self.arms:
            if arm != TOLD and not _has_arm(instruction, arm):
                continue
            for seed in self.policy_seeds:
                # Copying is faster than making, and there may be very many.
                yield msgspec.structs.replace(
                    instruction, policy=policy.name, ref=policy, policy_seed=seed, arm=arm
                )

    def _options_of(self, setting: str) -> Iterator[InstructionOptions]:
        """Yield the options of each instruction to play in a setting.

        There is one for each form and set of stages of the plan, and for some settings the same
        once more in turns. A setting names the options that change its words (`reads`); all others
        keep their defaults, so that no two jobs have the same words.
        """
        rule = all_settings()[setting]
        usual = InstructionOptions(setting)
        # Only an implicit goal can be said in several forms, and only some settings have stages.
        forms = self.forms if rule.implicit else (usual.form,)
        stage_sets = self.stages if "stages" in rule.reads else (usual.stages,)
        chosen = {option: getattr(self.instruction, option) for option in rule.reads - {"stages"}}
        for form, stages in itertools.product(forms, stage_sets):
            options = replace(usual, form=form, stages=stages, **chosen)
            yield options
            if setting in self.in_turns and options.delivery != TURNS:
                yield replace(options, delivery=TURNS)

    def _is_left_out(self, task: str, episode: int, options: InstructionOptions) -> bool:
        """Return whether a plan leaves an instruction out, because the scene is too simple for it.

        Such a setting is a harder version of a *plain* one and needs more, such as a second color.
        If the plain one cannot express the episode either, that is an error, and nothing is left
        out.
        """
        plain_setting = all_settings()[options.setting].plain
        if plain_setting is None:
            return False
        scene = splits.get_episode(task, self.split, episode)
        if find_refusal(scene, options) is None:
            return False
        return find_refusal(scene, replace(options, setting=plain_setting)) is None

    def _instructions_to_check(self) -> Iterator[Job]:
        """Yield a job for each instruction to check, as the language may not express it."""
        episodes = self.episodes
        has_usual_words = self.instruction.frame == DEFAULT_FRAME and self.wordings is None
        if self._has_groups and has_usual_words:
            # Settings of a group are played only where they can express the episode, so the first
            # episode of each task is enough.
            episodes = episodes[:1]
        for task in self.tasks:
            for episode in episodes:
                yield from self._instructions(task, episode)


def _own_keys(section: type[Any]) -> list[str]:
    """Return the options of a section that are not fields of the plan or axes of it."""
    names = [field.name for field in fields(section)]
    return [name for name in names if name not in AXES and name not in Plan.model_fields]


def _flat_options() -> dict[str, str]:
    """Return the options that may stand alone, each with its section."""
    flat = {}
    for section, names in SECTION_KEYS.items():
        if section != "cluster":
            flat.update(dict.fromkeys(names, section))
    return flat


SECTIONS: Mapping[str, type[Any]] = {
    name: field.annotation
    for name, field in Plan.model_fields.items()
    if is_dataclass(field.annotation) and isinstance(field.annotation, type)
}
"""The sections of a plan, each with its class."""
SECTION_KEYS = {section: _own_keys(kind) for section, kind in SECTIONS.items()}
"""The options of each section."""
FLAT = _flat_options()
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
    """Yield all options of a plan in order; in the place of a section, the options that it has.

    Of a section whose options never stand alone, the section itself is yielded.
    """
    for name, field in Plan.model_fields.items():
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


def _check_policy_names(policies: Iterable[PolicyRef]) -> None:
    """Raise if a name is not fit for records, or two policies have the same."""
    specs: dict[str, str] = {}
    for policy in policies:
        check_policy_name(policy.name)
        spec = specs.setdefault(policy.name, policy.spec)
        if spec != policy.spec:
            raise InvalidValueError(
                f"Two policies are named {policy.name!r}: {spec} and {policy.spec}."
            )


def _states_goal(options: InstructionOptions) -> bool:
    """Return whether an instruction says outright what to do, so that it is played last."""
    return options.setting == EXPLICIT or options.form == "resolved"


@functools.lru_cache(maxsize=65_536)
def _has_arm(job: Job, arm: str) -> bool:
    """Return whether an instruction, a job without a policy, has an arm."""
    try:
        instruct_job(msgspec.structs.replace(job, arm=arm))
    except InvalidValueError:
        return False
    return True


def _check_sections(options: Mapping[str, Any]) -> None:
    """Raise if a section has an unknown option, or one that also stands outside of it."""
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
    """Return all texts in a value, keys of mappings included."""
    if isinstance(value, str):
        return [value]
    if isinstance(value, Mapping):
        value = (*value, *value.values())
    texts: list[str] = []
    if isinstance(value, tuple):
        for part in value:
            texts += _texts(part)
    return texts
