"""The policy: what has been learned names the goal, and the scripted expert executes it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboirg.extension.episodes import Goal, goals_of
from roboirg.extension.policies import (
    Demonstration,
    RoboIRGEnv,
    SaidAndShown,
    ScriptedPolicy,
)
from roboirg_learn.labeled_views import pictures_to_see
from roboirg_learn.learn_support import check_learn_support

if TYPE_CHECKING:
    from roboirg_learn.listener.learned_model import LearnedModel

FRAMES_EVERY = 8
"""Control steps between the frames of the video that it gets."""


class LearnedNamer:
    """Names the goal that a trained listener understands, from words and pictures alone."""

    cameras = ("front",)
    demonstration_frames = FRAMES_EVERY

    def __init__(self, path: Path) -> None:
        check_learn_support()
        from roboirg_learn.listener.learned_model import load_model

        self._model: LearnedModel = load_model(path)
        self.version = self._model.version
        self.trained_tasks = self._model.vocabulary.tasks

    @property
    def metadata(self) -> dict[str, Any]:
        """How it was trained."""
        return {"trained": self._model.about}

    def name_goal(self, given: SaidAndShown) -> Goal:
        """Return the goal that the listener understands, perhaps one that the scene lacks."""
        frames = given.demonstration.get("front_rgb", ())
        pictures = pictures_to_see(given.take_picture(), frames, FRAMES_EVERY)
        return self._model.understand(given.task, given.text, pictures)


class LearnedListener(ScriptedPolicy):
    """Executes the goal that a trained listener understands.

    It gets the words and the pictures of `pictures_to_see`; only the hands are privileged. If the
    scene does not have the goal, it holds still.
    """

    cameras = ("front",)
    demonstration_frames = FRAMES_EVERY

    def __init__(self, path: Path, seed: int = 0) -> None:
        super().__init__(seed)
        self.understood: Goal | None = None
        self._namer = LearnedNamer(path)
        self.version = self._namer.version
        self.trained_tasks = self._namer.trained_tasks
        self._demonstration: Demonstration = {}

    @property
    def metadata(self) -> dict[str, Any]:
        """How it was trained, and the goal that it understood."""
        goal = self.understood
        understood = None if goal is None else dict(goal.as_mapping())
        return {**self._namer.metadata, "understood": understood}

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin an episode; the instruction is understood when it has been heard to its end."""
        self._demonstration = demonstration
        self.understood = None
        super().reset(instruction, demonstration)

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal | None:
        """Return the goal that the listener understands, to be executed; None to hold still.

        A goal that the scene does not have cannot be executed. What was understood stays in
        `understood`, for the record.
        """
        given = SaidAndShown.of(env, instruction, self._demonstration)
        self._demonstration = {}
        self.understood = self._namer.name_goal(given)
        return self.understood if self.understood in goals_of(env.episode) else None
