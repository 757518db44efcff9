"""The Gymnasium environment: contract, verdicts, limits, and bad input."""

import dataclasses
import inspect
import re
import warnings
import weakref
from typing import NamedTuple

import gymnasium
import numpy as np
import pytest
from flat_jobs import job_of
from gymnasium.utils.env_checker import check_env
from python_process import run_python

import roboirg
from roboirg.core.actions import ACTION_SPACES
from roboirg.core.environment_options import ENVIRONMENT_OPTIONS
from roboirg.core.errors import InvalidValueError, RoboIRGError, UnknownNameError
from roboirg.core.instruction_options import OPTION_NAMES
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
    """It resets, steps and compares spaces, once without and once with a video and a history."""
    env = roboirg.make(task, setting="direct", cameras=(), **options)
    with warnings.catch_warnings():
        # Joint targets are in radians and positions in meters, not in [-1, 1].
        warnings.filterwarnings("ignore", message=".*(Box action|Box observation).*")
        check_env(env)


@pytest.fixture(scope="module")
def reset_with_video():
    """An environment that was reset, its first observation, and info.

    The video shows that colored cubes are hidden below containers; every second moment is drawn.
    """
    env = roboirg.make("VideoUnmask", setting="spatial", episode=1, demonstration_frames=2)
    return env, *env.reset()


def test_the_first_observation_has_the_declared_shapes_and_the_words(reset_with_video):
    """Both cameras take pictures of 256 by 256 pixels; the instruction is the episode's."""
    env, observation, _ = reset_with_video

    assert observation in env.observation_space
    assert observation["front_rgb"].shape == (256, 256, 3)
    assert observation["wrist_rgb"].shape == (256, 256, 3)
    assert observation["instruction"] == env.instruction.text


def test_the_video_has_all_states_and_the_pictures_that_were_wanted(reset_with_video):
    """It has 66 steps, before a last one in which the robot goes home; every second is drawn."""
    _, _, info = reset_with_video
    video = info["demonstration"]

    assert video["front_rgb"].shape == (33, 256, 256, 3)
    assert video["joint_positions"].shape == (66, 7)
    assert info["elapsed_steps"] == 67


def has_colored_pixel(pictures):
    """Return for each picture whether red, green and blue of a pixel are far apart."""
    return (np.ptp(pictures.astype(int), axis=-1) > 200).any(axis=(-2, -1)).tolist()


def test_the_video_shows_colored_cubes_then_only_containers(reset_with_video):
    """And so does the first observation. The containers appear after 32 steps."""
    _, observation, info = reset_with_video

    assert has_colored_pixel(info["demonstration"]["front_rgb"]) == [True] * 16 + [False] * 17
    assert not has_colored_pixel(observation["front_rgb"])


def test_depth_and_calibration_are_given_for_the_wanted_camera_alone():
    """Intrinsic and extrinsic matrices are of every step of the video, depth of every 33rd."""
    options = {"episode": 1, "cameras": ("front",), "demonstration_frames": 33}
    plain, _ = roboirg.make("VideoUnmask", **options).reset()
    env = roboirg.make("VideoUnmask", depth=True, calibration=True, **options)

    observation, info = env.reset()

    added = observation.keys() - plain.keys()
    assert added == {"front_depth", "front_extrinsic", "front_intrinsic"}
    assert observation in env.observation_space
    assert {key: (observation[key].shape, str(observation[key].dtype)) for key in added} == {
        "front_depth": ((256, 256, 1), "int16"),
        "front_extrinsic": ((3, 4), "float32"),
        "front_intrinsic": ((3, 3), "float32"),
    }
    assert {key: info["demonstration"][key].shape for key in added} == {
        "front_depth": (2, 256, 256, 1),
        "front_extrinsic": (66, 3, 4),
        "front_intrinsic": (66, 3, 3),
    }
    assert np.array_equal(plain["front_rgb"], observation["front_rgb"])


def test_a_grounded_subgoal_points_at_the_pixel_of_its_object():
    """A subgoal is the next act in words; *grounded* adds a pixel (row, column) of the front.

    The container is at (-0.036, -0.085) m, with its center about 4 cm above the table, which the
    front camera sees in row 90 and column 105.
    """
    env = roboirg.make("VideoUnmask", episode=1, cameras=(), grounded=True)

    _, info = env.reset()

    assert info["demonstration_subgoals"] == ["static"] * 66
    assert info["subgoal"] == "pick up the container that hides the green cube"
    grounded = r"pick up the container at <(\d+), (\d+)> that hides the green cube"
    row, column = map(int, re.fullmatch(grounded, info["grounded_subgoal"]).groups())
    assert (row, column) == pytest.approx((90, 105), abs=6)


