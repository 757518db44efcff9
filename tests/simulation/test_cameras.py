"""Pictures are of their moment; depth, segmentation and calibration fit the scene."""

import numpy as np
import pytest

from roboirg.core.observations import CAMERAS, PICTURE_SIZE
from roboirg.simulation.physics_settings import HOME_ACTION
from roboirg.simulation.world import World
from roboirg.tasks.splits.splits import get_episode

MIDDLE = PICTURE_SIZE // 2

pytestmark = pytest.mark.sim


@pytest.fixture(scope="module")
def world():
    world = World(get_episode("PickXtimes", "test", 2).scene)
    world.step(HOME_ACTION)
    return world


@pytest.fixture(scope="module")
def cameras(world):
    return world.cameras


def test_the_cameras_have_robomme_s_positions_and_focal_length(cameras):
    """The matrix takes the world to the front camera: columns x, y, z and the offset in meters."""
    expected = [[0, 1, 0, 0], [0.89443, 0, -0.44721, -0.08944], [-0.44721, 0, -0.89443, 0.49194]]
    assert cameras.extrinsic("front") == pytest.approx(np.array(expected), abs=1e-5)
    for camera in CAMERAS:
        matrix = [[MIDDLE, 0, MIDDLE], [0, MIDDLE, MIDDLE], [0, 0, 1]]
        assert cameras.intrinsic(camera) == pytest.approx(np.array(matrix), abs=1e-4)


def test_depth_of_the_bare_table_agrees_with_geometry(cameras):
    # A pixel's ray meets z = 0 at a depth of height / slope. Camera axes in the world: down is
    # (0.894, 0, -0.447), forward (-0.447, 0, -0.894), and the eye is 0.4 above the table.
    depth = cameras.depth("front")
    assert (depth.shape, depth.dtype) == ((PICTURE_SIZE, PICTURE_SIZE, 1), np.int16)
    for row in (104, 150, 200):
        slope = 0.894427 + 0.447214 * (row + 0.5 - MIDDLE) / MIDDLE
        assert depth[row, MIDDLE, 0] == pytest.approx(400 / slope, abs=1)


@pytest.mark.parametrize("camera", CAMERAS)
def test_the_pixels_of_each_object_lie_where_its_position_projects(world, cameras, camera):
    """Within two pixels; depth is in millimeters."""
    pixels = cameras.segmentation(camera)
    assert (pixels.shape, pixels.dtype) == (cameras.picture(camera).shape[:2], np.int16)
    for body in world.bodies.values():
        entity = body.entity if body.button is None else body.button.links[1].entity
        rows, columns = np.nonzero(pixels == entity.per_scene_id)
        assert len(rows) > 50
        place = cameras.extrinsic(camera) @ np.append(entity.pose.p, 1.0)
        x, y, distance = cameras.intrinsic(camera) @ place
        assert (columns.mean(), rows.mean()) == pytest.approx((x / distance, y / distance), abs=2)
        depth = cameras.depth(camera)[rows, columns, 0]
        assert depth.mean() / 1000 == pytest.approx(distance, abs=0.03)


def test_picture_depth_and_segmentation_of_a_moment_take_one_drawing(world, cameras, takes):
    """`takes` counts drawings. The cube moves by 3 cm, so all three have to be drawn anew once."""
    cube = world.bodies["cube_red"]
    for offset in (0.0, 0.03):
        place = cube.item.position
        cube.put(place._replace(x=place.x + offset))
        before = len(takes)
        cameras.segmentation("front")
        cameras.depth("front")
        picture = cameras.picture("front")
        assert len(takes) <= before + 1
        seen = cameras.segmentation("front") == cube.entity.per_scene_id
        # What is the cube's is red, so both are of the same moment.
        assert (picture[seen][:, 0] > 60).all()
        assert (picture[seen][:, 1:] < 60).all()
        picture[:] = 0  # callers may do with a picture what they like
        assert cameras.picture("front")[seen].any()
    assert len(takes) >= 1

    cube.put(cube.item.position)


def test_pictures_of_a_world_do_not_change_when_another_world_is_drawn():
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
