"""Pictures of scenes with free labels: the segmentation says what is where."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.core.episode import Episode, SceneObject
from roboirg.core.observations import FRONT
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.physics_settings import HOME_ACTION

LATER_STEP = 40
"""Control step of a second look at scenes with a video: the containers have appeared by then."""
MIN_PIXELS = 12
"""Objects of which fewer pixels are visible are not labeled."""


class LabeledView(NamedTuple):
    """A picture with the centers of its objects.

    Attributes:
        picture: uint8 (256, 256, 3).
        names: of the objects' classes, such as ``cube red``.
        centers: (n, 2), column and row of the mean of the visible pixels.
        positions: (n, 2), x and y on the table, m.
    """

    picture: NDArray[np.uint8]
    names: tuple[str, ...]
    centers: NDArray[np.float32]
    positions: NDArray[np.float32]


def class_of(item: SceneObject) -> str:
    """Return the class of an object that a picture can show: its kind and color."""
    return " ".join(filter(None, (item.kind.removeprefix("hidden_"), item.color)))


def look(episode: Episode) -> tuple[LabeledView, ...]:
    """Return labeled pictures of an episode's start; of one with a video, also a later one."""
    session = EpisodeSession(episode, visible=True)
    # What comes later leaves the table with the first step, before anything is shown.
    session.world.step(HOME_ACTION)
    views = [_view(session, episode.scene.objects)]
    if episode.demonstration:
        while session.world.elapsed <= LATER_STEP:
            session.world.step(HOME_ACTION)
        views.append(_view(session, episode.scene.objects))
    return tuple(views)


def _view(session: EpisodeSession, objects: Sequence[SceneObject]) -> LabeledView:
    world = session.world
    segments = world.cameras.segmentation(FRONT)
    names, centers, positions = [], [], []
    for item in objects:
        rows, columns = np.nonzero(segments == world.bodies[item.name].segment)
        if len(rows) >= MIN_PIXELS:
            names.append(class_of(item))
            centers.append((columns.mean(), rows.mean()))
            positions.append(world.bodies[item.name].position[:2])
    return LabeledView(
        world.picture(FRONT), tuple(names), _points_of(centers), _points_of(positions)
    )


def _points_of(points: Sequence[Sequence[float]]) -> NDArray[np.float32]:
    return np.array(points, dtype=np.float32).reshape(-1, 2)
