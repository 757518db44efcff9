"""Videos and primitives take as long as RoboMME's, from the facts: its data and ours are alike."""

import itertools
from collections import defaultdict
from statistics import median

import pytest
from drawn_scenes import drawn_episodes
from selection import slow_but

from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.expert.primitives import MotionPrimitives

pytestmark = pytest.mark.sim

FRAMES_OF_VIDEOS = {
    ("VideoUnmask", "easy"): (66, 66),
    ("VideoUnmask", "hard"): (66, 66),
    ("VideoUnmaskSwap", "easy"): (114, 168),
    ("VideoUnmaskSwap", "hard"): (168, 216),
    ("VideoRepick", "easy"): (254, 327),
    # Two swaps take as long as in easy episodes, 306.
    ("VideoRepick", "medium"): (306, 372),
    ("VideoRepick", "hard"): (155, 203),
    ("VideoPlaceButton", "easy"): (710, 833),
    ("VideoPlaceButton", "hard"): (710, 833),
    ("VideoPlaceOrder", "easy"): (738, 1077),
    ("VideoPlaceOrder", "hard"): (738, 1077),
}
"""Frames, shortest and longest known."""

STEPS_OF_PRIMITIVES = {
    "pick_cube": (67, 137),
    "place_on": (66, 117),
    "put_down": (46, 81),
    "press": (68, 122),
    "retreat": (43, 65),
    "hold": (54, 60),
    "go_home": (36, 36),
}
"""Control steps, shortest and longest known, in the videos of the Reference tasks."""


@pytest.mark.parametrize(
    ("task", "difficulty"), slow_but([("VideoUnmaskSwap", "easy")], FRAMES_OF_VIDEOS)
)
def test_our_videos_are_as_long_as_robomme_s_within_a_tenth(task, difficulty):
    low, high = FRAMES_OF_VIDEOS[task, difficulty]
    episode = next(drawn_episodes(task, difficulty))
    frames = []

    EpisodeSession(episode, visible=False).play_demonstration(frames.append)

    assert 0.9 * low <= len(frames) <= 1.1 * high


def test_our_motions_take_as_many_steps_as_robomme_s_within_15_percent():
    """Motions ("primitives") are picks, placements and the like, in the videos of two tasks."""
    steps = defaultdict(list)
    for task in ("VideoRepick", "VideoPlaceButton"):
        for episode in itertools.islice(drawn_episodes(task, "medium"), 2):
            session = EpisodeSession(episode, visible=False)
            expert = MotionPrimitives(session.world)
            for stage in episode.demonstration:
                begin = session.world.elapsed
                for action in itertools.chain.from_iterable(expert.execute(stage.primitive)):
                    session.step(action)
                steps[stage.primitive.kind].append(session.world.elapsed - begin)

    assert set(steps) == set(STEPS_OF_PRIMITIVES)
    for kind, (low, high) in STEPS_OF_PRIMITIVES.items():
        assert 0.85 * low <= min(steps[kind]), kind
        assert max(steps[kind]) <= 1.15 * high, kind
        assert low <= median(steps[kind]) <= high, kind
