"""Batches of sub-environments for LeRobot, without importing it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv, VectorEnv

from roboirg.integrations.lerobot.sub_environment import LeRobotSubEnvironment

MakeSubEnvironment = Callable[[], LeRobotSubEnvironment]


def make_batch(
    task: str, n_envs: int, use_async_envs: bool, options: Mapping[str, Any]
) -> VectorEnv[Any, Any, Any]:
    """Return a vector environment of one task, in processes of their own if `use_async_envs`.

    Args:
        task: name of the task.
        n_envs: number of sub-environments.
        use_async_envs: whether each has a process.
        options: keyword arguments of `LeRobotSubEnvironment`.
    """
    makers = sub_environments(task, n_envs, options)
    if use_async_envs and n_envs > 1:
        # Spawned, because the threads of the renderer do not survive a fork.
        return AsyncVectorEnv(makers, context="spawn", autoreset_mode=AutoresetMode.NEXT_STEP)
    return SyncVectorEnv(makers, autoreset_mode=AutoresetMode.NEXT_STEP)


def sub_environments(
    task: str, n_envs: int, options: Mapping[str, Any]
) -> list[MakeSubEnvironment]:
    """Return functions that make the sub-environments."""
    return [partial(LeRobotSubEnvironment, task, **options)] * n_envs
