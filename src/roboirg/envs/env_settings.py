"""The options of an environment with their defaults, and which of them a reset may change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from roboirg.core.actions import JOINT_ANGLE
from roboirg.core.arms import TOLD, check_arm
from roboirg.core.environment_options import (
    ENVIRONMENT_OPTIONS,
    EnvironmentKeywords,
    EnvironmentOptions,
    check_demonstration_frames,
)
from roboirg.core.episode import Episode
from roboirg.core.errors import check_names
from roboirg.core.instruction_options import (
    OPTION_NAMES,
    InstructionKeywords,
    InstructionOptions,
    as_fields,
)
from roboirg.core.observations import CAMERAS
from roboirg.language.scenarios.wording_store import open_wordings
from roboirg.simulation.observation_builder import ObservationSpec
from roboirg.simulation.rendering.render_settings import RenderSettings
from roboirg.tasks.splits.splits import get_episode, split_size

EXPLICIT_WORDS = InstructionOptions()
USUAL = EnvironmentOptions(actions=JOINT_ANGLE.name, demonstration_frames="all")
"""What is played if neither the caller nor a policy asks for anything else."""
RENDER_MODES = ("rgb_array",)
RESET_OPTIONS = ("split", "episode", "arm", *OPTION_NAMES)
"""Options that `reset` takes: which episode is played, and in which words."""


class EnvOptions(InstructionKeywords, EnvironmentKeywords, total=False):
    """Keyword arguments of `make`, which documents them; `EnvSettings` has the defaults."""

    split: str
    episode: int | None
    arm: str
    cameras: Sequence[str]
    depth: bool
    calibration: bool
    grounded: bool
    history_cameras: Sequence[str] | None
    render_mode: str | None


@dataclass(frozen=True, kw_only=True)
class EnvSettings:
    """Options of an environment; `roboirg.make` documents them.

    Attributes:
        words: options of the instruction; the file of its wordings has been opened.
        environment: options of how it is played; none of them is left to a policy.
        split, episode, arm, …: as the keyword arguments of `make`.

    Raises:
        UnknownNameError: there is no such render mode or arm.
        InvalidValueError: `max_steps` is no positive integer.
    """

    words: InstructionOptions = EXPLICIT_WORDS
    environment: EnvironmentOptions = USUAL
    split: str = "test"
    episode: int | None = 0
    arm: str = TOLD
    cameras: Sequence[str] = CAMERAS
    depth: bool = False
    calibration: bool = False
    grounded: bool = False
    history_cameras: Sequence[str] | None = None
    render_mode: str | None = None

    @classmethod
    def of(cls, options: Mapping[str, Any]) -> EnvSettings:
        """Return the settings of keyword arguments of `roboirg.make`; opens the wording file.

        Raises:
            InvalidValueError: a value is invalid, or the wording file cannot be read.
        """
        return cls().with_options(options)

    def __post_init__(self) -> None:
        self.environment.check()
        if self.render_mode is not None:
            check_names("render mode", [self.render_mode], RENDER_MODES)
        check_arm(self.arm)

    @property
    def episodes(self) -> int:
        """Number of episodes in the split.

        Raises:
            UnknownNameError: there is no such split.
        """
        return split_size(self.split)

    def observation_spec(self) -> ObservationSpec:
        """Return the fields of observations and of the video."""
        return ObservationSpec(
            self.cameras,
            self.depth,
            self.calibration,
            check_demonstration_frames(self.environment.demonstration_frames),
            self.environment.observe_every,
            self.history_cameras,
            RenderSettings(meshes=self.environment.meshes),
        ).validated()

    def with_reset_options(self, options: Mapping[str, Any]) -> EnvSettings:
        """Return the settings of one reset, which change these for that reset alone.

        Args:
            options: values by the names in `RESET_OPTIONS`.

        Raises:
            UnknownNameError: an option is not one that a reset may change.
        """
        check_names("reset option", options, RESET_OPTIONS)
        return self.with_options(options)

    def with_options(self, options: Mapping[str, Any]) -> EnvSettings:
        """Return the settings with some values replaced; opens the wording file if one is named.

        Args:
            options: keyword arguments of `make`. Those of the instruction go into `words`, those of
                the environment into `environment`, and all others are fields of the settings.
        """
        check_names("option of make()", options, EnvOptions.__annotations__)
        words: dict[str, Any] = {}
        environment: dict[str, Any] = {}
        others: dict[str, Any] = {}
        for name, value in options.items():
            if name in OPTION_NAMES:
                words[name] = value
            elif name in ENVIRONMENT_OPTIONS:
                environment[name] = value
            else:
                others[name] = value
        words = as_fields(words)
        if "wordings" in words:
            words["wordings"] = open_wordings(words["wordings"])
        return replace(
            self,
            words=replace(self.words, **words),
            environment=replace(self.environment, **environment),
            **others,
        )

    def find_episode(self, task: str | Episode, index: int) -> Episode:
        """Return the episode to play.

        Args:
            task: name of the task, or the episode itself.
            index: number of the episode in the split; ignored where the task is an episode.
        """
        if isinstance(task, Episode):
            return task
        return get_episode(task, self.split, index)


def choose_index(settings: EnvSettings, seed: int | None, last: int | None) -> int:
    """Return the number of the episode that a reset plays.

    Args:
        settings: of the reset. If they name an episode, it is that one.
        seed: of the reset. Without a named episode, ``seed % episodes`` is played.
        last: the episode played before; without a seed, the next one is played, from 0 on.
    """
    if settings.episode is not None:
        return settings.episode
    if seed is not None:
        return seed % settings.episodes
    if last is None:
        return 0
    return (last + 1) % settings.episodes
