"""A Gymnasium vector environment: many episodes at a time, in worker processes."""

from __future__ import annotations

import itertools
import multiprocessing
import os
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, Unpack, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from roboirg.core.actions import check_chunk, find_action_space
from roboirg.core.episode import Episode
from roboirg.core.errors import InvalidActionError, InvalidValueError, UnknownNameError
from roboirg.core.observations import FetchedDemonstration, FetchedFields
from roboirg.envs.env_options import EnvOptions
from roboirg.envs.env_settings import EnvSettings, choose_index
from roboirg.envs.environment import RoboIRGEnv
from roboirg.envs.vector.vector_workers import (
    Recipe,
    Request,
    SharedArrays,
    Transition,
    WorkerProcesses,
)

Chunks = ArrayLike | Sequence[ArrayLike]
Batch = Mapping[str, Any]
StepResult = tuple[Batch, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]


class RoboIRGVectorEnv(gymnasium.vector.VectorEnv[Batch, Any, NDArray[Any]]):
    """Sub-environments that play at the same time; each equals a `RoboIRGEnv` bit for bit.

    Observations hold the fields of `RoboIRGEnv` with a leading axis n; texts and histories are
    tuples of n. Infos are arrays (n,), with ``_key`` telling whose entries are meant.

    Episodes: with ``episode=None``, the default, a seed s plays episode ``s % size`` of the split,
    and ``reset(seed=s)`` gives the sub-environments s, s + 1, .... Without a seed, they begin with
    episodes 0 to n - 1, and each goes on with the episode n after its last, so that all are played
    once. The options of a reset hold until the next one, and for the resets in between that happen
    by themselves; ``episode`` may be a list of n.

    The workers end with the thread that makes it, so that thread must last.

    The arguments are those of `roboirg.make_vec`, which documents them and the errors.
    """

    single_observation_space: spaces.Dict

    def __init__(
        self,
        task: str | Episode,
        num_envs: int = 1,
        *,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        workers: int | None = None,
        lazy: bool = False,
        **options: Unpack[EnvOptions],
    ) -> None:
        for name, number in (("num_envs", num_envs), ("workers", workers)):
            if number is not None and (not isinstance(number, int) or number < 1):
                raise InvalidValueError(f"{name} is {number!r}; it must be an integer >= 1.")
        if not isinstance(task, Episode):
            options = {"episode": None, **options}
        single = RoboIRGEnv(task, **options)  # checks all options before a process starts
        self.num_envs, self._lazy = num_envs, lazy
        self._mode = _find_mode(autoreset_mode)
        self.metadata = {**RoboIRGEnv.metadata, "autoreset_mode": self._mode}
        self.render_mode = single.render_mode
        self.single_observation_space = single.observation_space
        self.single_action_space = single.action_space
        self.observation_space = batch_space(single.observation_space, num_envs)
        self.action_space = batch_space(single.action_space, num_envs)
        self._task = task
        self._settings = self._chosen = EnvSettings.of(options)
        self._space = find_action_space(single.actions)
        self._last: list[int | None] = [None] * num_envs
        self._kept: dict[str, Any] = {}
        self._over = np.zeros(num_envs, dtype=np.bool_)
        self._texts: list[dict[str, Any]] = [{} for _ in range(num_envs)]
        # Pictures that are drawn on demand are those of one moment and of one episode's start.
        self._moment, self._starts = 0, [0] * num_envs
        # Spawned, because the threads of the renderer do not survive a fork.
        context = multiprocessing.get_context("spawn")
        # Kept: the workers open its locks by name when they start.
        self._shared = SharedArrays.of(single.observation_space, num_envs, context)
        self._arrays = self._shared.open()
        self._pictures = frozenset(
            field for field in self._arrays if field.endswith(("_rgb", "_depth"))
        )
        self._processes = WorkerProcesses(
            Recipe(task, options, self._shared, self._pictures, eager=not lazy),
            num_envs,
            min(num_envs, workers or os.cpu_count() or 1),
        )

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Batch, dict[str, Any]]:
        """Start an episode in each sub-environment, or in those of ``options["reset_mask"]``.

        Args:
            seed: of the first one, or of each; see the class for what it chooses.
            options: those of `RoboIRGEnv.reset`, and ``reset_mask``, bool (n,).

        Raises:
            UnknownNameError: there is no such option, or one of its values does not exist.
            InvalidValueError: a length or value is wrong.
            SubEnvironmentError: a sub-environment raised, or its process was lost.
        """
        super().reset(seed=None, options=options)
        kept = dict(options or {})
        mask = self._check_mask(kept.pop("reset_mask", None))
        episodes = self._per_environment("episode", kept.pop("episode", None))
        seeds = self._check_seeds(seed)
        self._chosen, self._kept = self._settings.with_reset_options(kept), kept
        if isinstance(self._task, Episode) and any(one is not None for one in episodes):
            raise InvalidValueError("This environment was made for one episode; it takes no other.")
        requests: dict[int, Request] = {
            index: ("reset", (self._choose(index, seeds[index], episodes[index]),))
            for index in np.flatnonzero(mask).tolist()
        }
        observations, *_, infos = self._observe(self._ask(requests))
        return observations, infos

    def step(self, actions: ArrayLike) -> StepResult:
        """Execute one action in each sub-environment.

        Args:
            actions: (n, 8), in the other spaces (n, 7).

        Raises:
            InvalidActionError: wrong shape, not numeric or not finite; nothing has moved.
            ResetNeeded: an episode is over, and the autoreset mode is ``Disabled``.
            SubEnvironmentError: a sub-environment raised, or its process was lost.
        """
        return self.step_chunk([[action] for action in cast("Sequence[Any]", actions)])

    def step_chunk(self, actions: Chunks) -> StepResult:
        """Execute several actions in each sub-environment and observe once at the end.

        Each stops at the end of its episode. Where an episode was over before, autoreset mode
        ``NextStep`` starts the next one instead.

        Args:
            actions: (n, k, 8), or n arrays (k, 8) of different lengths; 7 in the other spaces.

        Raises:
            InvalidActionError: wrong shape, not numeric or not finite; nothing has moved.
            ResetNeeded: an episode is over, and the autoreset mode is ``Disabled``.
            SubEnvironmentError: a sub-environment raised, or its process was lost.
        """
        chunks = [check_chunk(rows, self._space) for rows in cast("Sequence[Any]", actions)]
        if len(chunks) != self.num_envs:
            raise InvalidActionError(f"{len(chunks)} actions for {self.num_envs} sub-environments.")
        if not self._was_reset:
            raise gymnasium.error.ResetNeeded("Call reset() first.")
        if self._over.any() and self._mode is AutoresetMode.DISABLED:
            raise gymnasium.error.ResetNeeded(
                f"Episodes of sub-environments {np.flatnonzero(self._over).tolist()} are over; "
                "call reset(options={'reset_mask': ...})."
            )
        requests: dict[int, Request] = {}
        # Resets for the case that a sub-environment's episode ends in this step.
        following: dict[int, dict[str, Any]] = {}
        before = list(self._last)
        for index, chunk in enumerate(chunks):
            if self._over[index]:
                requests[index] = ("reset", (self._choose(index),))
                continue
            if self._mode is AutoresetMode.SAME_STEP:
                following[index] = self._choose(index)
            requests[index] = ("step", (chunk, following.get(index)))
        answers = self._ask(requests)
        for index in following:
            if answers[index].final is None:  # the episode goes on
                self._last[index] = before[index]
        return self._observe(answers)

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Return the pictures of `RoboIRGEnv.render`; None without a render mode."""
        return None if self.render_mode is None else self.call("render")

    def call(self, name: str, *args: object, **options: object) -> tuple[Any, ...]:
        """Call a method of each environment, or return an attribute of each."""
        answers = self._processes.ask(
            dict.fromkeys(range(self.num_envs), ("call", (name, args, options)))
        )
        return tuple(answers[index] for index in range(self.num_envs))

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute of each environment."""
        return self.call(name)

    def close_extras(self, **_: object) -> None:
        """End the worker processes."""
        self._processes.close()

    @property
    def _was_reset(self) -> bool:
        """Whether every sub-environment has an episode, so that there are texts of each."""
        return all(self._texts)

    def _choose(
        self, index: int, seed: int | None = None, episode: int | None = None
    ) -> dict[str, Any]:
        """Choose the next episode of a sub-environment; return the options of its reset."""
        if isinstance(self._task, Episode):
            return self._kept
        if episode is None:
            last = self._last[index]
            following = index if last is None else last + self.num_envs
            episode = choose_index(self._chosen, seed, last=following - 1)
        self._last[index] = episode
        return {**self._kept, "episode": episode}

    def _ask(self, requests: Mapping[int, Request]) -> dict[int, Transition]:
        self._moment += 1
        return self._processes.ask(requests)

    def _observe(self, answers: Mapping[int, Transition]) -> StepResult:
        """Return what `step` does, given the answers of those who were asked."""
        count, mode = self.num_envs, self._mode
        rewards = np.zeros(count)
        terminated, truncated = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
        infos: list[dict[str, Any] | None] = [None] * count
        for index, answer in answers.items():
            self._texts[index] = answer.texts
            rewards[index] = answer.reward
            terminated[index], truncated[index] = answer.terminated, answer.truncated
            infos[index] = self._complete(index, answer)
            is_over = answer.terminated or answer.truncated
            self._over[index] = is_over and mode is not AutoresetMode.SAME_STEP
        return self._batch(), rewards, terminated, truncated, stack_infos(infos)

    def _complete(self, index: int, answer: Transition) -> dict[str, Any]:
        """Return an info with the video, and the end of the episode before if there was one."""
        info = dict(answer.info)
        if "demonstration" in info:
            self._starts[index] += 1
            read = partial(self._read_video, index=index, start=self._starts[index])
            fields, arrays = info["demonstration"]
            info["demonstration"] = FetchedDemonstration(fields, arrays, read)
        if answer.final is not None:
            info["final_obs"], info["final_info"] = _Opaque(answer.final[0]), answer.final[1]
        return info

    def _batch(self) -> Batch:
        """Return the observations."""
        batch: dict[str, Any] = {}
        for field in self.single_observation_space:
            if field not in self._arrays:
                batch[field] = tuple(texts.get(field) for texts in self._texts)
            elif not self._lazy or field not in self._pictures:
                batch[field] = self._arrays[field].copy()
        if not self._lazy:
            return batch
        fields = (*sorted(self._pictures), *batch)
        return FetchedFields(fields, batch, partial(self._draw, moment=self._moment))

    def _draw(self, fields: Sequence[str], *, moment: int) -> dict[str, NDArray[Any]]:
        """Draw fields of all observations of a moment, which must be now."""
        if moment != self._moment:
            raise InvalidValueError(
                f"{fields[0]!r} of an earlier observation was not drawn; read it before the "
                "next step."
            )
        self._processes.ask(dict.fromkeys(range(self.num_envs), ("draw", (fields,))))
        return {field: self._arrays[field].copy() for field in fields}

    def _read_video(
        self, fields: Sequence[str], *, index: int, start: int
    ) -> dict[str, NDArray[Any]]:
        """Return fields of the video that a sub-environment began its episode with."""
        if start != self._starts[index]:
            raise InvalidValueError(
                f"{fields[0]!r} of an earlier episode's video was not drawn; read it before "
                f"sub-environment {index} starts the next episode."
            )
        found = self._processes.ask({index: ("read_video", (fields,))})[index]
        return cast("dict[str, NDArray[Any]]", found)

    def _per_environment(self, name: str, value: Any) -> list[Any]:  # noqa: ANN401
        """Return a value for each sub-environment."""
        values = list(value) if isinstance(value, list | tuple | np.ndarray) else None
        if values is None:
            return [value] * self.num_envs
        if len(values) != self.num_envs:
            raise InvalidValueError(
                f"{name} has {len(values)} values for {self.num_envs} sub-environments."
            )
        return [None if one is None else int(one) for one in values]

    def _check_seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        if isinstance(seed, int | np.integer):
            return list(itertools.islice(itertools.count(int(seed)), self.num_envs))
        return self._per_environment("seed", seed)

    def _check_mask(self, mask: object) -> NDArray[np.bool_]:
        if mask is None:
            return np.ones(self.num_envs, dtype=np.bool_)
        found = np.asarray(mask)
        if found.shape != (self.num_envs,) or found.dtype != np.bool_ or not found.any():
            raise InvalidValueError(
                f"reset_mask is {mask!r}; it must be bool of shape ({self.num_envs},), not all "
                "False."
            )
        if not found.all() and not self._was_reset:
            raise gymnasium.error.ResetNeeded("The first reset must be of all sub-environments.")
        return found


