"""Episodes that take turns in a process draw the numbers that they draw alone."""

import random

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from roboirg.policies.contract.random_state import RandomState, RandomTurns

NOBODY = None


def draw():
    return random.random(), np.random.random()  # noqa: NPY002 - what policies may use


def drawn_alone(seed, count):
    RandomTurns().begin(RandomState(seed))
    return [draw() for _ in range(count)]


@given(st.lists(st.sampled_from([0, 1, 2, NOBODY]), max_size=30))
def test_the_order_of_turns_changes_no_episode_s_numbers(turns):
    states = [RandomState(seed) for seed in range(3)]
    random_turns = RandomTurns()
    found = [[], [], []]

    for turn in turns:
        if turn is NOBODY:  # a call for several episodes
            random_turns.end()
            draw()
        else:
            random_turns.begin(states[turn])
            found[turn].append(draw())

    for seed, numbers in enumerate(found):
        assert numbers == drawn_alone(seed, len(numbers))
