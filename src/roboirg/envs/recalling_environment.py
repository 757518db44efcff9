"""An environment that simulates equal actions in a scene once, whatever is said about the scene.

A policy that reads two instructions alike moves alike, and the simulator gives the same bits again.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roboirg.core.actions import check_chunk
from roboirg.core.arms import TOLD
from roboirg.core.episode import Episode, Stage
from roboirg.core.subgoal_text import Point
from roboirg.envs.env_options import EnvOptions
from roboirg.envs.env_settings import EXPLICIT_WORDS
from roboirg.envs.environment import RoboIRGEnv
from roboirg.envs.episode_state import EpisodeState
from roboirg.envs.recollection import EndState, Moment, Recollection, StepResult


class RecallingEnv(RoboIRGEnv):
    """Returns what followed from the same actions in the same scene before, if it did.

    The simulator starts when it is needed, and first executes the actions of which the results
    were recalled. The instruction is complete at the reset, and there is no frame hook.

    Args:
        played: at each reset.
        recollection: shared by environments that are used one after the other.
        **options: as of `RoboIRGEnv`.
    """

    def __init__(
        self, played: Episode, recollection: Recollection, **options: Unpack[EnvOptions]
    ) -> None:
        super().__init__(played, **options)
        self._recollection = recollection
        self._moment: Moment | None = None
        self._recalled: list[NDArray[np.float64]] = []
        self._reset_arguments: dict[str, Any] = {}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start the episode, without the simulator if its beginning is known."""
        self._choose_episode(seed, options or {})
        self._state, self._moment, self._recalled = None, None, []
        self._reset_arguments = {"seed": seed, "options": options}
        settings = replace(self._settings, words=EXPLICIT_WORDS, arm=TOLD)
        goal = self.episode.goal, self.original is None
        known = self._recollection.start_of(goal, self.original or self.episode, settings)
        if known is None:
            observation, info = super().reset(seed=seed, options=options)
            kept = {**info, "demonstration": info["demonstration"].undrawn()}
            self._moment = self._simulated((observation, 0.0, False, False, kept))
            self._recollection.keep_start(goal, self._moment)
            return observation, info
        self._moment = known
        spoken = self._spoken()
        observation, *_, info = known.in_words(spoken.prompt)
        heard = [one._asdict() for one in spoken.heard]
        video = info["demonstration"].undrawn()
        return observation, {**info, "heard": heard, "demonstration": video}

    def step_chunk(self, actions: ArrayLike) -> StepResult:
        """Execute several actions, or recall what followed from them."""
        chunk = check_chunk(actions, self._space)
        before, key = self._moment, chunk.tobytes()
        known = None if before is None else before.following.get(key)
        if before is None or known is None:
            result = super().step_chunk(chunk)
            self._moment = self._simulated(result)
            if before is not None:
                self._recollection.keep(self._moment, before, key)
            return result
        if self._state is None:
            self._recalled.append(chunk)
        else:
            with self._unseen():
                super().step_chunk(chunk)
        self._moment = known
        return known.in_words(self._spoken().prompt)

    @property
    def executed_actions(self) -> int:
        """Number of actions executed since reset; the last perhaps in part."""
        return super().executed_actions if self._moment is None else self._moment.executed_actions

    @property
    def due_stage(self) -> Stage | None:
        """The stage that is due; None after the last."""
        return super().due_stage if self._moment is None else self._moment.stage

    def end_state(self) -> EndState:
        """Return the state in numbers and as a hash."""
        if self._moment is None:
            return super().end_state()
        if self._moment.end is None:
            self._moment.end = super().end_state()
        return self._moment.end

    def picture(self, camera: str) -> NDArray[np.uint8]:
        """Return the current picture of a camera, uint8 (256, 256, 3)."""
        seen: Mapping[str, Any] = {} if self._moment is None else self._moment.result[0]
        known: NDArray[np.uint8] | None = seen.get(f"{camera}_rgb")
        return super().picture(camera) if known is None else known

    def objects_at(self, point: Point) -> frozenset[str] | None:
        """Return the names of the objects at a point of the front picture."""
        if self._moment is None:
            return super().objects_at(point)
        if point not in self._moment.objects:
            self._moment.objects[point] = super().objects_at(point)
        return self._moment.objects[point]

    def close(self) -> None:
        """Release the current episode."""
        super().close()
        self._moment = None

    @property
    def _current(self) -> EpisodeState:
        if self._state is None and self._moment is not None:
            self._catch_up()
        return super()._current

    def _catch_up(self) -> None:
        """Bring the simulator to the present moment."""
        moment, self._moment = self._moment, None
        recalled, self._recalled = self._recalled, []
        with self._unseen():
            super().reset(**self._reset_arguments)
            for chunk in recalled:
                super().step_chunk(chunk)
        self._moment = moment

    @contextlib.contextmanager
    def _unseen(self) -> Iterator[None]:
        """Draw nothing of what has been seen before."""
        draws, self.draws = self.draws, False
        try:
            yield
        finally:
            self.draws = draws

    def _record_history(self) -> None:
        if self.draws:
            super()._record_history()

    def _simulated(self, result: StepResult) -> Moment:
        """Return the present moment, as the simulator has it."""
        self._moment = None
        return Moment(result, self.executed_actions, self.due_stage)
