"""Other forms of pictures, and of whole observations, that a policy may wrongly expect."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.policy_check.policy_player import PolicyPlayer
from roboirg.core.observations import Observation

ChangeArray = Callable[[NDArray[Any]], NDArray[Any]]
"""Changes arrays of which the last three axes are a picture."""

_RGB = "_rgb"


def to_floats(pictures: NDArray[Any]) -> NDArray[Any]:
    """Return pictures as float32 from 0 to 1."""
    return (pictures / np.float32(255)).astype(np.float32)


def to_channels_first(pictures: NDArray[Any]) -> NDArray[Any]:
    """Return pictures with the channels before height and width."""
    return np.moveaxis(pictures, -1, -3)


FORMATS: Mapping[str, ChangeArray] = {
    "floats from 0 to 1": to_floats,
    "bytes with channels first": to_channels_first,
    "floats from 0 to 1 with channels first": lambda one: to_channels_first(to_floats(one)),
}
"""What a policy may take instead of bytes (256, 256, 3), in words."""


def change_pictures(values: Mapping[str, Any], change: ChangeArray) -> dict[str, Any]:
    """Return the values of an observation or demonstration with other pictures."""
    return {
        field: change(value) if field.endswith(_RGB) else value for field, value in values.items()
    }


def change_observation(
    observation: Observation, change: Callable[[dict[str, Any]], dict[str, Any]]
) -> Observation:
    """Return an observation and its history with a change of their fields."""
    changed = change(dict(observation))
    if "history" in changed:
        changed["history"] = tuple(change(dict(one)) for one in changed["history"])
    return cast("Observation", changed)


def find_working_format(player: PolicyPlayer) -> str | None:
    """Return the form of pictures with which a policy acts that raises an error; None if none."""
    episode = player.without_video
    if not player.is_local or not any(field.endswith(_RGB) for field in episode.first):
        return None
    for name, change in FORMATS.items():
        shown = change_observation(episode.first, lambda one, c=change: change_pictures(one, c))  # type: ignore[misc]
        video = change_pictures(episode.demonstration, change)
        try:
            player.ask(episode.instruction, video, [shown])
        except Exception:  # noqa: BLE001, S112 - the policy's own code runs here
            continue
        return name
    return None
