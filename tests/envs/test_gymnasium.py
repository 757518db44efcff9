"""At home in Gymnasium: reset options, its own vector environments, its wrappers, its registry."""

import warnings

import gymnasium
import numpy as np
import pytest
from python_process import print_of_python

import roboirg
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.envs.registration import environment_id
from roboirg.simulation.physics_settings import HOME_ACTION
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim

OPTIONS = {"cameras": ("front",), "meshes": "light", "max_steps": 2}
NAME = f"roboirg.envs.registration:{environment_id('PickXtimes')}"


def test_a_reset_chooses_episode_and_words_for_that_episode_alone():
    """The environment is made for episode 3. A reset asks for another episode in another setting
    and split, and gives what an environment that is made for it has. The next reset is back at
    episode 3 with its words; its seed chooses nothing, as an episode was named."""
    env = roboirg.make("PickXtimes", cameras=(), episode=3)
    words = env.instruction
    other = roboirg.make("PickXtimes", cameras=(), episode=5, setting="spatial", split="val")

    chosen, _ = env.reset(options={"episode": 5, "setting": "spatial", "split": "val"})
    assert chosen["instruction"] == other.instruction.text == env.instruction.text
    assert env.episode == other.episode

    env.reset(seed=8)
    assert env.instruction == words
    assert env.episode.index == 3


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"cameras": ()}, UnknownNameError, "no reset option 'cameras'; known: split, episode"),
        ({"episode": 50}, InvalidValueError, "no episode 50"),
    ],
)
def test_a_reset_refuses_unknown_options_and_episodes(options, error, words):
    """Cameras are chosen when an environment is made, not at a reset. The split *test* has 50
    episodes, 0 to 49."""
    env = roboirg.make("PickXtimes", cameras=())

    with pytest.raises(error, match=words):
        env.reset(options=options)


def test_an_environment_of_an_episode_of_ones_own_may_change_its_words_and_not_the_episode():
    """The environment is made for an episode object, and not for a number of a split."""
    env = roboirg.make(get_episode("PickXtimes", "test", 3), cameras=())
    env.reset(options={"setting": "spatial"})

    with pytest.raises(InvalidValueError, match="made for one episode; reset takes no 'episode'"):
        env.reset(options={"episode": 5})


def test_seeds_choose_episodes_if_none_is_named():
    """There are 50 episodes, so a seed chooses the rest of its division by 50 (1049: 49); without
    one the next episode is played, and after the last one the first."""
    env = roboirg.make("PickXtimes", cameras=(), episode=None)
    played = []

    for seed in (None, None, 1049, None, 7, 0, 53):
        env.reset(seed=seed)
        played.append(env.episode.index)

    assert played == [0, 1, 49, 0, 7, 0, 3]


@pytest.fixture
def vector():
    """Two environments of two steps each, whose seeds choose episodes, as Gymnasium makes them."""
    made = gymnasium.make_vec(NAME, 2, episode=None, **OPTIONS)
    yield made
    made.close()


def test_gymnasium_s_vector_environment_goes_on_with_the_next_episodes(vector):
    """`vector` has two environments with episodes of two steps. Seed 4 starts episode 4 in the
    first and 5 in the second; each goes on with its own next one, 5 and 6. An episode ends at the
    second step; the step after it only begins the next one, as Gymnasium's own class does it."""
    at_rest = np.tile(HOME_ACTION, (2, 1))
    vector.reset(seed=4)

    vector.step(at_rest)
    *_, infos = vector.step(at_rest)
    observations, *_ = vector.step(at_rest)

    next_instructions = [
        roboirg.make("PickXtimes", episode=index).instruction.text for index in (5, 6)
    ]
    assert list(infos["cause"]) == ["not done after 2 steps", "not done after 2 steps"]
    assert list(observations["instruction"]) == next_instructions


@pytest.mark.slow
def test_a_fork_before_drawing_works():
    """Gymnasium's "async" vector environment forks a process for each of its two environments. The
    program runs in a process of its own, since forking is refused where pictures have been drawn.
    It prints the instructions; seed 4 chooses episodes 4 and 5."""
    program = (
        "import gymnasium\n"
        f"vector = gymnasium.make_vec({NAME!r}, 2, 'async', episode=None, **{OPTIONS})\n"
        "print(*vector.reset(seed=4)[0]['instruction'], sep='\\n')\n"
        "vector.close()\n"
    )

    printed = print_of_python("-c", program)

    said = [roboirg.make("PickXtimes", episode=index).instruction.text for index in (4, 5)]
    assert printed.splitlines() == said


def test_a_fork_after_drawing_fails_at_once_with_the_reason():
    """The first line draws a picture in this process. The graphics driver does not survive a fork,
    and Gymnasium's "async" vector environment forks by default; so it must fail, and name the
    context that works."""
    roboirg.make("PickXtimes", **OPTIONS).reset()
    vector = gymnasium.make_vec(NAME, 2, "async", **OPTIONS)
    warnings.simplefilter("ignore")  # Gymnasium repeats the worker's traceback
    with pytest.raises(
        Exception, match=r"forked from one that had drawn pictures.*context='spawn'"
    ):
        vector.reset()

    vector.close(terminate=True)
