"""Pictures, depth, segmentation and calibration of the cameras fit the scene."""

import numpy as np
import pytest
from moved_worlds import seen_entity

from roboirg.core.observations import CAMERAS
from roboirg.simulation.physics_settings import HOME_ACTION
from roboirg.simulation.world import World
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim


def world_after_one_step(task, index):
    """Return the world of a test episode, with cameras, after one control step."""
    world = World(get_episode(task, "test", index).scene)
    world.step(HOME_ACTION)
    return world


@pytest.fixture(scope="module")
def world():
    """Cubes, a target and a button on a table."""
    return world_after_one_step("PickXtimes", 2)


@pytest.fixture(scope="module")
def cameras(world):
    return world.cameras


def test_the_front_camera_stands_where_robomme_s_does(cameras):
    """The matrix takes world coordinates (x, y, z, 1) to the camera's: right, down, ahead, in m."""
    extrinsic = cameras.extrinsic("front")

    robomme = [[0, 1, 0, 0], [0.89443, 0, -0.44721, -0.08944], [-0.44721, 0, -0.89443, 0.49194]]
    assert extrinsic == pytest.approx(np.array(robomme), abs=1e-5)


@pytest.mark.parametrize("camera", CAMERAS)
def test_each_camera_sees_90_degrees_in_256_pixels(cameras, camera):
    """So the focal length is 128 pixels, and the optical center is in the middle."""
    intrinsic = cameras.intrinsic(camera)

    expected = [[128, 0, 128], [0, 128, 128], [0, 0, 1]]
    assert intrinsic == pytest.approx(np.array(expected), abs=1e-4)


@pytest.mark.parametrize(("row", "millimeters"), [(104, 492.4), (150, 411.1), (200, 348.5)])
def test_depth_of_the_bare_table_agrees_with_geometry(cameras, row, millimeters):
    """The eye is 400 mm above the table and looks down at it in the middle column.

    A pixel's ray falls by 0.8944 + 0.4472 * (row + 0.5 - 128) / 128 for each unit of depth, so it
    meets the table at a depth of 400 mm through that number.
    """
    depth = cameras.depth("front")

    assert depth[row, 128, 0] == pytest.approx(millimeters, abs=1)


def pixels_of(cameras, camera, entity):
    """Return rows and columns of the pixels that an object has in the segmentation."""
    return np.nonzero(cameras.segmentation(camera) == entity.per_scene_id)


@pytest.mark.parametrize("camera", CAMERAS)
def test_the_pixels_of_an_object_surround_its_projected_position(world, cameras, camera):
    """`world` has cubes, a target and a button. For each object the center is projected: the
    extrinsic matrix takes its world coordinates (x, y, z, 1) to the camera's, and the intrinsic one
    these to a pixel, once divided by the distance. The pixels that the segmentation gives to the
    object lie around that pixel; their mean may be 2 pixels off, as the sides are seen, too."""
    for name, body in world.bodies.items():
        entity = seen_entity(body)
        in_camera = cameras.extrinsic(camera) @ [*entity.pose.p, 1.0]
        x, y, distance = cameras.intrinsic(camera) @ in_camera

        rows, columns = pixels_of(cameras, camera, entity)

        assert columns.mean() == pytest.approx(x / distance, abs=2), name
        assert rows.mean() == pytest.approx(y / distance, abs=2), name


@pytest.mark.parametrize("camera", CAMERAS)
def test_the_depth_of_a_cube_is_its_distance_in_millimeters(world, cameras, camera):
    """Along the camera's axis; a cube is 40 mm wide."""
    cube = world.bodies["cube_red"].entity
    _, _, distance_m = cameras.extrinsic(camera) @ [*cube.pose.p, 1.0]

    depth = cameras.depth(camera)[pixels_of(cameras, camera, cube)]

    assert depth.mean() == pytest.approx(1000 * distance_m, abs=30)


def test_segmentation_has_a_16_bit_number_for_each_pixel(cameras):
    """The front camera's picture has 256 by 256 pixels; each gets the number of the object that it
    shows."""
    segmentation = cameras.segmentation("front")

    assert (segmentation.shape, segmentation.dtype) == ((256, 256), np.int16)


def test_picture_depth_and_segmentation_of_a_moment_take_one_drawing(takes):
    """`takes` notes each time that a camera draws, with the camera's name. All three come from the
    same drawing, so there is one entry for them."""
    cameras = world_after_one_step("PickXtimes", 2).cameras

    cameras.segmentation("front")
    cameras.depth("front")
    cameras.picture("front")

    assert [camera for camera, _ in takes] == ["front"]


def test_picture_and_segmentation_show_the_same_moment():
    """The red cube is moved by 3 cm after a picture was taken. Then all pixels that the new
    segmentation calls its own must be red in the new picture: more than 60 of 255 of red, less
    of green and blue."""
    world = world_after_one_step("PickXtimes", 2)
    world.picture("front")
    cube = world.bodies["cube_red"]
    cube.put(cube.position._replace(x=cube.position.x + 0.03))

    segmentation = world.cameras.segmentation("front")
    colors = world.picture("front")[segmentation == cube.entity.per_scene_id]

    assert (colors[:, 0] > 60).all()
    assert (colors[:, 1:] < 60).all()


def test_a_caller_that_paints_over_a_picture_does_not_change_the_next_one(cameras):
    """A picture is asked for twice at the same moment, and the caller blackens the first one: the
    second one must be a copy of its own."""
    before = cameras.picture("front")
    kept = before.copy()
    before[:] = 0

    assert np.array_equal(cameras.picture("front"), kept)


def test_pictures_of_a_world_do_not_change_when_another_world_is_drawn():
    """A world at rest is drawn, then another world. The first one, drawn again, and an equal one
    that is made anew have the same pixels as before."""
    world = world_after_one_step("PickXtimes", 3)
    pictures = [world.picture(camera) for camera in CAMERAS]

    world_after_one_step("VideoUnmask", 0).picture("front")

    again = [world.picture(camera) for camera in CAMERAS]
    of_equal_world = world_after_one_step("PickXtimes", 3)
    drawn_anew = [of_equal_world.picture(camera) for camera in CAMERAS]
    assert np.array_equal(again, pictures)
    assert np.array_equal(drawn_anew, pictures)
