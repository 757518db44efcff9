"""What is said in the control runs ("arms") of an episode, and for which goal."""

from __future__ import annotations

from collections import Counter

import pytest
from language_variants import first_episodes

from roboirg.core.arms import parse_arm
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import expressible, instruct, instruct_with
from roboirg.language.arms import say_arm
from roboirg.shortcuts.command_chance import understood_goals
from roboirg.tasks import all_tasks, get_task, with_goal
from roboirg.tasks.other_goals import begins_with, draw_other_goal, other_goals
from roboirg.tasks.splits.splits import get_episode, make_episode

EPISODE = get_episode("PickXtimes", "test", 3)
"""Its goal is to put the blue cube on the target four times."""
each_task = pytest.mark.parametrize("task", all_tasks())
each_setting = pytest.mark.parametrize("setting", ["explicit", "contextual", "reasoning"])


@each_task
def test_other_goals_are_possible_in_the_scene_and_differ_from_the_episode_s_goal(task):
    """A control run asks for one of them instead of the goal of the episode."""
    for episode in first_episodes(task, "test", 50):
        possible = set(get_task(task).goals(episode.scene))
        assert set(other_goals(episode)) <= possible - {episode.goal}, episode.key


@each_task
def test_goals_for_the_wrong_goal_control_need_as_many_picks_as_the_right_goal(task):
    """Otherwise the control run would be longer or shorter, and so harder or easier."""
    for episode in first_episodes(task, "test", 50):
        for goal in other_goals(episode):
            other = with_goal(episode, goal)
            assert number_of_picks(other) == number_of_picks(episode), (episode.key, goal)


def number_of_picks(episode):
    """Return how many of the stages that solve an episode pick something up."""
    kinds = [stage.primitive.kind for stage in episode.stages]
    return kinds.count("pick_cube") + kinds.count("pick_container")


@each_task
def test_no_other_goal_is_reached_on_the_way_to_the_right_one_or_the_other_way_round(task):
    """*Red* is reached on the way to *red, then blue*: success at one would include the other."""
    for episode in first_episodes(task, "test", 50):
        for goal in other_goals(episode):
            stages = with_goal(episode, goal).stages
            assert not begins_with(stages, episode.stages), (episode.key, goal)
            assert not begins_with(episode.stages, stages), (episode.key, goal)


def test_the_wrong_goal_of_a_control_run_is_drawn_evenly_over_600_seeds():
    """A StopCube goal is one of four visits, and the control draws one of the other three.

    That makes 12 pairs of right and drawn visit: of 600 seeds, 50 each on average.
    """
    pairs: Counter[tuple[int, int]] = Counter()

    for seed in range(600):
        episode = make_episode("StopCube", seed, "easy")
        drawn = draw_other_goal(episode)
        assert drawn is not None
        pairs[episode.goal.number("visit"), drawn.number("visit")] += 1

    assert len(pairs) == 12
    assert min(pairs.values()) > 25
    assert max(pairs.values()) < 80


def test_the_wrong_goal_of_an_episode_is_the_same_in_every_draw():
    """Otherwise a run that is resumed would play another control."""
    episode = get_episode("StopCube", "test", 0)
    assert draw_other_goal(episode) == draw_other_goal(episode)


def test_a_scene_with_one_goal_has_no_command_for_a_wrong_one():
    """Each goal of a VideoRepick scene needs another number of picks: none replaces another."""
    episode = get_episode("VideoRepick", "test", 0)

    assert draw_other_goal(episode) is None
    with pytest.raises(InvalidValueError, match="no other goal"):
        say_arm(episode, InstructionOptions(), "other-goal")


def test_a_scene_with_one_goal_still_has_a_silent_control():
    """It needs no other goal, since it states none."""
    episode = get_episode("VideoRepick", "test", 0)

    said = say_arm(episode, InstructionOptions(), "silent")

    assert said.instruction.text == "Please do your task."


def controls_said(task, arm):
    """Yield three test episodes in every setting, with the usual text and what the arm says.

    Left out is what an arm cannot say, such as another goal where the scene has only one.
    """
    for index in (1, 2, 3):
        episode = get_episode(task, "test", index)
        for setting in expressible(episode):
            options = InstructionOptions(setting)
            try:
                said = say_arm(episode, options, arm)
            except InvalidValueError:
                continue
            yield episode, instruct_with(episode, options).text, said


@each_task
def test_the_words_of_a_control_run_mean_its_goal_and_no_other(task):
    """`understood_goals` computes the goals that the words leave open: it must be the one goal."""
    controls = [
        *controls_said(task, "other-goal"),
        *controls_said(task, "paraphrase-1"),
        *controls_said(task, "paraphrase-2"),
    ]

    assert len(controls) > 20
    for _, _, said in controls:
        understood = understood_goals(said.instruction, said.episode)
        assert understood == (said.episode.goal,), said.instruction.text


