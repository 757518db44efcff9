"""The Gymnasium environment: contract, verdicts, limits, and bad input."""

import dataclasses
import inspect
import os
import re
import subprocess
import sys
import warnings
import weakref

import gymnasium
import numpy as np
import pytest
from flat_jobs import job_of
from gymnasium.utils.env_checker import check_env

import roboirg
from roboirg.core.actions import ACTION_SPACES
from roboirg.core.environment_options import ENVIRONMENT_OPTIONS
from roboirg.core.errors import InvalidValueError, RoboIRGError, UnknownNameError
from roboirg.core.instruction_options import OPTION_NAMES
from roboirg.core.observations import PICTURE_SIZE
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.envs.env_settings import EnvOptions, EnvSettings
from roboirg.envs.environment import RoboIRGEnv
from roboirg.policies import make_policy, play
from roboirg.runs.job_instruction import PreparedJob
from roboirg.runs.play.policy_environment import make_env
from roboirg.simulation.cameras import Cameras
from roboirg.simulation.physics_settings import HOME_ACTION

pytestmark = pytest.mark.sim


@pytest.mark.parametrize(
    ("task", "options"), [("ButtonUnmask", {}), ("VideoUnmask", {"observe_every": 1})]
)
def test_the_environment_passes_gymnasiums_own_checker(task, options):
    # Drawing is tested elsewhere; the checker resets a dozen times.
    env = roboirg.make(task, setting="direct", cameras=(), **options)
    with warnings.catch_warnings():
        # Joint targets are in radians and positions in meters, not in [-1, 1].
        warnings.filterwarnings("ignore", message=".*(Box action|Box observation).*")
        check_env(env)


def test_observations_and_the_video_have_the_declared_shapes_and_show_what_they_should():
    """VideoUnmask shows a video in which colored cubes are hidden below containers."""
    env = roboirg.make("VideoUnmask", setting="spatial", episode=1, demonstration_frames=2)
    observation, info = env.reset()
    assert observation in env.observation_space
    assert observation["front_rgb"].shape == observation["wrist_rgb"].shape == (256, 256, 3)
    assert observation["instruction"] == env.instruction.text
    assert info["demonstration"]["front_rgb"].shape == (33, 256, 256, 3)
    assert info["demonstration"]["joint_positions"].shape == (66, 7)
    assert info["elapsed_steps"] == 67

    # The video shows colored cubes, then only containers; so does the first observation.
    video = info["demonstration"]["front_rgb"].astype(int)
    colored = (np.ptp(video, axis=-1) > 200).any(axis=(1, 2))
    assert colored.tolist() == [True] * 16 + [False] * 17
    assert not (np.ptp(observation["front_rgb"].astype(int), axis=-1) > 200).any()

    observation, reward, terminated, truncated, info = env.step(HOME_ACTION)
    assert observation in env.observation_space
    assert (reward, terminated, truncated, info["steps"]) == (0.0, False, False, 1)


def test_depth_and_calibration_are_given_for_the_wanted_camera_alone():
    """Intrinsic and extrinsic matrices are of every step of the video, depth of every 33rd."""
    options = {"episode": 1, "cameras": ("front",), "demonstration_frames": 33}
    env = roboirg.make("VideoUnmask", depth=True, calibration=True, **options)
    observation, info = env.reset()
    assert observation in env.observation_space

    fields = {
        "front_depth": ((PICTURE_SIZE, PICTURE_SIZE, 1), np.int16),
        "front_extrinsic": ((3, 4), np.float32),
        "front_intrinsic": ((3, 3), np.float32),
    }
    for key, (shape, kind) in fields.items():
        assert (observation[key].shape, observation[key].dtype) == (shape, kind)
        video = info["demonstration"][key]
        frames = 2 if key == "front_depth" else 66
        assert (video.shape, video.dtype) == ((frames, *shape), kind)
    assert not any(key.startswith("wrist") for key in observation)

    plain = roboirg.make("VideoUnmask", **options).reset()[0]
    assert set(observation) - set(plain) == set(fields)
    assert np.array_equal(plain["front_rgb"], observation["front_rgb"])