class Change(NamedTuple):
    """A change of subgoals: at which step, and what is shown from then on."""

    step: int
    subgoal: str
    grounded: str


def subgoals_of_the_oracle(task):
    """Return the environment of an episode that the oracle has played, and all changes of subgoals.

    The first is at its first step.
    """
    env = roboirg.make(task, episode=1, cameras=(), grounded=True)
    changes = [Change(0, "", "")]

    def note(env, is_demonstration):
        info = env._info()
        shown = (info["subgoal"], info["grounded_subgoal"])
        if not is_demonstration and changes[-1][1:] != shown:
            changes.append(Change(env.session.world.elapsed, *shown))

    env.set_frame_hook(note)
    assert play(env, make_policy("oracle", 0))["status"] == "success"
    return env, changes[1:]


def test_the_pixel_of_a_subgoal_stays_the_same_until_its_act_is_done():
    """In VideoUnmask a container is lifted, so its pixel moves, but the one in the subgoal must
    not: there is a change for each stage and one for the end, which keeps the last pixel."""
    env, changes = subgoals_of_the_oracle("VideoUnmask")

    assert len(changes) == len(env.episode.stages) + 1
    assert changes[-1].subgoal == "All tasks completed"
    assert changes[-1].grounded == changes[-2].grounded


@pytest.fixture(scope="module")
def oracle_with_subgoals():
    """An episode of PickXtimes that the oracle has played, and all changes of its subgoals."""
    return subgoals_of_the_oracle("PickXtimes")


def test_a_subgoal_changes_one_step_after_its_act_and_the_last_one_at_once(oracle_with_subgoals):
    """The fixture is an episode that the oracle has played, and each change of its subgoals with
    its step, the first of them at step 1. A stage of the task is done when the fact that it expects
    is first there. The next subgoal is shown one step later; after the last stage, where the
    episode ends, that all is done is shown at once."""
    env, changes = oracle_with_subgoals
    first_steps = {}
    for event in env.events:
        first_steps.setdefault(event.fact, event.step)
    done = [first_steps[stage.expects] for stage in env.episode.stages]

    changed = [change.step for change in changes]

    assert changed[0] == 1
    assert changed[1:-1] == [step + 1 for step in done[:-1]]
    assert changed[-1] == done[-1]


def test_the_options_that_make_declares_are_those_of_the_environment():
    """`EnvOptions` has the types of all keywords of `roboirg.make`, for editors. They are the
    fields of `EnvSettings`, in which two, words and environment, stand for the options of their
    own: those of instructions and those of environments."""
    fields = {field.name: field.type for field in dataclasses.fields(EnvSettings)}
    del fields["words"]
    del fields["environment"]

    typed = {name: hint.__forward_arg__ for name, hint in EnvOptions.__annotations__.items()}

    assert typed.keys() == {*fields, *OPTION_NAMES, *ENVIRONMENT_OPTIONS}
    assert fields.items() <= typed.items()


@pytest.mark.parametrize("made", [roboirg.make, RoboIRGEnv])
def test_editors_know_the_options_of_make_and_of_the_environment(made):
    """`EnvOptions` has the types of all keywords; with this annotation editors offer them."""
    options = inspect.signature(made).parameters["options"]

    assert options.annotation == "Unpack[EnvOptions]"


def test_every_option_of_make_is_in_its_docstring():
    """Under "Keyword Args:", up to "Raises:", it explains the options in order, each on a line
    "    name: ...". Those of instructions and of environments, which commands share, are explained
    elsewhere."""
    _, _, documented = inspect.getdoc(roboirg.make).partition("Keyword Args:")
    documented, _, _ = documented.partition("Raises:")
    shared = {*OPTION_NAMES, *ENVIRONMENT_OPTIONS}
    own = [name for name in EnvOptions.__annotations__ if name not in shared]

    assert re.findall(r"^    (\w+): ", documented, re.MULTILINE) == own


def test_an_unknown_option_of_make_is_refused_with_the_nearest_name():
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
    """A policy says by attributes what it needs. The random one is given a need, and the
    environment has no cameras at all."""
    policy = make_policy("random", 0)
    setattr(policy, attribute, True)
    policy.cameras = ("front",)

    with pytest.raises(InvalidValueError, match=f"make it with {attribute}=True"):
        play(roboirg.make("PickXtimes", cameras=()), policy)


