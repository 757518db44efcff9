"""The quick ways of drawing against the stock path, frame by frame, in two scenes side by side."""

import functools
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sapien
import sapien.physx
import sapien.render

import roboirg
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import CAMERAS
from roboirg.policies import make_policy, play
from roboirg.simulation import bodies, physics_settings
from roboirg.simulation.cameras import Cameras
from roboirg.simulation.panda import Panda
from roboirg.simulation.rendering import shaders
from roboirg.simulation.rendering.render_device import render_system
from roboirg.simulation.rendering.render_settings import FAITHFUL, LIGHT, STOCK, RenderSettings
from roboirg.simulation.scenery import add_scenery
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim


class DrawnScene:
    """A scene that is only looked at."""

    def __init__(self, scene, rendering):
        physics_settings.apply_physics_settings()
        physics_settings.apply_render_settings()
        self.scene = sapien.Scene([sapien.physx.PhysxCpuSystem(), render_system()])
        self.robot = Panda(self.scene, visible=True, rendering=rendering)
        add_scenery(self.scene, visible=True, rendering=rendering)
        self.bodies = [bodies.build(self.scene, item, visible=True) for item in scene.objects]
        physics_settings.add_lights(self.scene)
        self.cameras = Cameras(self.scene, self.robot, rendering)

    def show(self, moment):
        """Pictures and segmentations, (2, 256, 256, 3) and (2, 256, 256), of a moment."""
        joints, poses, presses = moment
        self.robot.articulation.set_qpos(joints)
        for body, pose, press in zip(self.bodies, poses, presses, strict=True):
            if body.button is None:
                body.entity.set_pose(pose)
            else:
                body.button.set_qpos(press)
        pictures = self.cameras.pictures(CAMERAS)
        segments = [self.cameras.segmentation(camera) for camera in CAMERAS]
        return np.stack([pictures[camera] for camera in CAMERAS]).astype(int), np.stack(segments)


def some_evenly_spaced(taken):
    """Return twelve moments, evenly spaced."""
    return [taken[number] for number in np.linspace(0, len(taken) - 1, 12).astype(int)]


@functools.cache
def states_of_oracle_s_run(task, index):
    """Return the moments of an oracle's run: joints, poses of bodies, and depths of buttons."""
    taken = []

    def note(env, _demonstration):
        world = env.session.world
        poses = []
        presses = []
        for body in world.bodies.values():
            poses.append(body.entity.pose)
            presses.append(None if body.button is None else body.button.get_qpos().copy())
        taken.append((world.robot.articulation.get_qpos().copy(), poses, presses))

    env = roboirg.make(task, episode=index, cameras=())
    env.set_frame_hook(note)
    assert play(env, make_policy("oracle", 0))["status"] == "success"
    return taken


@functools.cache
def differences_from_stock(rendering):
    """Draw a dozen moments in some way, and with SAPIEN's own shader and meshes.

    Returns how far apart colors are, of 256 levels, (24, 256, 256, 3), and which pixels of the
    segmentations are others, (24, 256, 256).
    """
    scene = get_episode("VideoPlaceButton", "test", 2).scene
    ours = DrawnScene(scene, rendering)
    stock = DrawnScene(scene, STOCK)
    apart = []
    others = []
    for moment in some_evenly_spaced(states_of_oracle_s_run("VideoPlaceButton", 2)):
        pictures, segments = ours.show(moment)
        stock_pictures, stock_segments = stock.show(moment)
        apart.append(np.abs(pictures - stock_pictures))
        others.append(segments != stock_segments)
    return np.concatenate(apart), np.concatenate(others)


@pytest.mark.slow
def test_leaving_out_what_is_out_of_sight_changes_no_pixel():
    """A dozen moments are drawn by two cameras with SAPIEN's own shader and meshes, once with all
    bodies and once without those out of sight. `apart` are the differences of colors, `others`
    the pixels of the segmentation that differ."""
    culling_alone = RenderSettings(slim_shader=False, meshes="stock")

    apart, others = differences_from_stock(culling_alone)

    assert not apart.any()
    assert not others.any()


@pytest.mark.slow
def test_faithful_drawing_differs_from_sapien_s_in_a_hundred_thousandth_of_the_pixels():
    """A dozen moments are drawn by two cameras, in our usual way and with SAPIEN's own shader and
    meshes. `apart` are the differences of colors, `others` the pixels of the segmentation that
    differ; a share of 1e-5 is allowed."""
    apart, others = differences_from_stock(FAITHFUL)

    assert apart.any(axis=-1).mean() <= 1e-5
    assert others.mean() <= 1e-5


@pytest.mark.slow
def test_light_drawing_differs_from_sapien_s_visibly_in_a_hundredth_of_the_pixels():
    """That is by more than 8 levels of 256. It has simpler meshes; the mean is half a level."""
    apart, _ = differences_from_stock(LIGHT)

    assert 0 < apart.mean() <= 0.5
    assert (apart.max(axis=-1) > 8).mean() <= 0.01