def test_a_grounded_subgoal_points_at_the_pixel_of_its_object():
    """A subgoal is the next act in words; *grounded* adds a pixel (row, column) of the front."""
    env = roboirg.make("VideoUnmask", episode=1, cameras=(), grounded=True)
    _, info = env.reset()
    assert info["demonstration_subgoals"] == ["static"] * 66

    container = env.episode.stages[0].points_at
    color = env.episode.scene.hidden_in(container).color
    assert info["subgoal"] == f"pick up the container that hides the {color} cube"
    grounded = rf"pick up the container at <(\d+), (\d+)> that hides the {color} cube"
    row, column = map(int, re.fullmatch(grounded, info["grounded_subgoal"]).groups())
    # Projected by hand; the center of a container is some 4 cm above the table.
    x, y, _ = env.episode.scene[container].position
    z = 0.04
    distance = -0.44721 * x - 0.89443 * z + 0.49194
    middle = PICTURE_SIZE / 2
    expected_row = middle + middle * (0.89443 * x - 0.44721 * z - 0.08944) / distance
    assert row == pytest.approx(expected_row, abs=6)
    assert column == pytest.approx(middle + middle * y / distance, abs=6)


def test_the_pixel_of_a_subgoal_stays_the_same_until_its_act_is_done():
    """Lifting moves the container, not its pixel; after the end the last one stays."""
    env = roboirg.make("VideoUnmask", episode=1, cameras=(), grounded=True)
    _, info = env.reset()
    policy = make_policy("oracle", 0)
    policy.attach(env)
    policy.reset(env.instruction.text, info["demonstration"])

    subgoals = {info["subgoal"]: {info["grounded_subgoal"]}}
    while info["status"] == "ongoing":
        before = info
        *_, info = env.step_chunk(policy.act({}))
        subgoals.setdefault(info["subgoal"], set()).add(info["grounded_subgoal"])

    assert (info["status"], info["subgoal"]) == ("success", "All tasks completed")
    assert info["grounded_subgoal"] == before["grounded_subgoal"]
    assert len(subgoals) == len(env.episode.stages) + 1
    assert all(len(grounded) == 1 for grounded in subgoals.values())


def test_a_subgoal_changes_one_step_after_its_act_and_has_a_pixel_only_if_it_points():
    """Acts that point at a thing are to pick it up, for instance; pressing a button need not."""
    env = roboirg.make("PickXtimes", episode=1, cameras=(), grounded=True)
    changes = []

    def note(env, _demonstration):
        info = env._info()
        pair = (info["subgoal"], info["grounded_subgoal"])
        if not changes or changes[-1][1] != pair:
            changes.append((env.session.world.elapsed, pair))

    env.set_frame_hook(note)

    info = play(env, make_policy("oracle", 0))

    assert info["status"] == "success"
    steps = {}
    for event in reversed(env.events):
        steps[event.fact] = event.step  # at last the first
    happened = [steps[stage.expects] for stage in env.episode.stages]
    assert [step for step, _ in changes[1:-1]] == [step + 1 for step in happened[:-1]]
    assert changes[-1][0] == happened[-1]
    for stage, (_, (simple, grounded)) in zip(env.episode.stages, changes, strict=False):
        assert re.sub(r"at <\d+, \d+> ?", "", grounded).strip() == simple
        assert ("<" in grounded) == (stage.points_at is not None)


