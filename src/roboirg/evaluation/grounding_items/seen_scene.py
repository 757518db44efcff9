"""What is shown and seen of an episode: its video, the first picture, and masks of objects."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from roboirg.core.episode import Episode
from roboirg.core.errors import RoboIRGError
from roboirg.core.observations import FRONT
from roboirg.envs.environment import RoboIRGEnv
from roboirg.evaluation.grounding_items.grounding_item import Mask, PointTarget, encode_mask
from roboirg.evaluation.grounding_items.referents import find_referents
from roboirg.util.media import Pixels

FIRST = "first"
"""Name of the picture at the start of the policy's turn."""


class SeenScene(NamedTuple):
    """The pictures of an episode, by the front camera.

    Attributes:
        picture: at the start of the policy's turn, uint8 (256, 256, 3).
        frames: every n-th frame of the video, uint8 (T, 256, 256, 3); T = 0 without one.
        steps: control steps of the video.
        points: where the things that are meant are seen.
        meters: distance of the first of them from the camera.
    """

    picture: Pixels
    frames: Pixels
    steps: int
    points: tuple[PointTarget, ...]
    meters: float


def look_at_episode(episode: Episode, every: int) -> SeenScene:
    """Play the video of an episode, if it has one, and take its pictures.

    Args:
        episode: the episode.
        every: control steps between two frames of the video.

    Raises:
        RoboIRGError: a thing that is meant cannot be seen, or the video cannot be played.
    """
    env = RoboIRGEnv(episode, cameras=(FRONT,), depth=True, demonstration_frames=every)
    try:
        observation, info = env.reset()
        segments = env.session.world.cameras.segmentation(FRONT)
        bodies = env.session.world.bodies
        numbers = {name: body.segment for name, body in bodies.items()}
    finally:
        env.close()
    video = info["demonstration"]
    found = []
    for referent in find_referents(episode):
        mask = np.isin(segments, [numbers[name] for name in referent.objects])
        if not mask.any():
            raise RoboIRGError(
                f"{episode.key}: {' and '.join(referent.objects)} cannot be seen in the first "
                "picture."
            )
        found.append(_target(referent.kind, mask))
    first = found[0]
    return SeenScene(
        picture=observation["front_rgb"],
        frames=video["front_rgb"] if video.length else np.empty((0, 0, 0, 3), np.uint8),
        steps=video.length,
        points=tuple(found),
        meters=round(float(observation["front_depth"][first.y, first.x, 0]) / 1000, 3),
    )


def _target(kind: str, mask: Mask) -> PointTarget:
    y, x = nearest_to_center(mask)
    height, width = mask.shape
    return PointTarget(
        kind=kind,
        picture=FIRST,
        x=x,
        y=y,
        size=(height, width),
        counts=encode_mask(mask),
    )


def nearest_to_center(mask: Mask) -> tuple[int, int]:
    """Return row and column of the pixel of a mask that is nearest to the mean of all of them."""
    places = np.argwhere(mask)
    distances = np.square(places - places.mean(axis=0)).sum(axis=1)
    row, column = places[int(distances.argmin())]
    return int(row), int(column)
