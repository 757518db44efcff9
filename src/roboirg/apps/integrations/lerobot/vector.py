"""Batches of sub-environments for LeRobot, without importing it.

They are Gymnasium's vector environments: LeRobot reads their `envs`, and calls what
sub-environments have under its own names.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv, VectorEnv

from roboirg.apps.integrations.lerobot.sub_environment import LeRobotSubEnvironment

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
    # LeRobot 0.4 reads successes from ``final_info`` alone, which no other mode has.
    mode = AutoresetMode.SAME_STEP
    if not use_async_envs or n_envs == 1:
        return SyncVectorEnv(makers, autoreset_mode=mode)
    # Spawned, because the threads of the renderer do not survive a fork.
    vector = AsyncVectorEnv(makers, context="spawn", autoreset_mode=mode)
    # LeRobot 0.4 looks at the first one for what it may ask all of them.
    vector.envs = (makers[0](),) * n_envs  # type: ignore[attr-defined]
    return vector


def sub_environments(
    task: str, n_envs: int, options: Mapping[str, Any]
) -> list[MakeSubEnvironment]:
    """Return a function for each sub-environment, which makes it where it is called."""
    return [partial(LeRobotSubEnvironment, task, **options)] * n_envs
