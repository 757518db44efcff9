"""Chunks of actions as one step, also in Gymnasium's vector environment."""

import re
from functools import partial
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from python_process import print_of_python

import roboirg
from roboirg.core.errors import InvalidActionError, InvalidValueError
from roboirg.envs.action_chunks import ActionChunks
from roboirg.envs.registration import environment_id
from roboirg.simulation.physics_settings import HOME_ACTION

pytestmark = pytest.mark.sim

OPTIONS = {
    "setting": "spatial",
    "cameras": ("front",),
    "max_steps": 10,
    "meshes": "light",
    "demonstration_frames": 40,
    "observe_every": 3,
    "delivery": "turns",
}
THREE_CHUNKS = np.random.default_rng(0).normal(0, 0.05, (3, 2, 4, 8)) + HOME_ACTION
"""Three chunks of four actions for two environments, whose episodes last two and a half."""


def check_same(ours, theirs):
    """Assert that two observations are equal bit for bit."""
    assert set(ours) == set(theirs)
    for key, value in theirs.items():
        if key == "history":
            for own, other in zip(ours[key], value, strict=True):
                check_same(own, other)
        else:
            assert np.array_equal(ours[key], value), key


def check_second(batch, infos, observation, info):
    """Assert that the second of two environments gave the same, bit for bit, as a single one."""
    check_same({key: value[1] for key, value in batch.items()}, observation)
    for key in info.keys() - {"demonstration"}:
        assert np.all(infos[key][1] == info[key]), key
    for key, frames in info.get("demonstration", {}).items():
        assert np.array_equal(infos["demonstration"][1][key], frames), key


@pytest.fixture(scope="module")
def vector():
    """Two sub-environments in processes of their own; a step of each is a chunk of four actions.

    Their episodes have at most ten steps (`OPTIONS`).
    """
    vector = gymnasium.make_vec(
        f"roboirg.envs.registration:{environment_id('VideoUnmaskSwap')}",
        2,
        "async",
        vector_kwargs={"context": "spawn", "shared_memory": False},
        wrappers=[partial(ActionChunks, length=4)],
        episode=None,
        **OPTIONS,
    )
    yield vector
    vector.close()


def test_sub_environments_that_take_chunks_equal_single_ones(vector):
    """`vector` has two sub-environments. Seed 50 starts test episode 0 of 50 in the first and 1 in
    the second, which goes on with episode 2 after its end. A single environment with the same
    options plays these two with the same chunks, and gives the same, bit for bit (`check_second`).

    `THREE_CHUNKS` are random, each of four actions for each sub-environment. An episode ends after
    ten steps, so in the middle of the third chunk.
    """
    single = roboirg.make("VideoUnmaskSwap", **OPTIONS)

    batch, infos = vector.reset(seed=50)

    check_second(batch, infos, *single.reset(options={"episode": 1}))
    for chunks in THREE_CHUNKS:
        batch, rewards, terminated, truncated, infos = vector.step(chunks)
        observation, *ending, info = single.step_chunk(chunks[1])
        check_second(batch, infos, observation, info)
        assert [rewards[1], terminated[1], truncated[1]] == ending
    assert truncated.all()
    assert infos["steps"].tolist() == [10, 10]

    batch, *_, infos = vector.step(THREE_CHUNKS[0])

    check_second(batch, infos, *single.reset(options={"episode": 2}))


@pytest.mark.parametrize(
    "wrong",
    [np.zeros((2, 7)), np.zeros(7), np.full((3, 7), np.nan), "up"],
    ids=["two poses", "one pose", "not finite", "a text"],
)
def test_what_is_not_a_chunk_of_finite_numbers_is_refused_before_anything_moves(wrong):
    """A chunk is three actions here, each a pose of six numbers and the gripper. An array of two
    actions or of one, of numbers that are not finite, and a text are refused.
    """
    env = ActionChunks(roboirg.make("PickXtimes", cameras=(), actions="ee_pose"), 3)
    env.reset()

    with pytest.raises(InvalidActionError):
        env.step(wrong)

    assert env.unwrapped.executed_actions == 0


def test_the_action_space_has_the_shape_of_a_chunk():
    """A pose and the gripper are seven numbers, and a chunk has three of them."""
    env = ActionChunks(roboirg.make("PickXtimes", cameras=(), actions="ee_pose"), 3)

    assert env.action_space.shape == (3, 7)


def test_a_chunk_has_at_least_one_action():
    with pytest.raises(InvalidValueError, match="length is 0; it must be a whole number from 1"):
        ActionChunks(roboirg.make("PickXtimes", cameras=()), 0)


def test_the_documents_example_plays_a_chunk_of_16_actions_in_each_environment(tmp_path):
    """It is the program of docs/environment.md with `make_vec`, as it stands there.

    It has four environments that hold still for 16 steps, and prints for each whether it is solved
    and its steps.
    """
    page = (Path(__file__).parents[2] / "docs" / "environment.md").read_text()
    (example,) = re.findall(r"```python\n([^`]*make_vec[^`]*)```", page)
    script = tmp_path / "example.py"
    script.write_text(example)

    assert print_of_python(script) == "[False False False False] [16 16 16 16]\n"
