"""`make`, which creates the environment of one episode, and its options."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict, Unpack

from roboirg.core.errors import MissingDependencyError

if TYPE_CHECKING:
    # Not at run time: these load NumPy and SAPIEN, which `import roboirg` must not.
    from roboirg.core.episode import Episode
    from roboirg.core.observations import DemonstrationFrames
    from roboirg.envs.environment import RoboIRGEnv


class EnvOptions(TypedDict, total=False):
    """Keyword arguments of `make`, which documents them; `RoboIRGEnv` has their defaults."""

    setting: str
    form: str
    split: str
    episode: int
    stages: Sequence[int]
    distractor: str
    distractors: int
    frame: str
    wordings: str | Path | None
    delivery: str
    rival: str
    reasoning: str
    actions: str
    cameras: Sequence[str]
    depth: bool
    calibration: bool
    grounded: bool
    demonstration_frames: DemonstrationFrames
    observe_every: int | None
    history_cameras: Sequence[str] | None
    meshes: str
    max_steps: int
    render_mode: str | None


def make(task: str | Episode, **options: Unpack[EnvOptions]) -> RoboIRGEnv:
    """Create the Gymnasium environment of one episode.

    Args:
        task: name of the task, for example ``"PickXtimes"``, or a custom episode (`split` and
            `episode` are then ignored).
        **options: the keyword arguments below; `RoboIRGEnv` has their defaults.

    Keyword Args:
        setting: explicit, direct, reasoning, contextual or spatial.
        form: implicit, or resolved for the paired explicit counterpart.
        split: train, val, test or random.
        episode: index of the episode in the split, from 0.
        stages: stages, of five, that a contextual instruction includes.
        distractor: neutral or competing, for contextual instructions.
        distractors: number of distractors in a contextual instruction.
        frame: whose left and right a spatial instruction uses: robot or camera.
        wordings: wording file whose commands are used, or its identity; None for our own words.
        delivery: prompt, all utterances at once, or turns: one after another while it acts.
        rival: drawn adds a second value of the same kind to direct, contextual and spatial
            instructions; none adds nothing.
        reasoning: plain, or open for reasoning instructions whose goal follows from no single word.
        actions: joint_angle, ee_pose or waypoint.
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
    check_simulator()
    from roboirg.envs.environment import RoboIRGEnv

    return RoboIRGEnv(task, **options)


def check_simulator() -> None:
    """Check that what playing episodes needs is installed.

    Raises:
        MissingDependencyError: it is not.
    """
    try:
        importlib.import_module("roboirg.envs.environment")
    except ModuleNotFoundError as error:
        raise MissingDependencyError(
            f"Playing episodes needs the package {error.name!r}; "
            "run: pip install 'roboirgbench[sim]' (in a checkout: make setup)"
        ) from error