def test_the_types_of_the_options_of_make_are_those_of_the_environment():
    """Editors read them from one class; would find an option that is missing there."""
    typed = {name: hint.__forward_arg__ for name, hint in EnvOptions.__annotations__.items()}
    own = {option.name: option.type for option in dataclasses.fields(EnvSettings)}
    del own["words"], own["environment"]  # whose fields are options

    assert typed.keys() == {*own, *OPTION_NAMES, *ENVIRONMENT_OPTIONS}
    assert {name: typed[name] for name in own} == own
    for made in (roboirg.make, RoboIRGEnv):
        annotation = inspect.signature(made).parameters["options"].annotation
        assert annotation == "Unpack[EnvOptions]"


def test_every_option_of_make_is_in_its_docstring_and_an_unknown_one_is_refused():
    _, _, documented = inspect.getdoc(roboirg.make).partition("Keyword Args:")
    documented, _, _ = documented.partition("Raises:")
    shared = {*OPTION_NAMES, *ENVIRONMENT_OPTIONS}
    own = [name for name in EnvOptions.__annotations__ if name not in shared]

    assert re.findall(r"^    (\w+): ", documented, re.MULTILINE) == own
    with pytest.raises(UnknownNameError, match=r"option of make\(\) 'camera'.*mean 'cameras'"):
        roboirg.make("PickXtimes", camera=("front",))


def test_a_policy_is_not_played_in_an_environment_of_another_action_space():
    env = roboirg.make("PickXtimes", cameras=(), actions="ee_pose")
    with pytest.raises(InvalidValueError, match="make it with actions='joint_angle'"):
        play(env, make_policy("oracle", 0))


@pytest.mark.parametrize("attribute", ["depth", "calibration"])
def test_a_policy_is_not_played_in_an_environment_without_the_depth_or_calibration_it_needs(
    attribute,
):
    policy = make_policy("random", 0)
    setattr(policy, attribute, True)
    policy.cameras = ("front",)

    with pytest.raises(InvalidValueError, match=f"make it with {attribute}=True"):
        play(roboirg.make("PickXtimes", cameras=()), policy)


def test_a_run_makes_the_environment_with_the_action_space_that_the_policy_declares():
    job = job_of(policy="random", task="PickXtimes", split="test", episode=2, setting="direct")
    for space in ACTION_SPACES.values():
        env = make_env(PreparedJob(job), PolicyNeeds(cameras=(), actions=space.name))
        assert env.actions == space.name
        assert np.array_equal(env.action_space.low, space.low)


def test_a_task_without_a_video_has_a_demonstration_of_no_frames():
    env = roboirg.make("PickXtimes", cameras=("wrist",))
    observation, info = env.reset()

    assert set(observation) == set(env.observation_space)
    assert "front_rgb" not in observation
    assert {key: len(value) for key, value in info["demonstration"].items()} == {
        "wrist_rgb": 0,
        "joint_positions": 0,
        "gripper": 0,
        "end_effector": 0,
    }
    assert info["elapsed_steps"] == 1


def test_the_frame_hook_is_called_every_eighth_step_and_at_the_end():
    """The first 66 steps are the video."""
    env = roboirg.make("VideoUnmask", cameras=())
    calls = []
    env.set_frame_hook(
        lambda env, demonstration: calls.append((env.session.world.elapsed, demonstration)), every=8
    )
    info = play(env, make_policy("oracle", 0))
    last = info["elapsed_steps"]
    expected = [step for step in range(1, last + 1) if step % 8 == 0 or step == last]

    assert [step for step, _ in calls] == expected
    assert [demonstration for step, demonstration in calls] == [step <= 66 for step in expected]


