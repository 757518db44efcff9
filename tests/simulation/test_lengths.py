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


@pytest.mark.parametrize(
    ("task", "difficulty", "shortest", "longest"),
    slow_but(
        [("VideoUnmaskSwap", "easy", 114, 168)],
        [
            ("VideoUnmask", "easy", 66, 66),
            ("VideoUnmask", "hard", 66, 66),
            ("VideoUnmaskSwap", "easy", 114, 168),
            ("VideoUnmaskSwap", "hard", 168, 216),
            ("VideoRepick", "easy", 254, 327),
            ("VideoRepick", "medium", 306, 372),
            ("VideoRepick", "hard", 155, 203),
            ("VideoPlaceButton", "easy", 710, 833),
            ("VideoPlaceButton", "hard", 710, 833),
            ("VideoPlaceOrder", "easy", 738, 1077),
            ("VideoPlaceOrder", "hard", 738, 1077),
        ],
    ),
)
def test_our_videos_are_as_long_as_robomme_s_within_a_tenth(task, difficulty, shortest, longest):
    """`shortest` and `longest` are the numbers of frames of RoboMME's published videos."""
    episode = next(drawn_episodes(task, difficulty))
    frames = []

    EpisodeSession(episode, visible=False).play_demonstration(frames.append)

    assert 0.9 * shortest <= len(frames) <= 1.1 * longest


def steps_of_primitives(episode):
    """Yield the kind of each primitive of a video, such as a pick, and the steps it takes."""
    session = EpisodeSession(episode, visible=False)
    expert = MotionPrimitives(session.world)
    for stage in episode.demonstration:
        begin = session.world.elapsed
        for action in itertools.chain.from_iterable(expert.execute(stage.primitive)):
            session.step(action)
        yield stage.primitive.kind, session.world.elapsed - begin


def test_our_motions_take_as_many_steps_as_robomme_s_within_15_percent():
    """For each kind of motion the table has the fewest and the most control steps in RoboMME's
    videos. Ours, of two videos of each of two tasks, must be within 15 % of these bounds, and
    their median between them."""
    robomme = {
        "pick_cube": (67, 137),
        "place_on": (66, 117),
        "put_down": (46, 81),
        "press": (68, 122),
        "retreat": (43, 65),
        "hold": (54, 60),
        "go_home": (36, 36),
    }
    ours = defaultdict(list)
    for task in ("VideoRepick", "VideoPlaceButton"):
        for episode in itertools.islice(drawn_episodes(task, "medium"), 2):
            for kind, steps in steps_of_primitives(episode):
                ours[kind].append(steps)

    assert set(ours) == set(robomme)
    for kind, (fewest, most) in robomme.items():
        assert 0.85 * fewest <= min(ours[kind]), kind
        assert fewest <= median(ours[kind]) <= most, kind
        assert max(ours[kind]) <= 1.15 * most, kind