@pytest.mark.parametrize("actions", ACTION_SPACES)
def test_a_run_makes_the_environment_with_the_action_space_that_the_policy_declares(actions):
    """The lower limits of its actions are those of the declared action space."""
    job = job_of(policy="random", task="PickXtimes", split="test", episode=2, setting="direct")

    env = make_env(PreparedJob(job), PolicyNeeds(cameras=(), actions=actions))

    assert env.actions == actions
    assert np.array_equal(env.action_space.low, ACTION_SPACES[actions].low)


def test_a_task_without_a_video_has_a_demonstration_of_no_frames():
    """PickXtimes has none, so each array has length 0. Without the front camera there are no
    pictures of it; one step goes by at the reset, in which the robot rests."""
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
    """In VideoUnmask the video takes 66 steps, and going home one more; the policy's turn follows,
    which is cut off after 14. So there are 67 + 14 = 81 steps. The hook is told which are of the
    video."""
    env = roboirg.make("VideoUnmask", cameras=(), max_steps=14)
    in_video = []
    in_turn = []

    def note(env, is_demonstration):
        steps = in_video if is_demonstration else in_turn
        steps.append(env.session.world.elapsed)

    env.set_frame_hook(note, every=8)
    play(env, make_policy("oracle", 0))

    assert in_video == [8, 16, 24, 32, 40, 48, 56, 64]
    assert in_turn == [72, 80, 81]


ACTIONS = HOME_ACTION + np.random.default_rng(0).normal(0, 0.1, (27, 8))


def check_same_observation(seen, expected):
    assert list(seen) == list(expected)
    for key, value in expected.items():
        assert np.array_equal(seen[key], value), key


@pytest.fixture(scope="module")
def single_steps():
    """What an environment returns for each of 25 actions, when time is up, by step from 1 on."""
    env = roboirg.make("PickXtimes", cameras=("wrist",), depth=True, max_steps=25)
    env.reset()
    return {step: env.step(action) for step, action in enumerate(ACTIONS[:25], 1)}


def test_a_chunk_of_actions_does_what_its_rows_do_one_by_one_and_stops_at_the_end(single_steps):
    """The limit is 25 steps, and the last chunk has two actions more."""
    env = roboirg.make("PickXtimes", cameras=("wrist",), depth=True, max_steps=25)
    env.reset()
    for begin, end in ((0, 3), (3, 10), (10, 20), (20, 27)):
        observation, *ended, info = env.step_chunk(ACTIONS[begin:end])

        expected, *expected_end, expected_info = single_steps[min(end, 25)]
        check_same_observation(observation, expected)
        assert ended == expected_end
        assert (info["steps"], info["status"]) == (min(end, 25), expected_info["status"])
    assert info["status"] == "timeout"


def test_the_history_of_a_chunk_has_every_fourth_observation(single_steps):
    """The chunk takes the steps 4 to 12."""
    env = roboirg.make("PickXtimes", cameras=("wrist",), depth=True, observe_every=4)
    first, _ = env.reset()
    env.step_chunk(ACTIONS[:3])

    observation, *_ = env.step_chunk(ACTIONS[3:12])

    assert first["history"] == ()
    assert observation in env.observation_space
    fourth, eighth, twelfth = observation["history"]
    check_same_observation(fourth, single_steps[4][0])
    check_same_observation(eighth, single_steps[8][0])
    check_same_observation(twelfth, single_steps[12][0])


def test_the_history_of_a_chunk_draws_only_the_cameras_it_was_asked_for(monkeypatch):
    """Of 20 steps the 8th and 16th from the front, then both cameras at the end."""
    drawn = []
    picture = Cameras.picture

    def noted(self, name):
        drawn.append(name)
        return picture(self, name)

    monkeypatch.setattr(Cameras, "picture", noted)
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
    """Requires its own observations and video, and notes what it gets of them."""

    cameras = ()
    observe_every = 5
    demonstration_frames = "none"

    def reset(self, instruction, demonstration):
        self.keys_of_video = sorted(demonstration)
        self.history_lengths = []

    def act(self, observation):
        self.history_lengths.append(len(observation["history"]))
        return np.tile(HOME_ACTION, (7, 1))


def test_a_policy_is_not_played_in_an_environment_without_the_history_it_needs():
    env = roboirg.make("PickXtimes", cameras=(), demonstration_frames="none")

    with pytest.raises(InvalidValueError, match=r"needs observe_every=5, but .* has None"):
        play(env, NeedsHistory())


@pytest.fixture
def policy_that_needs_history():
    """A policy after an episode of 20 steps, in the environment that a run makes for its needs.

    It needs an observation of every 5th step and no pictures, and acts in chunks of 7 steps.
    """
    job = job_of(policy="random", task="PickXtimes", split="test", episode=2, setting="direct")
    needs = PolicyNeeds(cameras=(), demonstration_frames="none", observe_every=5)
    env = make_env(PreparedJob(job), needs)
    env.max_steps = 20
    policy = NeedsHistory()
    play(env, policy)
    return policy


