"""RoboIRGBench: does a robot policy understand people who do not spell everything out?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from roboirg.core.errors import MissingDependencyError

if TYPE_CHECKING:
    from roboirg.core.episode import Episode
    from roboirg.envs.environment import RoboIRGEnv

__version__ = "0.1.0"
__all__ = ["__version__", "make"]


def make(task: str | Episode, **options: Any) -> RoboIRGEnv:  # noqa: ANN401 - RoboIRGEnv's own options
    """The Gymnasium environment of one episode.

    Args:
        task: name of the task, for example ``"PickXtimes"``, or an episode made by hand.
        **options: setting, form, split, episode and more, see
            `roboirg.envs.environment.RoboIRGEnv`.

    Raises:
        MissingDependencyError: the simulator is not installed.
        UnknownNameError: a task, setting, split, form or camera does not exist.
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
