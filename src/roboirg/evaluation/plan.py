"""What is to be played, checked before anything starts."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Literal, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from roboirg import language, policies, splits, tasks
from roboirg.errors import InvalidValueError, UnknownNameError
from roboirg.evaluation.record import (
    ALL_STAGES,
    DEFAULT_DISTRACTOR,
    DEFAULT_FRAME,
    DEFAULT_MAX_STEPS,
    Job,
)
from roboirg.evaluation.store import write_atomically
from roboirg.language.instruction import FORMS, SETTINGS, Instruction

_MOST_NUMBERS = 10_000
_MOST_DIGITS = 18
_LONGEST_WORD = 40
_NUMBERS_HINT = "write numbers and ranges such as 0,3,5-9"
_WHOLE: Literal["all"] = "all"

PLAN_FILE = "plan.json"

VideoMode = Literal["off", "failures", "all"]
VIDEO_MODES: tuple[VideoMode, ...] = get_args(VideoMode)


class Plan(BaseModel):
    """Which policies play which episodes, told how.

    Attributes:
        policies: built-in names or ``package.module:Class``.
        tasks: names.
        settings: names, or ``"all"`` for those in which each episode can be told.
        forms: implicit, resolved or both.
        split: train, val or test.
        episodes: 0-based positions in the split.
        policy_seeds: each plays every episode.
        stages: of the discourse, for the contextual setting.
        distractor: for the contextual setting.
        frame: for the spatial setting.
        max_steps: the policy's limit, control steps.
        video: which episodes are filmed. Not part of a record's identity.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    policies: tuple[str, ...]
    tasks: tuple[str, ...]
    settings: tuple[str, ...] | Literal["all"] = "all"
    forms: tuple[str, ...] = ("implicit",)
    split: str = "test"
    episodes: tuple[int, ...]
    policy_seeds: tuple[int, ...] = (0,)
    stages: tuple[int, ...] = ALL_STAGES
    distractor: str = DEFAULT_DISTRACTOR
    frame: str = DEFAULT_FRAME
    max_steps: int = DEFAULT_MAX_STEPS
    video: VideoMode = "off"

    def checked(self) -> Plan:
        """This plan, if all of it can be played.

        Raises:
            UnknownNameError: a policy, task, setting, … does not exist; names the nearest.
            InvalidValueError: a number is out of range, or a task lacks a setting.
        """
        for name in self.policies:
            policies.load_policy_class(name)
        _check_names("form", self.forms, FORMS)
        if self.max_steps < 1:
            raise InvalidValueError(f"max_steps is {self.max_steps}; it must be at least 1.")
        for task in self.tasks:
            for index in (min(self.episodes), max(self.episodes)):
                splits.get_episode(task, self.split, index)
            self._check_settings(task)
        for said in dict.fromkeys(map(_words, self.jobs())):
            # Whether it can be said so is the language's to judge, for every episode.
            say(said)
        return self

    def jobs(self) -> tuple[Job, ...]:
        """Every episode to play, once: by policy, task, episode, setting, form, seed."""
        return tuple(
            dict.fromkeys(
                self._job(policy, task, episode, setting=setting, form=form, seed=seed)
                for policy in self.policies
                for task in self.tasks
                for episode in self.episodes
                for setting in self.settings_of(task, episode)
                for form in self.forms
                for seed in self.policy_seeds
            )
        )

    def settings_of(self, task: str, episode: int) -> tuple[str, ...]:
        """The settings in which an episode is to be played."""
        if self.settings == "all":
            return language.expressible(splits.get_episode(task, self.split, episode))
        return self.settings

    def _job(
        self, policy: str, task: str, episode: int, *, setting: str, form: str, seed: int
    ) -> Job:
        # Options that say nothing in a setting keep their defaults there: the same words are
        # the same job.
        contextual, spatial = setting == "contextual", setting == "spatial"
        return Job(
            policy=policy,
            task=task,
            split=self.split,
            episode=episode,
            setting=setting,
            form="implicit" if setting == "explicit" else form,
            stages=self.stages if contextual else ALL_STAGES,
            distractor=self.distractor if contextual else DEFAULT_DISTRACTOR,
            frame=self.frame if spatial else DEFAULT_FRAME,
            policy_seed=seed,
            max_steps=self.max_steps,
        )

    def _check_settings(self, task: str) -> None:
        has = tasks.get_task(task).settings
        for setting in () if self.settings == "all" else self.settings:
            _check_names("setting", (setting,), SETTINGS)
            if setting not in has:
                raise InvalidValueError(
                    f"{task} has no {setting} setting; its settings are {', '.join(has)}."
                )


def make_plan(
    policies: Iterable[str],
    *,
    tasks: str = "all",
    settings: str = "all",
    forms: str = "implicit",
    episodes: str = "4",
    policy_seeds: str = "0",
    stages: str = "1-5",
    **options: object,
) -> Plan:
    """A checked plan from words as they are typed.

    Args:
        policies: names.
        tasks: names separated by commas, or ``all``, alone or among them.
        settings: names separated by commas, or ``all``, alone or among them.
        forms: names separated by commas.
        episodes: ``4`` for the first four, or a list such as ``0,3,5-9``.
        policy_seeds: a list of numbers.
        stages: a list of numbers.
        **options: other fields of `Plan`.

    Raises:
        UnknownNameError: something does not exist; names the nearest.
        InvalidValueError: a number or combination is out of range.
    """
    video, split = options.get("video", "off"), str(options.get("split", "test"))
    if video not in VIDEO_MODES:
        raise UnknownNameError("video mode", video, VIDEO_MODES)
    try:
        plan = Plan(
            policies=parse_names("policy", ",".join(policies)),
            tasks=_task_names(tasks),
            settings=_WHOLE if says_all(settings) else parse_names("setting", settings),
            forms=parse_names("form", forms),
            episodes=parse_episodes(episodes, split),
            policy_seeds=parse_numbers("policy seed", policy_seeds),
            stages=parse_stages(stages),
            **options,  # type: ignore[arg-type]
        )
    except ValidationError as error:
        first = error.errors()[0]
        name = ".".join(str(part) for part in first["loc"])
        raise InvalidValueError(f"{name} is {first['input']!r}: {first['msg']}.") from error
    return plan.checked()


