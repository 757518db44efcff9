"""The errors a user can see: one sentence each, with the name, its value and a valid value.

| error | raised when | on the command line |
| --- | --- | --- |
| `UnknownNameError` | a name does not exist | exit code 2 |
| `InvalidValueError` | a number or combination is out of range | exit code 2 |
| `InvalidActionError` | an action has a wrong shape or is not finite | exit code 2; or recorded |
| `MissingDependencyError` | an extra or a model file is not installed | exit code 2 |
| `RenderDeviceError` | no Vulkan device can render | exit code 2 |
| `BudgetError` | a run has spent what it may on models | exit code 2 |
| `SceneRejectedError` | a seed yields no valid scene (callers try the next seed) | never seen |
| `PolicyConnectionError` | a policy's server or model cannot be reached | recorded as an error |
| `PolicyTimeoutError` | a policy does not answer in time | recorded as an error |
| `PolicyReplyError` | a policy's server or model sends an invalid answer | recorded as an error |
| `UnknownCostError` | a model's reply cannot be read, and may be paid | recorded as an error |
| `MotionPlanningError` | the oracle finds no path | recorded as an error |
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TypeVar

from roboirg.core.plain_text import clip_text, printable

Name = TypeVar("Name", bound=str)
_MOST_SHOWN = 200
"""Characters of an unknown name, which may be any text."""


class RoboIRGError(Exception):
    """Base class of errors that are reported as one sentence, without a traceback."""


class InvalidValueError(RoboIRGError, ValueError):
    """A value is out of range; the sentence names the valid ones."""


class UnknownNameError(InvalidValueError):
    """A name that is not in its registry.

    Args:
        kind: of the name, for example ``"task"``.
        name: the unknown name.
        known: every valid name.
    """

    def __init__(self, kind: str, name: object, known: Iterable[str]) -> None:
        """Make the message: all known names, and the nearest one as a suggestion, if any is near.

        ``There is no task 'PickXtime'; known: PickXtimes, …. Did you mean 'PickXtimes'?``
        """
        names = list(known)
        import difflib  # here, because only a mistake needs it

        # Compared in lower case, suggested as it is spelled.
        lower_names = [known_name.lower() for known_name in names]
        close = difflib.get_close_matches(str(name).lower(), lower_names, n=1)
        hint = ""
        if close:
            nearest = names[lower_names.index(close[0])]
            hint = f" Did you mean {nearest!r}?"
        shown = clip_text(repr(name), _MOST_SHOWN)
        super().__init__(f"There is no {kind} {shown}; known: {', '.join(names)}.{hint}")


def check_names(kind: str, names: Iterable[object], known: Iterable[str]) -> None:
    """Raise if one of the names is unknown; return nothing otherwise.

    Args:
        kind: what they name, for the message: ``"camera"``.
        names: those to check.
        known: every valid name.

    Raises:
        UnknownNameError: the first unknown one; the message suggests the nearest.
    """
    every = list(known)
    for name in names:
        if name not in every:
            raise UnknownNameError(kind, name, every)


def known_name(kind: str, name: str, known: Sequence[Name]) -> Name:
    """Return a name if it is known, typed as one of `known`.

    Raises:
        UnknownNameError: it is not; `kind` says in the message what it should name.
    """
    check_names(kind, [name], known)
    return known[known.index(name)]


class InvalidActionError(RoboIRGError, ValueError):
    """An action has a wrong shape or type, or is not finite."""


class EndOfRunError(RoboIRGError):
    """Base class of errors that would end every other episode the same way, so the run stops."""


class MissingDependencyError(EndOfRunError, ImportError):
    """A required package or file is not installed; the sentence says how to install it."""


class RenderDeviceError(EndOfRunError, RuntimeError):
    """No Vulkan device can render; the sentence says what to install."""


class BudgetError(EndOfRunError):
    """A run has spent what it may on models, or their prices are not known."""


class SceneRejectedError(RoboIRGError):
    """The sampler found no place for an object; callers try the next seed."""


class MotionPlanningError(RoboIRGError, RuntimeError):
    """No collision-free straight motion within the joint limits was found."""


class PolicyServerError(RoboIRGError):
    """The server or model of a policy failed; what it said itself is safe to print."""

    def __init__(self, message: str = "") -> None:
        super().__init__(printable(message))


class PolicyConnectionError(PolicyServerError, ConnectionError):
    """The server or model of a policy cannot be reached, or the connection was lost."""


class ModelBusyError(PolicyConnectionError):
    """A model's service is up but cannot answer now.

    Args:
        message: what it said.
        retry_after_s: seconds after which it wants to be asked again; None if it named none.
    """

    def __init__(self, message: str = "", retry_after_s: float | None = None) -> None:
        super().__init__(message)
        self.retry_after_s = retry_after_s


class PolicyTimeoutError(PolicyServerError, TimeoutError):
    """The server or model of a policy did not answer in time."""


class PolicyReplyError(PolicyServerError, RuntimeError):
    """The server or model of a policy answered with an error or an invalid reply."""


class UnknownCostError(PolicyReplyError):
    """A model's service answered in another form, so what the reply cost is unknown."""
