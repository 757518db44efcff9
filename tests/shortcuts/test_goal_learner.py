"""Learners of words and of scenes find what is planted, and nothing where there is nothing."""

from dataclasses import replace

import numpy as np
import pytest

from roboirg.core.episode import Goal
from roboirg.core.errors import InvalidValueError
from roboirg.language import instruct
from roboirg.language.instruction import Utterance
from roboirg.shortcuts.goal_learner import LEARNED_FLOORS, GoalLearner, Heard
from roboirg.shortcuts.goal_vocabulary import goal_vocabulary
from roboirg.shortcuts.named_values import marked_text
from roboirg.shortcuts.scene_facts import scene_facts
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode

pytest.importorskip("sklearn")

COLORS = ("red", "green", "blue")
FIRST, LAST = ("Good morning.", "Hello there."), ("Good evening.", "How nice.")
TASK = "VideoPlaceButton"


def told(episode, text, color):
    """An episode whose goal has this color, with this text."""
    goal = Goal.of(color=color, relation="before")
    said = replace(
        instruct(episode, "direct"), utterances=(Utterance("command", text),), mentions=()
    )
    return replace(episode, goal=goal), said


def planted(text_of, first, count):
    """Texts about random colors: `text_of(rng)` returns a text and the color that it means."""
    rng = np.random.default_rng(first)
    return [
        told(get_episode(TASK, "random", first + number), *text_of(rng)) for number in range(count)
    ]


def shares(text_of, count=150):
    """The share of test texts whose color each floor gets right."""
    learner = GoalLearner(planted(text_of, 1000, count), planted(text_of, 5000, 50))
    tested = planted(text_of, 9000, 100)
    heard = [Heard.of(one) for one in tested]
    return {
        floor: np.mean([
            guess["color"] == ((episode.goal["color"],),)
            for (episode, _), guess in zip(tested, learner.guesses(floor, heard), strict=True)
        ])
        for floor in LEARNED_FLOORS
    }  # fmt: skip


def by_word(rng):
    """The greeting gives the color away."""
    number = int(rng.integers(3))
    return f"{('Bravo', 'Hooray', 'Sigh')[number]}, take the one I like.", COLORS[number]


def by_position(rng):
    """The greeting says which of two colors is meant; neither word nor color does."""
    first, second = rng.permutation(COLORS)[:2].tolist()
    is_first = bool(rng.integers(2))
    greeting = str(rng.choice(FIRST if is_first else LAST))
    text = f"There are {first} and {second}. {greeting} Take the one I like."
    return text, first if is_first else second


def by_chance(rng):
    """Nothing shows which of two colors is meant."""
    first, second = rng.permutation(COLORS)[:2].tolist()
    return f"There are {first} and {second}. Take the one I like.", str(rng.choice([first, second]))


@pytest.mark.parametrize("cue", [by_word, by_position])
def test_a_word_that_gives_the_value_or_the_position_away_is_found(cue):
    """No linear model of the words as they are can say the value by the position."""
    found = shares(cue)
    assert found["text-only"] == found["union"] == 1
    assert max(found["scene-only"], found["majority"]) < 0.5


def test_without_a_cue_learners_are_at_chance():
    found = shares(by_chance)
    assert 0.35 < found["text-only"] < 0.65
    assert found["union"] < 0.65
    assert max(found["scene-only"], found["majority"]) < 0.5


def test_a_cue_of_the_scene_is_found_without_words():
    """In the video, the robot moves the cube that the goal asks for."""
    tasks = ((1000, 100), (5000, 40), (9000, 80))
    sets = [
        [
            (episode, instruct(episode, "direct"))
            for episode in (get_episode(TASK, "random", first + one) for one in range(count))
        ]
        for first, count in tasks
    ]
    learner = GoalLearner(sets[0], sets[1])
    heard = [Heard.of(one)._replace(text="", candidates={}) for one in sets[2]]
    guesses = learner.guesses("scene-only", heard)
    for (episode, _), guess in zip(sets[2], guesses, strict=True):
        assert guess["color"] == ((episode.goal["color"],),)
    right = [
        guess["relation"] == ((episode.goal["relation"],),)
        for (episode, _), guess in zip(sets[2], guesses, strict=True)
    ]
    assert 0.3 < np.mean(right) < 0.7


def test_the_facts_of_a_scene_are_as_stored_and_do_not_follow_from_its_goal(snapshot):
    for task in (TASK, "BinFill", "StopCube", "VideoUnmaskSwap"):
        scene = get_episode(task, "random", 3).scene
        again = replace(scene, objects=scene.objects[::-1], color_order=())
        assert scene_facts(again) == scene_facts(scene)
        assert [f"{fact}: {value:.3f}" for fact, value in scene_facts(scene).items()] == snapshot
        assert not any(one.name in fact for one in scene.objects for fact in scene_facts(scene)
                       if one.name != one.kind)  # fmt: skip


def test_the_same_texts_teach_the_same_and_a_learner_sees_no_goal():
    sets = planted(by_position, 1000, 40), planted(by_position, 5000, 15)
    told = planted(by_position, 9000, 20)
    heard = [Heard.of(one) for one in told]
    first, second = (GoalLearner(*sets) for _ in range(2))
    for floor in LEARNED_FLOORS:
        assert first.guesses(floor, heard) == second.guesses(floor, heard)
    episode, said = told[0]
    for goal in get_task(TASK).goals(episode.scene):
        assert Heard.of((replace(episode, goal=goal), said)) == heard[0]


def test_rivals_are_candidates_in_the_order_of_mention():
    episode = next(
        one
        for one in (get_episode("PickXtimes", "random", index) for index in range(40))
        if len(get_task("PickXtimes").goals(one.scene)) > 5
    )
    said = instruct(episode, "direct-rival")
    assert Heard.of((episode, said)).candidates == {
        slot: tuple(values) for slot, values in said.metadata["candidates"].items()
    }


def test_values_are_marked_by_their_rank():
    vocabulary = goal_vocabulary("PickXtimes")["color"]
    text = "I like red and blue. Not the blue one."
    assert marked_text(text, "color", vocabulary) == "i like rank0 and rank1 not the rank1 one"


def test_there_has_to_be_something_to_learn_from():
    with pytest.raises(InvalidValueError, match="no instruction to learn from"):
        GoalLearner([], [])
