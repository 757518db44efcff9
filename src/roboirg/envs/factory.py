"""`make` and `make_vec`, which create environments, and their options."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Unpack

from roboirg.core.extras import extra_needed
from roboirg.envs.env_options import EnvOptions

if TYPE_CHECKING:
    # Not at run time: these load NumPy and SAPIEN, which `import roboirg` must not.
    from gymnasium.vector import AutoresetMode

    from roboirg.core.episode import Episode
    from roboirg.envs.environment import RoboIRGEnv
    from roboirg.envs.vector.vector_environment import RoboIRGVectorEnv


def make(task: str | Episode, **options: Unpack[EnvOptions]) -> RoboIRGEnv:
    """Create a Gymnasium environment; without further options it plays one episode.

    Args:
        task: name of the task, for example ``"PickXtimes"``, or a custom episode (`split` and
            `episode` are then ignored).
        **options: the keyword arguments below; `EnvSettings` has their defaults.

    Keyword Args:
        setting, form, …: the fields of `InstructionOptions`, which choose the words.
        split: train, val, test or random.
        episode: index of the episode in the split, from 0; None if the seed of each reset
            chooses it.
        arm: told, or a control arm: other words, or another goal, for the same scene
            (docs/controls.md).
        actions: joint_angle, ee_pose, waypoint or choice.
        cameras: cameras whose pictures observations hold; () renders nothing.
        depth: add depth for the same cameras.
        calibration: add extrinsic and intrinsic matrices for the same cameras.
        grounded: add the pixel of the subgoal's object to info; costs rendering.
        demonstration_frames: pictures in the video: "all", "none", or n for every n-th.
        observe_every: n adds `history` to each observation: the observations after every n-th
            control step since the last one.
        history_cameras: cameras in the history; None for those of observations.
        meshes: "faithful", or "light" for faster pictures that differ slightly from RoboMME's.
        max_steps: number of control steps the policy has.
        render_mode: None or "rgb_array" (front and wrist side by side).

    Raises:
        MissingDependencyError: the simulator is not installed.
        UnknownNameError: a task, setting, split, form, action space or camera does not exist.
        InvalidValueError: the split has no such episode, or the combination is not defined; or
            the wording file cannot be read or lacks a command for the episode.
    """
    with extra_needed("Playing episodes needs the simulator", "sim"):
        from roboirg.envs.environment import RoboIRGEnv
    return RoboIRGEnv(task, **options)


def make_vec(
    task: str | Episode,
    num_envs: int = 1,
    *,
    autoreset_mode: str | AutoresetMode = "NextStep",
    workers: int | None = None,
    lazy: bool = False,
    **options: Unpack[EnvOptions],
) -> RoboIRGVectorEnv:
    """Create a Gymnasium vector environment whose sub-environments run in worker processes.

    Args:
        task: as in `make`.
        num_envs: number of sub-environments.
        autoreset_mode: ``NextStep``, ``SameStep`` or ``Disabled``, as Gymnasium defines them.
        workers: number of worker processes; None for one per core, at most `num_envs`.
        lazy: whether pictures are drawn only when they are read from an observation; they must
            then be read before the next step.
        **options: as in `make`, but `episode` is None by default: seeds choose episodes.

    Raises:
        MissingDependencyError: the simulator is not installed.
        UnknownNameError: a task, an option's value or the autoreset mode does not exist.
        InvalidValueError: a number is out of range, or the combination is not defined.
    """
    with extra_needed("Playing episodes needs the simulator", "sim"):
        from roboirg.envs.vector.vector_environment import RoboIRGVectorEnv
    return RoboIRGVectorEnv(
        task, num_envs, autoreset_mode=autoreset_mode, workers=workers, lazy=lazy, **options
    )


def check_simulator() -> None:
    """Check that what playing episodes needs is installed."""
    with extra_needed("Playing episodes needs the simulator", "sim"):
        importlib.import_module("roboirg.envs.environment")