class _Opaque(dict[str, Any]):
    """A dictionary that is an entry of an info as it is, not a map of arrays."""


def _find_mode(mode: str | AutoresetMode) -> AutoresetMode:
    names = {one.value: one for one in AutoresetMode}
    if isinstance(mode, AutoresetMode):
        return mode
    if mode not in names:
        raise UnknownNameError("autoreset mode", mode, names)
    return names[mode]


def stack_infos(infos: Sequence[Mapping[str, Any] | None]) -> dict[str, Any]:
    """Return an array (n,) for each key of n infos, and under ``_key`` who has it.

    Texts become arrays of Unicode, where None is empty; flags and numbers keep their type; maps
    become maps of arrays, and everything else arrays of objects.

    Args:
        infos: of the sub-environments, in their order; None for those without one.
    """
    stacked: dict[str, Any] = {}
    for key in dict.fromkeys(key for info in infos if info is not None for key in info):
        there = np.array([info is not None and key in info for info in infos])
        values = [info[key] if info is not None and key in info else None for info in infos]
        stacked[key] = _stack(values)
        stacked[f"_{key}"] = there
    return stacked


def _stack(values: Sequence[Any]) -> NDArray[Any] | dict[str, Any]:
    present = [value for value in values if value is not None]
    if present and all(type(value) is dict for value in present):
        return stack_infos(values)
    # Of our infos only texts may be None in all of them.
    for kind in (str, bool, int, float):
        if all(type(value) is kind for value in present):
            return np.array([kind() if value is None else value for value in values])
    stacked = np.empty(len(values), dtype=object)
    for index, value in enumerate(values):
        stacked[index] = value
    return stacked