def test_a_chunk_of_actions_does_what_its_rows_do_one_by_one_and_stops_at_the_end():
    """It keeps every fourth observation as history. The limit is 25 steps of 27 actions."""
    rng = np.random.default_rng(0)
    noise = np.append(rng.normal(0, 0.1, (27, 7)), rng.normal(0, 1, (27, 1)), 1)
    actions = HOME_ACTION + noise
    options = {"cameras": ("wrist",), "depth": True, "max_steps": 25}
    single = roboirg.make("PickXtimes", **options)
    single.reset()
    steps = {step: single.step(action) for step, action in enumerate(actions[:25], 1)}
    env = roboirg.make("PickXtimes", **options, observe_every=4)
    first, _ = env.reset()
    assert first["history"] == ()

    for rows, kept in (
        (actions[:3], []),
        (actions[3:10], [4, 8]),
        (actions[10:20], [12, 16, 20]),
        (actions[20:], [24]),
    ):
        observation, *ended, info = env.step_chunk(rows)

        assert observation in env.observation_space
        _, *ended_alone, info_alone = steps[info["steps"]]
        assert (ended, info["status"]) == (ended_alone, info_alone["status"])
        last = dict(observation)
        history = last.pop("history")
        assert len(history) == len(kept)
        for seen, step in zip((*history, last), (*kept, info["steps"]), strict=True):
            check_same_observation(seen, steps[step][0])
    assert ended == [0.0, False, True]
    assert info["status"] == "timeout"
    assert env.events == single.events


def check_same_observation(seen, expected):
    assert list(seen) == list(expected)
    for key, value in expected.items():
        assert np.array_equal(seen[key], value), key


def test_the_history_of_a_chunk_has_the_words_of_each_of_its_moments():
    """Utterances are said at steps 0 and 20; kept are steps 19 and 38."""
    env = roboirg.make(
        "PickXtimes", setting="direct", cameras=(), observe_every=19, delivery="turns"
    )
    env.reset()

    observation, *_ = env.step_chunk(np.tile(HOME_ACTION, (40, 1)))

    first, second = env.instruction.turns
    heard = [seen["instruction"] for seen in observation["history"]]
    assert heard == [first, second]


def test_the_history_of_a_chunk_draws_only_the_cameras_it_was_asked_for(monkeypatch):
    """Of 20 steps the 8th and 16th from the front, then both cameras at the end."""
    drawn = []
    picture = Cameras.picture
    monkeypatch.setattr(
        Cameras, "picture", lambda self, name: drawn.append(name) or picture(self, name)
    )
    env = roboirg.make("PickXtimes", observe_every=8, history_cameras=("front",))
    env.reset()
    drawn.clear()

    observation, *_ = env.step_chunk(np.tile(HOME_ACTION, (20, 1)))

    assert observation in env.observation_space
    assert drawn == ["front", "front", "front", "wrist"]
    for seen in observation["history"]:
        assert "front_rgb" in seen
        assert "wrist_rgb" not in seen


class NeedsHistory:
    """Requires its own observations and video."""

    cameras = ()
    observe_every = 5
    demonstration_frames = "none"

    def reset(self, instruction, demonstration):
        self.seen = [len(demonstration)]

    def act(self, observation):
        self.seen.append(len(observation["history"]))
        return np.tile(HOME_ACTION, (7, 1))


def test_a_policy_gets_the_history_and_the_video_that_it_declares():
    """Every 5th step of chunks of 7: none at the reset, then step 5, then step 10."""
    policy = NeedsHistory()
    wrong = roboirg.make("PickXtimes", cameras=(), demonstration_frames="none")
    with pytest.raises(InvalidValueError, match=r"needs observe_every=5, but .* has None"):
        play(wrong, policy)

    name = f"{__name__}:NeedsHistory"
    job = job_of(policy=name, task="PickXtimes", split="test", episode=2, setting="direct")
    env = make_env(
        PreparedJob(job), PolicyNeeds(cameras=(), demonstration_frames="none", observe_every=5)
    )
    env.max_steps = 20
    play(env, policy)

    assert policy.seen == [3, 0, 1, 1]


def test_a_reset_with_another_setting_changes_the_words_for_that_episode_alone():
    env = roboirg.make("PickXtimes", cameras=())
    said = env.instruction
    env.reset()
    assert env.instruction is said

    env.reset(options={"setting": "direct"})
    assert env.instruction.setting == "direct"

    env.reset()
    assert env.instruction == said