def write_plan(plan: Plan, folder: Path) -> None:
    """Keep the newest plan of a folder beside its records."""
    write_atomically(folder / PLAN_FILE, plan.model_dump_json(indent=2) + "\n")


def read_plan(folder: Path) -> Plan | None:
    """The newest plan of a folder; None if it has none that this version understands."""
    try:
        return Plan.model_validate_json((folder / PLAN_FILE).read_bytes())
    except (OSError, ValidationError):
        return None


def parse_names(kind: str, text: str) -> tuple[str, ...]:
    """Names separated by commas, each once.

    Raises:
        InvalidValueError: there is none.
    """
    names = tuple(dict.fromkeys(word.strip() for word in text.split(",") if word.strip()))
    if not names:
        raise InvalidValueError(f"No {kind} was given.")
    return names


def says_all(text: str) -> bool:
    """Whether a list of names is, or contains, the word for all of them."""
    return _WHOLE in (word.strip().lower() for word in text.split(","))


def parse_episodes(text: str, split: str = "test") -> tuple[int, ...]:
    """``4`` is the first four episodes; with a comma or a dash it is a list of positions.

    Raises:
        UnknownNameError: there is no such split.
        InvalidValueError: it is neither, no episode at all, or the split has fewer.
    """
    size = splits.SIZES[splits.check_split(split)]
    found = re.fullmatch(r"\s*(-?)(\d+)\s*", text)
    if found is None:
        ranges = _parse_ranges("episode", text, _NUMBERS_HINT)
    else:
        count = _number("number of episodes", found[2])
        if found[1] or count == 0:
            alone = "" if count else "; for episode 0 alone write '0,'"
            raise InvalidValueError(
                f"The number of episodes is {text.strip()}; it must be at least 1{alone}."
            )
        ranges = [range(count)]
    for numbers in ranges:
        if numbers[-1] >= size:
            raise InvalidValueError(
                f"There is no episode {numbers[-1]}: split {split!r} has episodes 0 to {size - 1}."
            )
    return _union(ranges)


def parse_stages(text: str) -> tuple[int, ...]:
    """Stages of the contextual setting, such as ``1,5``.

    Raises:
        InvalidValueError: it is no list of numbers.
    """
    sets = "; ".join(",".join(map(str, stages)) for stages in language.STAGE_SETS)
    return _union(_parse_ranges("list of stages", text, f"the four are {sets}"))


def parse_numbers(kind: str, text: str) -> tuple[int, ...]:
    """Numbers and ranges separated by commas, such as ``0,3,5-9``, each once, in order.

    Raises:
        InvalidValueError: it is something else, or a very long list.
    """
    return _union(_parse_ranges(kind, text, _NUMBERS_HINT))


def _parse_ranges(kind: str, text: str, hint: str) -> list[range]:
    ranges = []
    for part in parse_names(kind, text):
        found = re.fullmatch(r"(\d+)(?:\s*-\s*(\d+))?", part)
        first, last = (-1, -2) if found is None else _ends(kind, found[1], found[2])
        if last < first:
            raise InvalidValueError(f"{_short(part)!r} is no {kind}; {hint}.")
        ranges.append(range(first, last + 1))
    return ranges


def _ends(kind: str, first: str, last: str | None) -> tuple[int, int]:
    return _number(kind, first), _number(kind, last or first)


def _number(kind: str, digits: str) -> int:
    if len(digits) > _MOST_DIGITS:
        raise InvalidValueError(
            f"The {kind} {_short(digits)} has {len(digits)} digits; "
            f"it must have at most {_MOST_DIGITS}."
        )
    return int(digits)


def _union(ranges: Sequence[range]) -> tuple[int, ...]:
    count = sum(map(len, ranges))
    if count > _MOST_NUMBERS:
        raise InvalidValueError(
            f"A list of {count} numbers is too long; at most {_MOST_NUMBERS} are allowed."
        )
    return tuple(dict.fromkeys(number for numbers in ranges for number in numbers))


def _short(text: str) -> str:
    return text if len(text) <= _LONGEST_WORD else f"{text[:_LONGEST_WORD]}…"


def _task_names(text: str) -> tuple[str, ...]:
    return tuple(tasks.all_tasks()) if says_all(text) else parse_names("task", text)


def say(job: Job) -> Instruction:
    """The instruction of a job.

    Raises:
        InvalidValueError: it cannot be said so.
    """
    return language.instruct(
        splits.get_episode(job.task, job.split, job.episode),
        job.setting,
        job.form,
        stages=job.stages,
        distractor=job.distractor,
        frame=job.frame,
    )


def _words(job: Job) -> Job:
    """The job as far as words go: whoever hears them, however often."""
    return job.model_copy(update={"policy": "", "policy_seed": 0})


def _check_names(kind: str, names: Iterable[str], known: Iterable[str]) -> None:
    for name in names:
        if name not in known:
            raise UnknownNameError(kind, name, known)