@pytest.mark.slow
@pytest.mark.parametrize("rendering", [FAITHFUL, LIGHT], ids=["faithful", "light"])
def test_each_way_of_drawing_gives_the_same_pixels_without_culling(rendering):
    """Culling leaves out what is out of sight, so with and without it a dozen moments of an
    oracle's run look the same to the bit."""
    scene = get_episode("VideoPlaceButton", "test", 2).scene
    culled = DrawnScene(scene, rendering)
    whole = DrawnScene(scene, replace(rendering, culling=False))

    for moment in some_evenly_spaced(states_of_oracle_s_run("VideoPlaceButton", 2)):
        check_same(culled.show(moment), whole.show(moment))


def check_same(shown, expected):
    """Assert that pictures and segmentations are equal."""
    for ours, wanted in zip(shown, expected, strict=True):
        assert np.array_equal(ours, wanted)


@pytest.fixture
def links_drawn(takes):
    """The links of the robot that each camera draws in an episode, by their names."""
    stage = DrawnScene(get_episode("PickXtimes", "test", 2).scene, FAITHFUL)
    for moment in some_evenly_spaced(states_of_oracle_s_run("PickXtimes", 2)):
        stage.show(moment)
    links = {camera: {} for camera in CAMERAS}
    for camera, drawn in takes:
        for body in drawn:
            if body in stage.robot.cullable_bodies:
                links[camera][body.entity.name] = body
    return links


def test_the_wrist_camera_draws_the_fingers_and_the_base_but_not_its_own_hand(links_drawn):
    """`links_drawn` has, for each camera, the links of the robot that it draws in an episode. The
    camera is on the hand, which is never in its view."""
    drawn = links_drawn["wrist"].keys()

    assert {"panda_link0", "panda_leftfinger", "panda_rightfinger"} <= drawn
    assert not {"panda_hand", "camera_link"} & drawn


def test_the_front_camera_draws_less_than_a_fifth_of_the_base(links_drawn):
    """Of the robot's base, link 0, the front camera sees a part alone, so triangles that are always
    hidden from it are left out; for the wrist camera there are more."""
    front = triangle_count(links_drawn["front"]["panda_link0"])
    wrist = triangle_count(links_drawn["wrist"]["panda_link0"])

    assert front < 0.2 * wrist


def triangle_count(body):
    """Return how many triangles of a body are drawn."""
    count = 0
    for shape in body.render_shapes:
        count += sum(len(part.triangles) for part in shape.parts)
    return count


def test_a_camera_draws_again_only_when_something_in_its_view_has_moved(takes):
    """`takes` notes each picture that is drawn. At steps 10 to 29 of the oracle's run the arm is on
    its way to the first cube: before the front camera nothing moves, so it draws one picture and
    keeps it. The wrist camera moves with the arm and draws each of the 20 anew."""
    scene = DrawnScene(get_episode("PickXtimes", "test", 2).scene, FAITHFUL)
    arm_on_its_way = states_of_oracle_s_run("PickXtimes", 2)[10:30]

    for moment in arm_on_its_way:
        scene.show(moment)

    drawn = [camera for camera, _ in takes]
    assert drawn.count("front") == 1
    assert drawn.count("wrist") == 20


def test_pictures_that_are_not_drawn_again_equal_those_that_are(takes):
    """At steps 10 to 29 of the oracle's run nothing moves before the front camera: it draws one
    picture, which `takes` notes, and shows it 20 times. A second scene has culling off, and with it
    all that spares drawing; its pictures must be the same."""
    scene = get_episode("PickXtimes", "test", 2).scene
    sparing = DrawnScene(scene, FAITHFUL)
    always_drawn = DrawnScene(scene, RenderSettings(culling=False))
    arm_on_its_way = states_of_oracle_s_run("PickXtimes", 2)[10:30]

    for moment in arm_on_its_way:
        check_same(sparing.show(moment), always_drawn.show(moment))

    drawn = [camera for camera, _ in takes]
    assert drawn.count("front") == 1


def test_a_sapien_version_with_another_shader_is_refused(monkeypatch):
    """Our shader is made from SAPIEN's by changing lines, for which its text has to be the known
    one; here its known checksum is replaced."""
    monkeypatch.setattr(shaders, "_STOCK_SHA256", "of another version")

    with pytest.raises(InvalidValueError, match=r"install sapien==3\.0\.3 again"):
        shaders.slim_shader.__wrapped__()


def test_a_damaged_shader_in_the_cache_is_rewritten(monkeypatch, tmp_path):
    """One file of the shader is cut off, and another one deleted. The next call makes both whole
    again, in the folder of the cache."""
    monkeypatch.setenv("ROBOIRG_CACHE", str(tmp_path))
    vertices = Path(shaders.slim_shader.__wrapped__(), "gbuffer.vert")
    text = vertices.read_text()
    vertices.write_text(text[:100])
    vertices.with_name("gbuffer.frag").unlink()

    folder = Path(shaders.slim_shader.__wrapped__())

    assert folder.is_relative_to(tmp_path)
    assert (folder / "gbuffer.vert").read_text() == text
    assert (folder / "gbuffer.frag").is_file()


def test_without_a_cache_the_shader_is_in_a_temporary_folder(monkeypatch):
    """The renderer needs files, so with the cache switched off they are written to a temporary
    folder."""
    monkeypatch.setenv("ROBOIRG_CACHE", "off")

    folder = Path(shaders.slim_shader.__wrapped__())

    assert (folder / "gbuffer.vert").is_file()
    shutil.rmtree(folder.parent)
