"""`make`, which creates the environment of one episode, and its options."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypedDict, Unpack

from roboirg.core.errors import MissingDependencyError

if TYPE_CHECKING:
    # Not at run time: these load NumPy and SAPIEN, which `import roboirg` must not.
    from roboirg.core.episode import Episode
    from roboirg.core.observations import DemonstrationFrames
    from roboirg.envs.environment import RoboIRGEnv


class EnvOptions(TypedDict, total=False):
    """Keyword arguments of `make`; `RoboIRGEnv` has the same ones, with defaults."""

    setting: str
    """Explicit, direct, reasoning, contextual or spatial."""
    form: str
    """Implicit, or resolved for the paired explicit counterpart."""
    split: str
    """Train, val or test; ignored for an `Episode`."""
    episode: int
    """Index of the episode in the split, from 0; ignored for an `Episode`."""
    stages: Sequence[int]
    """Stages, of five, that a contextual instruction includes."""
    distractor: str
    """Neutral or competing, for contextual instructions."""
    distractors: int
    """Number of distractors in a contextual instruction."""
    frame: str
    """Whose left and right a spatial instruction uses: robot or camera."""
    actions: str
    """Action space: joint_angle, ee_pose or waypoint."""
    cameras: Sequence[str]
    """Cameras whose pictures observations hold; () renders nothing."""
    depth: bool
    """Add depth for the same cameras."""
    calibration: bool
    """Add extrinsic and intrinsic matrices for the same cameras."""
    grounded: bool
    """Add the pixel of the subgoal's object to info; costs rendering."""
    demonstration_frames: DemonstrationFrames
    """Pictures in the video: "all", "none", or n for every n-th."""
    observe_every: int | None
    """Add `history`, with an observation after every n-th control step."""
    history_cameras: Sequence[str] | None
    """Cameras in the history; None for those of observations."""
    meshes: str
    """Faithful, or light for faster pictures that differ slightly from RoboMME's."""
    max_steps: int
    """Number of control steps the policy has."""
    render_mode: str | None
    """None or rgb_array (front and wrist side by side)."""


def make(task: str | Episode, **options: Unpack[EnvOptions]) -> RoboIRGEnv:
    """Create the Gymnasium environment of one episode.

    Args:
        task: name of the task, for example ``"PickXtimes"``, or a custom episode.
        **options: see `EnvOptions`; the defaults are those of
            `roboirg.envs.environment.RoboIRGEnv`.

    Raises:
        MissingDependencyError: the simulator is not installed.
        UnknownNameError: a task, setting, split, form, action space or camera does not exist.
        InvalidValueError: the split has no such episode, or the combination is not defined.
    """
    try:
        from roboirg.envs.environment import RoboIRGEnv
    except ModuleNotFoundError as error:
        raise MissingDependencyError(
            f"Playing episodes needs the package {error.name!r}; "
            "run: pip install 'roboirgbench[sim]' (in a checkout: make setup)"
        ) from error
    return RoboIRGEnv(task, **options)
