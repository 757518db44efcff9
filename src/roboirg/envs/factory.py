"""`make`, which creates an environment."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Unpack

from roboirg.core.extras import extra_needed

if TYPE_CHECKING:
    # Not at run time: these load NumPy and SAPIEN, which `import roboirg` must not.
    from roboirg.core.episode import Episode
    from roboirg.envs.env_settings import EnvOptions
    from roboirg.envs.environment import RoboIRGEnv


def make(task: str | Episode, **options: Unpack[EnvOptions]) -> RoboIRGEnv:
    """Create a Gymnasium environment; without further options it plays one episode.

    Args:
        task: name of the task, for example ``"PickXtimes"``, or a custom episode (`split` and
            `episode` are then ignored).
        **options: the keyword arguments below; `EnvSettings` has their defaults.

    Keyword Args:
        setting, form, …: the fields of `InstructionOptions`, which choose the words.
        actions, max_steps, …: the fields of `EnvironmentOptions`; what these leave to the policy is
            joint_angle for actions, and all frames of the demonstration.
        split: train, val, test or random.
        episode: index of the episode in the split, from 0; None if the seed of each reset
            chooses it.
        arm: ``told`` for the scene's own words, or a control arm: other words, or another goal,
            for the same scene (docs/controls.md).
        cameras: cameras whose pictures observations hold; () renders nothing.
        depth: add depth for the same cameras.
        calibration: add extrinsic and intrinsic matrices for the same cameras.
        grounded: add the pixel of the subgoal's object to info; costs rendering.
        history_cameras: cameras in the history; None for those of observations.
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
