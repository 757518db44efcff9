"""What is said in the control arms of a scene, and for which goal."""

from __future__ import annotations

from collections import Counter

import pytest

from roboirg.core.arms import ARMS, PARAPHRASES, parse_arm
from roboirg.core.episode import Episode
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import expressible, instruct_with
from roboirg.language.arms import FUNCTION_WORDS, say_arm
from roboirg.shortcuts.command_chance import understood_goals
from roboirg.tasks import all_tasks, get_task, with_goal
from roboirg.tasks.other_goals import begins_with, draw_other_goal, other_goals
from roboirg.tasks.splits.splits import get_episode, make_episode

TASKS = tuple(all_tasks())


def options_of_each_setting_of(episode: Episode) -> list[InstructionOptions]:
    return [InstructionOptions(name) for name in expressible(episode)]


@pytest.mark.parametrize("task", TASKS)
def test_goals_for_the_wrong_goal_control_need_as_many_picks_as_the_right_goal(task):
    """A control run commands another goal of the same scene; `other_goals` lists the choices.

    If one plan began with the other, success at one goal would come along with the other.
    """
    for index in range(50):
        episode = get_episode(task, "test", index)
        found = other_goals(episode)
        assert episode.goal not in found
        assert set(found) <= set(get_task(task).goals(episode.scene))
        for goal in found:
            stages = with_goal(episode, goal).stages
            assert number_of_picks(stages) == number_of_picks(episode.stages)
            assert not begins_with(stages, episode.stages)
            assert not begins_with(episode.stages, stages)


def number_of_picks(stages):
    """Return how many stages pick something up."""
    return sum(stage.primitive.kind in {"pick_cube", "pick_container"} for stage in stages)


def test_the_wrong_goal_of_a_control_run_is_drawn_evenly_over_600_seeds():
    """A StopCube goal names one of four visits; the control commands one of the other three."""
    counts: Counter[tuple[int, int]] = Counter()
    for seed in range(600):
        episode = make_episode("StopCube", seed, "easy")
        drawn = draw_other_goal(episode)
        assert drawn == draw_other_goal(episode)
        assert drawn is not None
        counts[episode.goal.number("visit"), drawn.number("visit")] += 1

    # 600 seeds: 50 of each pair on average.
    assert len(counts) == 12  # each of four visits, with each of the other three
    assert min(counts.values()) > 25
    assert max(counts.values()) < 80


def test_a_scene_with_one_goal_has_no_command_for_a_wrong_one():
    """All goals of a VideoRepick scene need different numbers of picks, so none can replace
    another. A command that states no goal (the control "silent") is still possible."""
    episode = get_episode("VideoRepick", "test", 0)
    assert draw_other_goal(episode) is None
    with pytest.raises(InvalidValueError, match="no other goal"):
        say_arm(episode, InstructionOptions(), "other-goal")

    say_arm(episode, InstructionOptions(), "silent")


@pytest.mark.parametrize("task", TASKS)
def test_the_words_of_a_control_run_mean_its_goal_and_no_other(task):
    """Controls ("arms") are another goal of the same scene, or the same goal in other words.

    `understood_goals` computes which goals the words leave; a wrong text would leave another.
    """
    stated = 0
    for index in (1, 2, 3):
        episode = get_episode(task, "test", index)
        for options in options_of_each_setting_of(episode):
            told = instruct_with(episode, options).text
            texts = [told]
            for arm in ("other-goal", "paraphrase-1", "paraphrase-2"):
                try:
                    said = say_arm(episode, options, arm)
                except InvalidValueError:
                    continue
                stated += 1
                assert understood_goals(said.instruction, episode) == (said.episode.goal,)
                if arm == "other-goal":
                    assert said.original == episode
                    assert said.episode.goal != episode.goal
                    assert said.episode.scene == episode.scene
                else:
                    assert (said.episode, said.original) == (episode, None)
                    texts.append(said.instruction.text)
                assert said.instruction.metadata["pool"] == "test"
            assert len(set(texts)) == len(texts)
    assert stated > 20


@pytest.mark.parametrize("setting", ["explicit", "contextual", "reasoning"])
def test_silent_controls_state_no_goal_and_scrambled_ones_shuffle_the_content_words(setting):
    """An arm is what is said in a control run of an episode: *told* is the usual command.

    *Scrambled* keeps the content words in another order, without articles and the like.
    """
    episode = get_episode("PickXtimes", "test", 3)
    options = InstructionOptions(setting)
    told = instruct_with(episode, options)
    for arm in ("told", "again"):
        assert say_arm(episode, options, arm).instruction == told
    assert say_arm(episode, options, "silent").instruction.turns == ("Please do your task.",)
    assert say_arm(episode, options, "silent-empty").instruction.text == ""

    scrambled = say_arm(episode, options, "scrambled").instruction
    assert scrambled == say_arm(episode, options, "scrambled").instruction
    assert len(scrambled.utterances) == len(told.utterances)

    words = told.text.lower().replace(",", "").replace(".", "").split()
    content = [word for word in words if word not in FUNCTION_WORDS.split()]
    assert Counter(scrambled.text.split()) == Counter(content)
    assert scrambled.text.split() != content
    assert not scrambled.mentions


def test_names_of_control_runs_are_parsed_and_wrong_names_are_refused():
    """`paraphrase:3` stands for the first three paraphrases, `paraphrase` for all of them."""
    assert parse_arm("other-goal") == ("other-goal",)
    assert parse_arm("paraphrase:3") == ("paraphrase-1", "paraphrase-2", "paraphrase-3")
    assert len(parse_arm("paraphrase")) == PARAPHRASES
    assert parse_arm("paraphrase-4") == ("paraphrase-4",)
    assert all(parse_arm(name) for name in ARMS)
    for wrong in ("othergoal", "paraphrase-0", "paraphrase-21", "silent:2", ""):
        with pytest.raises(UnknownNameError, match="arm"):
            parse_arm(wrong)
    for wrong in ("paraphrase:0", "paraphrase:x", "paraphrase:21", "paraphrase:"):
        with pytest.raises(InvalidValueError, match="paraphrase:2"):
            parse_arm(wrong)
