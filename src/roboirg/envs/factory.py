"""`make`, which creates an environment."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Unpack

from roboirg.core.extras import extra_needed
from roboirg.envs.env_options import EnvOptions

if TYPE_CHECKING:
    # Not at run time: these load NumPy and SAPIEN, which `import roboirg` must not.
    from roboirg.core.episode import Episode
    from roboirg.envs.environment import RoboIRGEnv


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


def check_simulator() -> None:
    """Check that what playing episodes needs is installed."""
    with extra_needed("Playing episodes needs the simulator", "sim"):
        importlib.import_module("roboirg.envs.environment")
