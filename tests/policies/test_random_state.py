"""Episodes that take turns in a process draw the numbers that they draw alone."""

import random

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from roboirg.policies.contract.random_state import RandomState, RandomTurns

NO_EPISODE = None


def draw_two_numbers():
    return random.random(), np.random.random()  # noqa: NPY002 - what policies may use


def drawn_alone(seed, count):
    RandomTurns().begin(RandomState(seed))
    return [draw_two_numbers() for _ in range(count)]


@given(st.lists(st.sampled_from([0, 1, 2, NO_EPISODE]), max_size=30))
def test_interleaved_episodes_draw_the_same_random_numbers_as_alone(turns):
    """Three episodes share Python's and NumPy's global generators in one process."""
    states = [RandomState(seed) for seed in range(3)]
    random_turns = RandomTurns()
    found = [[], [], []]

    for turn in turns:
        if turn is NO_EPISODE:  # a call for several episodes
            random_turns.end()
            draw_two_numbers()
        else:
            random_turns.begin(states[turn])
            found[turn].append(draw_two_numbers())

    for seed, numbers in enumerate(found):
        assert numbers == drawn_alone(seed, len(numbers))
