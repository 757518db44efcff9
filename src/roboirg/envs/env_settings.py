"""The options of an environment with their defaults, and which of them a reset may change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from roboirg.core.actions import JOINT_ANGLE
from roboirg.core.episode import Episode
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.instruction_options import (
    OPTION_NAMES,
    InstructionOptions,
    as_fields,
    split_options,
)
from roboirg.core.observations import CAMERAS, DemonstrationFrames
from roboirg.language.wordings.wording_store import open_wordings
from roboirg.simulation.observation_builder import ObservationSpec
from roboirg.simulation.rendering.render_settings import find_render_settings
from roboirg.tasks.splits.splits import get_episode, split_size

MAX_STEPS = 1300
"""Control steps a policy has, as in RoboMME's published experiments."""
EXPLICIT_WORDS = InstructionOptions()
RENDER_MODES = ("rgb_array",)
RESET_OPTIONS = ("split", "episode", *OPTION_NAMES)
"""Options that `reset` takes: which episode is played, and in which words."""


@dataclass(frozen=True, kw_only=True)
class EnvSettings:
    """Options of an environment; `roboirg.make` documents them.

    Attributes:
        words: of the instruction; the file of its wordings has been opened.

    Raises:
        UnknownNameError: there is no such render mode.
        InvalidValueError: `max_steps` is no positive integer.
    """

    words: InstructionOptions = EXPLICIT_WORDS
    split: str = "test"
    episode: int | None = 0
    actions: str = JOINT_ANGLE.name
    cameras: Sequence[str] = CAMERAS
    depth: bool = False
    calibration: bool = False
    grounded: bool = False
    demonstration_frames: DemonstrationFrames = "all"
    observe_every: int | None = None
    history_cameras: Sequence[str] | None = None
    meshes: str = "faithful"
    max_steps: int = MAX_STEPS
    render_mode: str | None = None

    @classmethod
    def of(cls, options: Mapping[str, Any]) -> EnvSettings:
        """Return the settings of keyword arguments of `roboirg.make`; opens the wording file.

        Raises:
            InvalidValueError: a value is invalid, or the wording file cannot be read.
        """
        return replace(cls(), **_nested(EXPLICIT_WORDS, options))

    def __post_init__(self) -> None:
        if not isinstance(self.max_steps, int) or self.max_steps < 1:
            raise InvalidValueError(f"max_steps is {self.max_steps!r}; it must be an integer >= 1.")
        if self.render_mode is not None and self.render_mode not in RENDER_MODES:
            raise UnknownNameError("render mode", self.render_mode, RENDER_MODES)

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
            self.demonstration_frames,
            self.observe_every,
            self.history_cameras,
            find_render_settings(self.meshes),
        ).validated()

    def with_reset_options(self, options: Mapping[str, Any]) -> EnvSettings:
        """Return the settings of one reset.

        Raises:
            UnknownNameError: an option is not one that a reset may change.
        """
        for name in options:
            if name not in RESET_OPTIONS:
                raise UnknownNameError("reset option", name, RESET_OPTIONS)
        return replace(self, **_nested(self.words, options))

    def find_episode(self, task: str | Episode, index: int) -> Episode:
        """Return the episode to play: number `index`, or `task` itself if it is an episode."""
        return task if isinstance(task, Episode) else get_episode(task, self.split, index)


def _nested(words: InstructionOptions, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return keyword arguments of `EnvSettings`, in which `words` holds those of the words."""
    chosen, others = split_options(options)
    chosen = as_fields(chosen)
    if "wordings" in chosen:
        chosen["wordings"] = open_wordings(chosen["wordings"])
    return {**others, "words": replace(words, **chosen)}


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
    return 0 if last is None else (last + 1) % settings.episodes
