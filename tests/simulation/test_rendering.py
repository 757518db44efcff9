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
from roboirg.simulation.panda import BASE_LINK, CAMERA_LINK, FINGERS, Panda
from roboirg.simulation.rendering import shaders
from roboirg.simulation.rendering.render_device import render_system
from roboirg.simulation.rendering.render_settings import FAITHFUL, LIGHT, STOCK, RenderSettings
from roboirg.simulation.scenery import add_scenery
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim

CULLING_ALONE = RenderSettings(slim_shader=False, meshes="stock")

FRAMES = 12
"""Of a run."""

FAITHFUL_SHARE = 1e-5
NOTICEABLE_LEVELS = 8
NOTICEABLE_SHARE = 0.01
MEAN_LEVELS = 0.5


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
    """Return some moments, evenly spaced."""
    return [taken[number] for number in np.linspace(0, len(taken) - 1, FRAMES).astype(int)]


@functools.cache
def states_of_oracle_s_run(task, index):
    """Return moments of an oracle's run."""
    taken = []

    def note(env, _demonstration):
        world = env.session.world
        bodies = world.bodies.values()
        taken.append(
            (
                world.robot.articulation.get_qpos().copy(),
                [body.entity.pose for body in bodies],
                [None if it.button is None else it.button.get_qpos().copy() for it in bodies],
            )
        )

    env = roboirg.make(task, episode=index, cameras=())
    env.set_frame_hook(note)
    assert play(env, make_policy("oracle", 0))["status"] == "success"
    return taken


class Differences:
    """Sums over all pictures."""

    def __init__(self):
        self.pixels = self.changed = self.noticeable = self.segments = 0
        self.levels = 0.0

    def add(self, ours, stock):
        apart = np.abs(ours[0] - stock[0])
        self.pixels += apart[..., 0].size
        self.changed += int((apart.max(axis=-1) > 0).sum())
        self.noticeable += int((apart.max(axis=-1) > NOTICEABLE_LEVELS).sum())
        self.levels += float(apart.mean(axis=-1).sum())
        self.segments += int((ours[1] != stock[1]).sum())


@pytest.mark.slow
def test_fast_drawing_gives_the_pictures_of_sapien_s_own_shader_and_meshes():
    """*Faithful* may differ in a hundred-thousandth of the pixels; *light* has simpler meshes,
    and may differ visibly in 1 %. Leaving out what is out of sight changes nothing."""
    scene = get_episode("VideoPlaceButton", "test", 2).scene
    differences = {rendering: Differences() for rendering in (CULLING_ALONE, FAITHFUL, LIGHT)}
    uncut = {rendering: replace(rendering, culling=False) for rendering in (FAITHFUL, LIGHT)}
    renderings = (STOCK, *differences, *uncut.values())
    stages = {rendering: DrawnScene(scene, rendering) for rendering in renderings}

    for moment in some_evenly_spaced(states_of_oracle_s_run("VideoPlaceButton", 2)):
        shown = {rendering: stage.show(moment) for rendering, stage in stages.items()}
        for rendering, found in differences.items():
            found.add(shown[rendering], shown[STOCK])
        for rendering, whole in uncut.items():
            for picture, wanted in zip(shown[rendering], shown[whole], strict=True):
                assert np.array_equal(picture, wanted)

    culled = differences[CULLING_ALONE]
    assert culled.changed == culled.segments == 0
    faithful = differences[FAITHFUL]
    assert faithful.changed <= FAITHFUL_SHARE * faithful.pixels
    assert faithful.segments <= FAITHFUL_SHARE * faithful.pixels
    light = differences[LIGHT]
    assert light.changed > 0
    assert light.noticeable <= NOTICEABLE_SHARE * light.pixels
    assert light.levels <= MEAN_LEVELS * light.pixels


def test_parts_of_the_robot_that_a_camera_cannot_see_are_not_drawn(takes):
    stage = DrawnScene(get_episode("PickXtimes", "test", 2).scene, FAITHFUL)
    for moment in some_evenly_spaced(states_of_oracle_s_run("PickXtimes", 2)):
        stage.show(moment)

    links = {camera: {} for camera in CAMERAS}
    for camera, drawn in takes:
        for body in drawn:
            if body in stage.robot.cullable_bodies:
                links[camera][body.entity.name] = body
    assert {BASE_LINK, *FINGERS} <= set(links["wrist"])
    assert not {"panda_hand", CAMERA_LINK} & set(links["wrist"])
    seen_by_wrist = triangle_count(links["wrist"][BASE_LINK])
    assert triangle_count(links["front"][BASE_LINK]) < 0.2 * seen_by_wrist


def triangle_count(body):
    """Return how many triangles of a body are drawn."""
    count = 0
    for shape in body.render_shapes:
        count += sum(len(part.triangles) for part in shape.parts)
    return count


def test_a_camera_draws_again_only_when_something_in_its_view_has_moved(takes):
    """Twenty steps in which the arm, which carries the
    wrist camera, moves far from the front view."""
    scene = get_episode("PickXtimes", "test", 2).scene
    ours = DrawnScene(scene, FAITHFUL)
    always = DrawnScene(scene, RenderSettings(culling=False))
    some = states_of_oracle_s_run("PickXtimes", 2)[10:30]

    for moment in some:
        for mine, wanted in zip(ours.show(moment), always.show(moment), strict=True):
            assert np.array_equal(mine, wanted)

    # The cubes have come to rest, and the arm, which carries the other camera, is still far away.
    drawn = [camera for camera, _ in takes]
    assert drawn.count("front") == 1
    assert drawn.count("wrist") > 0.9 * len(some)


def test_a_sapien_version_with_another_shader_is_refused(monkeypatch):
    monkeypatch.setattr(shaders, "_STOCK_SHA256", "of another version")
    with pytest.raises(InvalidValueError, match=r"install sapien==3\.0\.3 again"):
        shaders.slim_shader.__wrapped__()


def test_a_damaged_shader_in_the_cache_is_rewritten(monkeypatch, tmp_path):
    monkeypatch.setenv("ROBOIRG_CACHE", str(tmp_path))
    folder = Path(shaders.slim_shader.__wrapped__())
    assert folder.is_relative_to(tmp_path)

    text = (folder / "gbuffer.vert").read_text()
    (folder / "gbuffer.vert").write_text(text[:100])
    (folder / "gbuffer.frag").unlink()
    assert shaders.slim_shader.__wrapped__() == str(folder)
    assert (folder / "gbuffer.vert").read_text() == text
    assert (folder / "gbuffer.frag").is_file()

    monkeypatch.setenv("ROBOIRG_CACHE", "off")
    passing = Path(shaders.slim_shader.__wrapped__())
    assert (passing / "gbuffer.vert").read_text() == text

    shutil.rmtree(passing.parent)