@each_task
def test_the_control_with_another_goal_keeps_the_scene_and_the_original_episode(task):
    """`said.episode` is what is played and judged, `said.original` the episode as it is
    published."""
    for episode, _, said in controls_said(task, "other-goal"):
        assert said.episode.goal != episode.goal
        assert said.episode.scene == episode.scene
        assert said.original == episode


@each_task
def test_paraphrases_keep_the_episode_and_use_new_words_of_the_same_pool(task):
    """The test split's words are the pool "test"; policies must not have seen them in training."""
    for arm in ("paraphrase-1", "paraphrase-2"):
        for episode, usual_text, said in controls_said(task, arm):
            assert (said.episode, said.original) == (episode, None)
            assert said.instruction.text != usual_text
            assert said.instruction.metadata["pool"] == "test"


@each_task
def test_two_paraphrases_of_an_episode_differ(task):
    """A paraphrase is another text for the same goal."""
    for episode, _, second in controls_said(task, "paraphrase-2"):
        options = InstructionOptions(second.instruction.setting)
        first = say_arm(episode, options, "paraphrase-1")
        assert first.instruction.text != second.instruction.text


@each_setting
@pytest.mark.parametrize("arm", ["told", "again"])
def test_the_controls_told_and_again_say_the_usual_instruction(arm, setting):
    """*Again* plays the same words with another seed of the policy."""
    said = say_arm(EPISODE, InstructionOptions(setting), arm)

    assert said.instruction == instruct(EPISODE, setting)


@pytest.mark.parametrize(
    ("arm", "text"), [("silent", "Please do your task."), ("silent-empty", "")]
)
@each_setting
def test_silent_controls_state_no_goal(setting, arm, text):
    """*Silent* says a sentence without a goal, *silent-empty* nothing at all."""
    said = say_arm(EPISODE, InstructionOptions(setting), arm)

    assert said.instruction.turns == (text,)


def test_a_scrambled_control_says_the_content_words_in_another_order():
    """*The*, *and*, *it*, *on* and *then* are function words and are left out."""
    assert instruct(EPISODE).text == (
        "Grab the blue cube and place it on the target four times, then press the button."
    )
    content = ["grab", "blue", "cube", "place", "target", "four", "times", "press", "button"]

    scrambled = say_arm(EPISODE, InstructionOptions(), "scrambled").instruction.text.split()

    assert sorted(scrambled) == sorted(content)
    assert scrambled != content


@each_setting
def test_a_scrambled_control_keeps_the_number_of_utterances_but_no_mention(setting):
    """A mention marks the words that stand for a value of the goal; order made them do so."""
    scrambled = say_arm(EPISODE, InstructionOptions(setting), "scrambled").instruction

    assert len(scrambled.utterances) == len(instruct(EPISODE, setting).utterances)
    assert scrambled.mentions == ()


def test_a_scrambled_control_has_the_same_order_in_every_call():
    """The order is drawn from the seed of the episode and the text."""
    options = InstructionOptions("contextual")
    assert say_arm(EPISODE, options, "scrambled") == say_arm(EPISODE, options, "scrambled")


@pytest.mark.parametrize(
    ("typed", "arms"),
    [
        ("other-goal", ("other-goal",)),
        ("paraphrase", ("paraphrase-1", "paraphrase-2")),
        ("paraphrase:3", ("paraphrase-1", "paraphrase-2", "paraphrase-3")),
        ("paraphrase-4", ("paraphrase-4",)),
    ],
)
def test_the_typed_name_of_a_control_stands_for_these_arms(typed, arms):
    """`paraphrase:3` stands for the first three paraphrases, `paraphrase-4` for the fourth."""
    assert parse_arm(typed) == arms


@pytest.mark.parametrize("typed", ["othergoal", "paraphrase-0", "paraphrase-21", "silent:2", ""])
def test_an_unknown_name_of_a_control_is_refused(typed):
    """Paraphrases are numbered from 1 to 20."""
    with pytest.raises(UnknownNameError, match="There is no arm"):
        parse_arm(typed)


@pytest.mark.parametrize("typed", ["paraphrase:0", "paraphrase:x", "paraphrase:21", "paraphrase:"])
def test_a_wrong_number_of_paraphrases_is_refused_with_a_right_one(typed):
    with pytest.raises(InvalidValueError, match="from 1 to 20, such as paraphrase:2"):
        parse_arm(typed)
