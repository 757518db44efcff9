"""Processes that play the sub-environments of a vector environment."""

from __future__ import annotations

import traceback
from collections.abc import Mapping, Sequence
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext
from typing import Any, NamedTuple, cast

from gymnasium import spaces
from gymnasium.vector.utils import create_shared_memory, read_from_shared_memory
from numpy.typing import NDArray

from roboirg.core.episode import Episode
from roboirg.core.errors import RoboIRGError
from roboirg.envs.env_options import EnvOptions
from roboirg.envs.environment import RoboIRGEnv
from roboirg.util.child_process import ChildExit, ChildProcess, serve


class SubEnvironmentError(RoboIRGError):
    """A sub-environment raised, or the process that plays it was lost."""


class SharedArrays(NamedTuple):
    """One array (n, ...) for each `Box` of an observation, in memory that processes share.

    Can be sent to a child process when it is started.
    """

    boxes: spaces.Dict
    memory: Any
    rows: int

    @classmethod
    def of(cls, space: spaces.Dict, count: int, context: BaseContext) -> SharedArrays:
        """Return those of `count` observations."""
        boxes = spaces.Dict(
            [(name, one) for name, one in space.items() if isinstance(one, spaces.Box)]
        )
        return cls(boxes, create_shared_memory(boxes, count, cast("Any", context)), count)

    def open(self) -> dict[str, NDArray[Any]]:
        """Return the arrays as views of the shared memory."""
        views = read_from_shared_memory(self.boxes, self.memory, self.rows)
        return cast("dict[str, NDArray[Any]]", views)


class Recipe(NamedTuple):
    """How a worker makes its environments.

    Attributes:
        task: task, or an episode.
        options: of each environment.
        arrays: where observations are written.
        pictures: the fields of an observation that are drawn.
        eager: whether they are drawn at every observation.
    """

    task: str | Episode
    options: EnvOptions
    arrays: SharedArrays
    pictures: frozenset[str]
    eager: bool


class Transition(NamedTuple):
    """What a reset or a step of a sub-environment returns; its arrays are in shared memory.

    Attributes:
        texts: the fields of the observation that are not arrays.
        info: its info; that of a reset has the names of the video's fields, and those fields that
            need no drawing.
        reward: of a step.
        terminated: of a step.
        truncated: of a step.
        final: the last observation and info of the episode that a step ended, if another one was
            started in the same step.
    """

    texts: dict[str, Any]
    info: dict[str, Any]
    reward: float = 0.0
    terminated: bool = False
    truncated: bool = False
    final: tuple[dict[str, Any], dict[str, Any]] | None = None


class SubEnvironment:
    """One environment in a worker, with its row of the shared arrays.

    Its methods are what the vector environment may ask for.

    Args:
        recipe: how to make it.
        arrays: the shared arrays, opened.
        index: its row.
    """

    def __init__(self, recipe: Recipe, arrays: Mapping[str, NDArray[Any]], index: int) -> None:
        self._env = RoboIRGEnv(recipe.task, **recipe.options)
        self._env.draws = False
        self._arrays, self._index = arrays, index
        self._drawn = tuple(sorted(recipe.pictures))
        self._eager = recipe.eager
        self._video: Mapping[str, NDArray[Any]] = {}

    def reset(self, options: dict[str, Any]) -> Transition:
        """Start an episode."""
        observation, info = self._env.reset(options=options)
        self._video = video = info["demonstration"]
        fields = tuple(video)
        arrays = {field: video[field] for field in fields if field not in self._drawn}
        info["demonstration"] = fields, arrays
        return Transition(self._share(observation), info)

    def step(self, chunk: NDArray[Any], then: dict[str, Any] | None) -> Transition:
        """Execute a chunk; if that ends the episode, start the one with the options `then`."""
        observation, reward, terminated, truncated, info = self._env.step_chunk(chunk)
        if then is None or not (terminated or truncated):
            return Transition(self._share(observation), info, reward, terminated, truncated)
        last = {**observation, **(self._env.read_pictures(self._drawn) if self._eager else {})}
        first = self.reset(then)
        return Transition(*first[:2], reward, terminated, truncated, (last, info))

    def draw(self, fields: Sequence[str]) -> None:
        """Draw pictures into shared memory."""
        for field, picture in self._env.read_pictures(fields).items():
            self._arrays[field][self._index] = picture

    def read_video(self, fields: Sequence[str]) -> dict[str, NDArray[Any]]:
        """Return fields of the demonstration of the current episode."""
        return {field: self._video[field] for field in fields}

    def call(self, name: str, args: Sequence[Any], options: Mapping[str, Any]) -> Any:  # noqa: ANN401
        """Call a method of the environment, or return an attribute."""
        found = getattr(self._env, name)
        return found(*args, **options) if callable(found) else found

    def _share(self, observation: dict[str, Any]) -> dict[str, Any]:
        """Write the arrays of an observation to shared memory; return its other fields."""
        if self._eager:
            self.draw(self._drawn)
        for field, value in observation.items():
            if field in self._arrays:
                self._arrays[field][self._index] = value
        return {key: value for key, value in observation.items() if key not in self._arrays}


