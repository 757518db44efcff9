"""The errors a user can meet: one sentence each, naming the thing, its value and what is right.

| error | raised when | on the command line |
| --- | --- | --- |
| `UnknownNameError` | a name does not exist | exit code 2 |
| `InvalidValueError` | a number or combination is out of range | exit code 2 |
| `InvalidActionError` | an action has a wrong shape or is not finite | exit code 2; or recorded |
| `MissingDependencyError` | an extra or a model file is not installed | exit code 2 |
| `RenderDeviceError` | no Vulkan device can render | exit code 2 |
| `SceneRejectedError` | a seed yields no valid scene (callers try the next seed) | never seen |
| `PolicyConnectionError` | a policy's server or model cannot be reached | recorded as an error |
| `PolicyTimeoutError` | a policy does not answer in time | recorded as an error |
| `PolicyReplyError` | a policy's server or model answers something else | recorded as an error |
| `MotionPlanningError` | the oracle's hands find no path | recorded as an error |
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class RoboIRGError(Exception):
    """Base class: everything that is reported as one sentence, without a traceback."""


class InvalidValueError(RoboIRGError, ValueError):
    """A value is outside what is allowed; the sentence says what would be right."""


class UnknownNameError(InvalidValueError):
    """A name that is not in its registry.

    Args:
        kind: what was looked up, for example ``"task"``.
        name: what the caller asked for.
        known: every valid name.
    """

    def __init__(self, kind: str, name: object, known: Iterable[str]) -> None:
        names = list(known)
        close = difflib.get_close_matches(
            str(name).lower(), [known_name.lower() for known_name in names], n=1
        )
        nearest = [known_name for known_name in names if known_name.lower() in close]
        hint = f" Did you mean {nearest[0]!r}?" if nearest else ""
        super().__init__(f"There is no {kind} {name!r}; known: {', '.join(names)}.{hint}")


class InvalidActionError(RoboIRGError, ValueError):
    """An action that the robot cannot execute: wrong shape, wrong type, or not finite."""


class MissingDependencyError(RoboIRGError, ImportError):
    """Something that has to be installed is not; the sentence says how."""


class RenderDeviceError(RoboIRGError, RuntimeError):
    """No Vulkan device can render; the sentence says what to install."""


class SceneRejectedError(RoboIRGError):
    """The sampler found no place for an object; the next seed is to be tried."""


class MotionPlanningError(RoboIRGError, RuntimeError):
    """No collision-free straight motion within the joint limits was found."""


class PolicyConnectionError(RoboIRGError, ConnectionError):
    """The server or model behind a policy cannot be reached, or went away."""


class PolicyTimeoutError(RoboIRGError, TimeoutError):
    """The server or model behind a policy did not answer within the time it has."""


class PolicyReplyError(RoboIRGError, RuntimeError):
    """The server or model behind a policy answered with an error or with something else."""