def test_a_policy_gets_the_history_that_it_declares(policy_that_needs_history):
    """The policy, from the fixture, declares that it needs an observation of every 5th step. It
    acts at steps 0, 7 and 14: the history since it acted last has nothing, step 5, step 10."""
    assert policy_that_needs_history.history_lengths == [0, 1, 1]


def test_a_policy_gets_the_video_that_it_declares(policy_that_needs_history):
    """The policy, from the fixture, declares that it needs no pictures of the video. What is left
    are the states of the robot."""
    keys = policy_that_needs_history.keys_of_video

    assert keys == ["end_effector", "gripper", "joint_positions"]


def test_the_tools_angles_in_observations_do_not_jump_by_a_full_turn():
    """The wrist swings through half a turn, where an angle would go from 180° to -180°."""
    env = roboirg.make("PickXtimes", cameras=())
    env.reset()
    angles = []
    action = HOME_ACTION.copy()

    for step in range(60):
        action[6] = HOME_ACTION[6] + 1.5 * np.sin(step / 10)
        action[4] = 0.05 * np.cos(step / 3)
        observation, *_ = env.step(action)
        angles.append(observation["end_effector"][3:])

    assert np.abs(np.diff(angles, axis=0)).max() < 0.5


def test_closing_an_environment_frees_its_world():
    """Would find a reference that keeps the memory of every episode."""
    env = roboirg.make("VideoUnmask", cameras=(), max_steps=10)
    play(env, make_policy("oracle", 0))
    world = weakref.ref(env.session.world)

    env.close()

    assert world() is None


def test_a_step_after_the_end_of_an_episode_asks_for_a_reset():
    """One step is allowed, so the episode has timed out after it."""
    env = roboirg.make("PickXtimes", cameras=(), max_steps=1)
    env.reset()
    env.step(HOME_ACTION)

    with pytest.raises(gymnasium.error.ResetNeeded, match="timeout"):
        env.step(HOME_ACTION)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"task": "pickxtimes"}, "Did you mean 'PickXtimes'"),
        ({"setting": "implicit"}, "setting"),
        ({"split": "dev"}, "split"),
        ({"cameras": ("side",)}, "camera"),
        ({"max_steps": 0}, "max_steps is 0"),
        ({"max_steps": "3"}, "max_steps is '3'"),
        ({"actions": "pose"}, "no action space 'pose'.*ee_pose"),
        ({"depth": 1}, "depth is 1; it must be True or False"),
        ({"demonstration_frames": "every"}, "demonstration_frames is 'every'"),
        ({"demonstration_frames": 1.5}, "demonstration_frames is 1.5"),
        ({"observe_every": True}, "observe_every is True"),
        ({"cameras": "front"}, r"cameras is .*\('front',\)"),
        ({"cameras": ("front",), "history_cameras": ("wrist",)}, "'wrist', but cameras is"),
    ],
)
def test_make_refuses_wrong_names_and_numbers_before_anything_is_built(options, message):
    with pytest.raises(RoboIRGError, match=message):
        roboirg.make(**{"task": "PickXtimes", **options})


def run_without_vulkan(program):
    """Run a program in a process that finds no driver for drawing."""
    missing = "/nonexistent"
    return run_python("-c", program, VK_DRIVER_FILES=missing, VK_ICD_FILENAMES=missing)


def test_without_vulkan_an_episode_with_cameras_ends_with_what_to_install():
    done = run_without_vulkan("import roboirg; roboirg.make('PickXtimes').reset()")

    assert done.returncode == 1
    assert "mesa-vulkan-drivers" in done.stderr.splitlines()[-1]


def test_without_vulkan_an_episode_without_cameras_begins_and_loads_no_large_library():
    done = run_without_vulkan(
        "import sys, roboirg\n"
        "print(roboirg.make('PickXtimes', cameras=()).reset()[1]['status'])\n"
        "print({'torch', 'mani_skill', 'mplib'} & set(sys.modules))\n"
    )

    assert done.stdout == "ongoing\nset()\n", done.stderr


def test_without_gymnasium_the_package_loads_and_make_names_what_to_install():
    done = run_without_vulkan(
        "import sys; sys.modules['gymnasium'] = None\n"
        "import roboirg, roboirg.language, roboirg.judging, roboirg.tasks.splits.splits\n"
        "roboirg.make('PickXtimes')\n"
    )

    assert done.returncode == 1
    assert "[sim]'" in done.stderr.splitlines()[-1]