def test_the_tools_angles_in_observations_do_not_jump_by_a_full_turn():
    """The wrist swings through half a turn, where an angle would go from 180° to -180°."""
    env = roboirg.make("PickXtimes", cameras=())
    observation, _ = env.reset()
    angles = [observation["end_effector"][3:]]
    action = HOME_ACTION.copy()

    for step in range(60):
        action[6] = HOME_ACTION[6] + 1.5 * np.sin(step / 10)
        action[4] = 0.05 * np.cos(step / 3)
        angles.append(env.step(action)[0]["end_effector"][3:])

    assert np.abs(np.diff(angles, axis=0)).max() < 0.5


def test_closing_an_environment_frees_its_world():
    """Would find a reference that keeps the memory of every episode."""
    env = roboirg.make("VideoUnmask", cameras=(), max_steps=60)
    policy = make_policy("oracle", 0)
    assert play(env, policy)["status"] == "timeout"
    with pytest.raises(gymnasium.error.ResetNeeded, match="timeout"):
        env.step(HOME_ACTION)

    world = weakref.ref(env.session.world)
    env.close()
    del policy
    assert world() is None


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"task": "pickxtimes"}, "Did you mean 'PickXtimes'"),
        ({"setting": "implicit"}, "setting"),
        ({"split": "dev"}, "split"),
        ({"cameras": ("side",)}, "camera"),
        ({"episode": 50}, "episodes 0 to 49"),
        *(({"max_steps": wrong}, f"max_steps is {wrong!r}") for wrong in (0, 2.5, "3", None)),
        ({"actions": "pose"}, "no action space 'pose'.*ee_pose"),
        ({"cameras": (), "depth": True}, "depth is True, but cameras is"),
        ({"depth": 1}, "depth is 1; it must be True or False"),
        *(
            ({"demonstration_frames": wrong}, f"demonstration_frames is {wrong!r}")
            for wrong in (0, 1.5, True, "every", None)
        ),
        *(({"observe_every": wrong}, f"observe_every is {wrong!r}") for wrong in (0, 1.5, True)),
        ({"cameras": "front"}, r"cameras is .*\('front',\)"),
        ({"cameras": ("front",), "history_cameras": ("wrist",)}, "'wrist', but cameras is"),
    ],
)
def test_make_refuses_wrong_names_and_numbers_before_anything_is_built(options, message):
    with pytest.raises(RoboIRGError, match=message):
        roboirg.make(**{"task": "PickXtimes", **options})


PROGRAM_WITHOUT_VULKAN = """
import sys, roboirg
print(roboirg.make("PickXtimes", cameras=()).reset()[1]["status"])
try:
    roboirg.make("PickXtimes").reset()
finally:
    print(sorted({"torch", "mani_skill", "mplib"} & set(sys.modules)))
"""
PROGRAM_WITHOUT_GYMNASIUM = """
import sys; sys.modules["gymnasium"] = None
import roboirg, roboirg.language, roboirg.judging, roboirg.tasks.splits.splits
roboirg.make("PickXtimes")
"""


@pytest.mark.parametrize(
    ("code", "printed", "complaint"),
    [
        (PROGRAM_WITHOUT_VULKAN, "ongoing\n[]\n", "mesa-vulkan-drivers"),
        (PROGRAM_WITHOUT_GYMNASIUM, "", "[sim]'"),
    ],
)
def test_without_vulkan_or_gymnasium_the_error_names_what_to_install(code, printed, complaint):
    """Without Vulkan an episode without cameras still begins ("ongoing")."""
    missing = {"VK_DRIVER_FILES": "/nonexistent", "VK_ICD_FILENAMES": "/nonexistent"}
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **missing},
    )

    assert (done.returncode, done.stdout) == (1, printed)
    assert complaint in done.stderr.strip().splitlines()[-1]