Request = tuple[str, tuple[Any, ...]]
"""Name of a method of `SubEnvironment`, and its arguments."""


class WorkerProcesses:
    """Starts workers, shares sub-environments among them, and asks them all at once.

    Args:
        recipe: how the environments are made.
        count: number of sub-environments.
        workers: number of processes.
    """

    def __init__(self, recipe: Recipe, count: int, workers: int) -> None:
        self._places = [(index % workers) for index in range(count)]
        self._children = [
            # A program may end without closing its environment.
            ChildProcess.spawn(_work, recipe, range(worker, count, workers), daemon=True)
            for worker in range(workers)
        ]

    def ask(self, requests: Mapping[int, Request]) -> dict[int, Any]:
        """Return the answer of each sub-environment that is asked; all work at the same time.

        Raises:
            SubEnvironmentError: one raised, or its process was lost.
        """
        batches: dict[int, dict[int, Request]] = {}
        for index, request in requests.items():
            batches.setdefault(self._places[index], {})[index] = request
        for worker, batch in batches.items():
            self._children[worker].send(batch)
        answers: dict[int, Any] = {}
        failures: dict[int, str] = {}
        for worker in batches:
            reply = self._children[worker].receive()
            if isinstance(reply, ChildExit):
                rows = [str(index) for index, place in enumerate(self._places) if place == worker]
                raise SubEnvironmentError(
                    f"The worker of sub-environments {', '.join(rows)} was lost: {reply}."
                )
            answers |= reply[0]
            failures |= reply[1]
        for index, failure in sorted(failures.items()):
            raise SubEnvironmentError(f"Sub-environment {index} raised: {failure}")
        return answers

    def close(self) -> None:
        """End the workers."""
        for child in self._children:
            child.connection.close()  # all at the same time
        for child in self._children:
            child.close()


def _work(connection: Connection, recipe: Recipe, rows: Sequence[int]) -> None:
    """Answer requests until the connection is closed."""
    arrays = recipe.arrays.open()
    environments = {row: SubEnvironment(recipe, arrays, row) for row in rows}

    def answer(batch: Mapping[int, Request]) -> tuple[dict[int, Any], dict[int, str]]:
        done: dict[int, Any] = {}
        failed: dict[int, str] = {}
        for index, (name, args) in batch.items():
            try:
                done[index] = getattr(environments[index], name)(*args)
            except Exception as error:  # noqa: BLE001 - reported to the parent
                failed[index] = _describe(error)
        return done, failed

    serve(connection, answer)


def _describe(error: Exception) -> str:
    """Return an error in words; with a traceback if it is not one of ours."""
    if isinstance(error, RoboIRGError):
        return f"{type(error).__name__}: {error}"
    return "".join(traceback.format_exception(error))
