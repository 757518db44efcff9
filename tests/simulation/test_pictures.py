"""Pictures: repeats are identical, and they look as they did when they were looked at."""

from pathlib import Path

import cv2
import numpy as np
import pytest

import roboirg
from roboirg.core.observations import CAMERAS
from roboirg.policies import make_policy, play
from roboirg.simulation.physics_settings import HOME_ACTION
from roboirg.simulation.world import World
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim

PICTURES = Path(__file__).parent / "pictures"

# Another version of the driver may move a pixel at an edge or change it by a level.
FAR_OFF_LEVELS = 24
FAR_OFF_SHARE = 0.01

END = -1
MOMENTS = {
    ("PickXtimes", 2): {1: "start", 95: "middle", END: "end"},
    ("StopCube", 3): {END: "stopped"},
    ("SwingXtimes", 3): {END: "glowing"},
    ("BinFill", 3): {160: "filling"},
    ("VideoUnmaskSwap", 3): {90: "swapping"},
    ("VideoUnmask", 3): {20: "start", 160: "middle", END: "end"},
    ("ButtonUnmaskSwap", 3): {140: "swapping"},
    ("ButtonUnmask", 3): {END: "lifted"},
    ("VideoRepick", 2): {236: "swapping"},
    ("VideoPlaceButton", 3): {END: "placed"},
    ("VideoPlaceOrder", 3): {END: "placed"},
    ("PutInBox", 0): {1: "start", END: "inside"},
    ("PickByCount", 1): {1: "start", END: "done"},
}
"""Elapsed steps of the oracle's run; the last is the step of success, whichever it is."""
BOTH_CAMERAS = {"PickXtimes", "VideoUnmask", "PutInBox", "PickByCount"}
"""For the other tasks only the front picture is stored; the wrist's shows no other objects."""


def film(task: str, index: int, steps: set[int]) -> dict[tuple[int, str], np.ndarray]:
    """Pictures of the oracle's run after the given steps."""
    env = roboirg.make(task, episode=index, cameras=())
    taken: dict[tuple[int, str], np.ndarray] = {}

    def shoot(env, _demonstration):
        elapsed = env.session.world.elapsed if env.status == "ongoing" else END
        if elapsed in steps:
            taken.update({(elapsed, camera): env.picture(camera) for camera in CAMERAS})

    env.set_frame_hook(shoot)
    info = play(env, make_policy("oracle", 0))
    assert info["status"] == "success"
    return taken


@pytest.mark.parametrize(("task", "index"), MOMENTS)
def test_pictures_look_as_they_did_when_they_were_looked_at(task, index):
    moments = MOMENTS[task, index]
    cameras = CAMERAS if task in BOTH_CAMERAS else ("front",)
    taken = {
        key: picture
        for key, picture in film(task, index, set(moments)).items()
        if key[1] in cameras
    }
    assert len(taken) == len(moments) * len(cameras)
    for (elapsed, camera), picture in taken.items():
        file = PICTURES / f"{task}_{moments[elapsed]}_{camera}.png"
        known = cv2.cvtColor(cv2.imread(str(file)), cv2.COLOR_BGR2RGB).astype(int)
        off = np.abs(picture.astype(int) - known).max(axis=2) > FAR_OFF_LEVELS
        assert off.mean() < FAR_OFF_SHARE, f"{file.name} differs"


def test_pictures_do_not_depend_on_other_worlds_in_the_process():
    episode = get_episode("PickXtimes", "test", 3)
    first = World(episode.scene)
    first.step(HOME_ACTION)
    alone = [first.picture(camera) for camera in CAMERAS]
    other_episode = get_episode("VideoUnmask", "test", 0)
    other = World(other_episode.scene)
    other.step(HOME_ACTION)
    other.picture("front")
    again = World(episode.scene)
    again.step(HOME_ACTION)
    for camera, picture in zip(CAMERAS, alone, strict=True):
        assert np.array_equal(first.picture(camera), picture)
        assert np.array_equal(again.picture(camera), picture)


def test_a_picture_is_drawn_again_when_something_moves():
    world = World(get_episode("PickXtimes", "test", 0).scene)
    world.step(HOME_ACTION)
    before = world.picture("front")
    before[:] = 0  # callers may do with a picture what they like
    still = world.picture("front")
    assert still.any()
    cube = next(body for body in world.bodies.values() if body.item.kind == "cube")
    cube.put(cube.item.position._replace(x=0.1))
    assert not np.array_equal(world.picture("front"), still)
