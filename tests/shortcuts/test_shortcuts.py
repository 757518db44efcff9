"""Shortcuts: rules and learned floors that see the words only."""

import sys
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from language_variants import PAIRS, TASKS, first_episodes
from plan_files import plan_file
from typer.testing import CliRunner

from roboirg.core.episode import values_in
from roboirg.core.errors import InvalidValueError, MissingDependencyError, UnknownNameError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import instruct, instruct_with
from roboirg.language.settings import get_setting
from roboirg.language.variants import expressible_options
from roboirg.main import app
from roboirg.shortcuts import SURFACE_RULES, draw_goal, goal_share, guess_goal
from roboirg.shortcuts.goal_learner import LEARNED_FLOORS
from roboirg.shortcuts.goal_vocabulary import goal_vocabulary
from roboirg.shortcuts.shortcut_scores import (
    CHANCE,
    counted_positions,
    counted_slots,
    hidden_slots,
    rule_scores,
    score_chance,
    score_guess,
    score_rule,
)
from roboirg.shortcuts.shortcut_tables import (
    Excess,
    ShortcutRow,
    excess_text,
    shortcut_rows,
    shortcut_table,
)
from roboirg.shortcuts.text_guess import slot_share
from roboirg.tasks import get_task, goals_of
from roboirg.tasks.splits.splits import get_episode

COLORS = ("blue", "green", "red")
NEITHER_RED_NOR_BLUE = (
    "My kitchen is painted red and blue. Take the cube of a color other than that pair"
)
CHOSEN = "Of the two, I would choose blue."
LIFT_NEITHER_THEN_THE_OTHER = (
    "Lift the container over the cube that is neither of those, then lift the container over the "
    "cube in the other of those colors."
)


def guessed_values(rule, text, task, slot):
    return guess_goal(rule, text, task)[slot]


GUESSES_BY_HAND = {
    ("PickXtimes", "color"): [
        ("first-mention", "I like the red cube. My door is green. Take it once.", ("red",)),
        ("last-mention", "I like the red cube. My door is green. Take it once.", ("green",)),
        ("elimination", "I like the red cube. My door is green. Take it once.", ("blue",)),
        ("elimination", "I like the red cube. Take it once.", ("blue", "green")),
        ("elimination", "Red, green and blue are nice. Take it once.", COLORS),
        ("surface", "I like the red cube. My door is green. Take it once.", ("red",)),
        ("surface", f"{NEITHER_RED_NOR_BLUE} once.", ("green",)),
        (
            "surface",
            "I like the red cube and the blue cube. I mean the latter. Take it.",
            ("blue",),
        ),
        ("surface", "Here are red and blue. Not the former. Take the cube I mean.", ("blue",)),
        ("surface", "Here are red and blue. Not the former but the latter. Take it.", ("red",)),
        ("first-mention", f"{NEITHER_RED_NOR_BLUE} once.", ("red",)),
        ("last-mention", f"{NEITHER_RED_NOR_BLUE} once.", ("blue",)),
        ("first-mention", "Have a look at the cube at the far left. Take it once.", COLORS),
        ("last-mention", "A green door. Take the red cube once.", ("red",)),
        ("elimination", "A green door. Take the red cube once.", ("red",)),
        ("surface", "Take the cube whose color is different from RED and blue once.", ("green",)),
        (
            "surface",
            "I like red and blue. Take the cube that is neither of those once.",
            ("green",),
        ),
    ],
    ("PickXtimes", "repeats"): [
        ("first-mention", "My number is four. The bus is two minutes late. Do it.", (4,)),
        ("last-mention", "My number is four. The bus is two minutes late. Do it.", (2,)),
        ("elimination", "My number is four. The bus is two minutes late. Do it.", (1, 3, 5)),
        ("surface", "My number is four. Take the red cube one time fewer than that.", (3,)),
        ("surface", "My number is two. Take the red cube two more times than that.", (4,)),
        ("surface", "My number is two. Take the red cube twice as many times as that.", (4,)),
        ("surface", "My number is six. Take it half as many times as that.", (3,)),
        ("surface", "Take the red cube half as many times as six.", (3,)),
        ("surface", "The bell rang six times. Take the red cube half as often as that.", (3,)),
        ("surface", "I knock twice. Take the red cube twice as often as that.", (4,)),
        ("surface", "I knock twice. Take the red cube just as often.", (2,)),
        ("surface", "I knock five times. Take the red cube two times fewer than that.", (3,)),
        ("first-mention", "My number is four. Take the red cube one time fewer than that.", (4,)),
        ("first-mention", f"{NEITHER_RED_NOR_BLUE} three times.", (3,)),
        ("first-mention", "I like those two. Take the one there twice.", (2,)),
        ("first-mention", "Take one of them as before.", (1, 2, 3, 4, 5)),
        ("last-mention", "My number is 4. Take it that many times.", (4,)),
    ],
    ("StopCube", "visit"): [
        ("first-mention", "I wait for the third visit. Press during that visit.", (3,)),
        ("surface", "I wait for the third visit. Press during the visit right before that.", (2,)),
        ("surface", "I wait for the third visit. Press two visits after that.", (5,)),
        ("surface", "I wait for the third visit. Press two visits earlier than that.", (1,)),
        ("surface", "I say four. Press on the visit whose number is one less than that.", (3,)),
        ("first-mention", "Press during its fifth visit.", (5,)),
        ("elimination", "Press during its fifth visit.", (5,)),
        ("elimination", "I wait for the third visit. Press during that visit.", (2, 4, 5)),
    ],
}


@pytest.mark.parametrize("slot", GUESSES_BY_HAND)
def test_each_surface_rule_guesses_the_value_that_its_reading_of_the_words_gives(slot):
    """A rule takes what is named first, last or not at all, or computes ("one fewer than that").

    Several values are a draw between them.
    """
    for rule, text, found in GUESSES_BY_HAND[slot]:
        assert (rule, text, guessed_values(rule, text, *slot)) == (rule, text, (found,))


RED_THEN_BLUE = (
    "I like the red cube and the blue cube. Lift the container over the former, then the container "
    "over the latter."
)
TWO_RED_AND_ONE_BLUE = (
    "She asked for two red cubes and one blue cube. Put the former and the latter into the bin."
)
TWO_AND_ONE = {"colors": (("red",), ("blue",)), "counts": ((2,), (1,))}
PAIR = f"My kitchen is painted red and blue. {CHOSEN} {LIFT_NEITHER_THEN_THE_OTHER}"
THE_OTHER_MOMENT_THAN = (
    "Of the two moments right before and right after the press, he prefers the one right {} it. "
    "Take the red cube and put it at the other of the two moments, not that one."
)


@pytest.mark.parametrize(
    ("rule", "text", "task", "found"),
    [
        ("first-mention", RED_THEN_BLUE, "VideoUnmask", {"colors": (("red",), ("blue",))}),
        ("elimination", RED_THEN_BLUE, "VideoUnmask", {"colors": (("green",), COLORS)}),
        ("surface", PAIR, "VideoUnmask", {"colors": (("green",), ("red",))}),
        ("last-mention", PAIR, "VideoUnmask", {"colors": (("blue",), ("blue",))}),
        (
            "first-mention",
            TWO_RED_AND_ONE_BLUE,
            "BinFill",
            TWO_AND_ONE,
        ),
        (
            "surface",
            "Look left and right. Lift the container at the former place, then at the latter.",
            "VideoUnmask",
            {"colors": (COLORS, COLORS)},
        ),
    ],
)
def test_each_surface_rule_guesses_the_values_of_a_goal_with_several_things(
    rule, text, task, found
):
    """For each thing the values that it draws from; all colors if the words give none."""
    assert guess_goal(rule, text, task) == found


@pytest.mark.parametrize(("named", "other"), [("before", "after"), ("after", "before")])
def test_each_surface_rule_guesses_which_of_two_moments_is_meant(named, other):
    """He prefers the one, so *the other of the two* is meant: one rule understands it."""
    for rule, moment in {
        "surface": other,
        "last-mention": named,
        "first-mention": "before",
    }.items():
        said = THE_OTHER_MOMENT_THAN.format(named)
        assert guessed_values(rule, said, "VideoPlaceButton", "relation") == ((moment,),), (
            rule,
            said,
        )


def test_a_guess_of_amounts_in_another_order_than_the_goals_is_right():
    episode = get_episode("BinFill", "test", 3)  # three red cubes and one green cube
    text = "She wants one green cube and three red cubes. Put the former and the latter into it."

    guess = guess_goal("first-mention", text, "BinFill")

    assert goal_share(guess, episode) == 1
    assert draw_goal(guess, goals_of(episode), np.random.default_rng(0)) == episode.goal


WORDS_OF_RANDOM_TEXTS = (
    "red green blue one two three first second once twice other different not before after half "
    "fewer more the of that those cube container neighbor place take and I like 2 seven"
)
TEXTS = st.lists(
    st.lists(st.sampled_from(WORDS_OF_RANDOM_TEXTS.split()), max_size=9).map(" ".join), max_size=4
).map(". ".join)


@settings(max_examples=40)
@given(text=TEXTS, rule=st.sampled_from(sorted(SURFACE_RULES)), task=st.sampled_from(TASKS))
def test_any_text_gives_a_guess_whose_values_exist_in_either_case(text, rule, task):
    """One that is drawn from it is a goal of the scene, or none."""
    guess = guess_goal(rule, text, task)
    vocabulary = goal_vocabulary(task)
    assert list(guess) == list(vocabulary)
    for slot, found in guess.items():
        assert all(found)
        assert 1 <= len(found) <= vocabulary[slot].longest

    episode = get_episode(task, "test", 0)
    assert 0 <= goal_share(guess, episode) <= 1

    drawn = draw_goal(guess, goals_of(episode), np.random.default_rng(1))
    assert drawn is None or drawn in get_task(task).goals(episode.scene)
    assert guess_goal(rule, text.upper().replace(" ", "  "), task) == guess


@settings(max_examples=25)
@given(named=st.lists(st.sampled_from(COLORS), min_size=1, max_size=6))
def test_rules_guess_the_first_the_last_or_an_unnamed_color(named):
    """If all colors are named, elimination draws from all."""
    text = " ".join(f"I like {color}." for color in named) + " Take it."
    assert guessed_values("first-mention", text, "PickXtimes", "color") == ((named[0],),)
    assert guessed_values("last-mention", text, "PickXtimes", "color") == ((named[-1],),)

    rest = tuple(color for color in COLORS if color not in named)
    assert guessed_values("elimination", text, "PickXtimes", "color") == (rest or COLORS,)


def test_a_misspelled_rule_is_refused_with_the_right_name():
    with pytest.raises(UnknownNameError, match="first-mention"):
        guess_goal("first-mentoin", "Take it.", "PickXtimes")


def test_every_goal_of_the_test_split_can_be_guessed():
    """Its values are in the vocabulary from which rules guess, and are not more than it allows."""
    for task in TASKS:
        vocabulary = goal_vocabulary(task)
        for episode in first_episodes(task, "test", 50):
            for slot, content in episode.goal.slots:
                assert set(values_in(content)) <= set(vocabulary[slot].values)
                assert len(values_in(content)) <= vocabulary[slot].longest


@pytest.mark.parametrize(("task", "setting"), PAIRS)
def test_a_rule_is_scored_on_what_the_words_hide_and_is_right_if_they_hide_nothing(task, setting):
    """A slot is a part of the goal, as its color. The *resolved* form names everything."""
    for episode in first_episodes(task, "test", 2):
        for options in expressible_options(episode):
            if options.setting != setting:
                continue
            told = episode, instruct_with(episode, options)
            for score in rule_scores(told).values():
                assert tuple(score.slots) == counted_slots(told)
                assert all(0 <= share <= 1 for share in (*score.slots.values(), score.goal))
            if not get_setting(setting, get_task(task)).implicit:
                assert all(score_rule(rule, told).goal == 1 for rule in SURFACE_RULES)
            elif setting in ("direct", "contextual") and options.form == "resolved":
                assert score_rule("elimination", told).goal == 1


def test_in_a_known_episode_the_first_mention_is_right_and_elimination_wrong():
    episode = get_episode("VideoPlaceButton", "test", 0)
    told = episode, instruct(episode, "direct")

    hidden = hidden_slots(told)

    assert score_rule("first-mention", told).slots == dict.fromkeys(hidden, 1)
    assert score_rule("elimination", told).slots == dict.fromkeys(hidden, 0)
    assert score_chance((episode, instruct(episode))) == ({}, 1)


@pytest.mark.parametrize(
    ("guessed", "share"),
    [
        ((("red",),), Fraction(1, 3)),
        ((("red",), ("red",), ("red",)), Fraction(2, 3)),
        ((COLORS, ("green", "blue")), Fraction(5, 18)),
        ((("red",), COLORS, ("blue",), ("green",)), Fraction(4, 9)),
    ],
)
def test_a_guess_is_scored_by_the_share_of_the_goals_three_values_that_it_gets_right(
    guessed, share
):
    """The goal is red, green, red. A draw from n colors counts 1/n: (1/3 + 1/2) / 3 = 5/18."""
    assert slot_share({"colors": guessed}, "colors", ("red", "green", "red"), range(3)) == share


def test_of_two_containers_one_of_which_is_named_only_the_other_is_scored():
    """It is described by its place: a draw from three colors is right in 1/3, chance in 1/2."""
    found = set()
    for index in range(50):
        episode = get_episode("ButtonUnmaskSwap", "test", index)
        told = episode, instruct(episode, "spatial")
        if len(episode.goal["colors"]) == 2:
            (at,) = counted_positions(told)["colors"]
            found.add(at)
            named = {1 - at: (episode.goal["colors"][1 - at],)}
            guess = {"colors": [named.get(place, ()) or COLORS for place in (0, 1)]}
            assert score_guess(guess, told).slots == {"colors": Fraction(1, 3)}
            assert score_chance(told).slots == {"colors": Fraction(1, 2)}
    assert found == {0, 1}


def test_only_the_parts_of_a_goal_that_a_text_touches_are_scored():
    """*touched* is in the metadata of an instruction; an explicit one hides nothing."""
    episode = get_episode("VideoPlaceButton", "test", 0)
    said = instruct(episode, "direct")

    touched = replace(said, metadata={**said.metadata, "touched": ["relation"]})

    assert counted_slots((episode, said)) == hidden_slots((episode, said))
    assert counted_slots((episode, touched)) == ("relation",)
    assert set(score_chance((episode, touched)).slots) == {"relation"}
    assert counted_slots((episode, instruct(episode))) == ()


def test_words_for_a_place_give_a_color_away_only_if_they_name_another_cube():
    """*Left of the red one*: elimination draws from two colors, other rules are wrong.

    Without a color every rule draws from three.
    """
    named = 0
    for episode in first_episodes("PickXtimes", "test", 50):
        told = episode, instruct(episode, "spatial")
        other = any(color in told[1].text for color in COLORS)
        named += other
        for rule in SURFACE_RULES:
            share = Fraction(1, 2) if rule == "elimination" else 0
            expected = {"color": share if other else Fraction(1, 3)}
            assert score_rule(rule, told).slots == expected
    assert 0 < named < 25


def test_rows_by_pattern_task_or_slot_add_up_to_the_row_of_all_instructions():
    """50 episodes of BinFill in one setting."""
    rows = {
        by: shortcut_rows(("BinFill",), ("test",), ("reasoning",), InstructionOptions(), by=by)
        for by in (None, "pattern", "task", "slot")
    }
    assert {row.group for row in rows["pattern"]} == {
        ("reasoning", pattern)
        for pattern in ("color exclusion", "number deduction", "contextual logic")
    }
    assert sum(row.count for row in rows["pattern"]) == 50
    assert [(row.group, row.count) for row in rows["task"]] == [(("reasoning", "BinFill"), 50)]
    assert {row.group[1] for row in rows["slot"]} == {"BinFill colors", "BinFill counts"}

    (whole,) = rows[None]
    by_slot = {row.group: row.count * row.shares[CHANCE].slots for row in rows["slot"]}
    hidden = sum(row.count for row in rows["slot"])
    assert sum(by_slot.values()) / hidden == pytest.approx(whole.shares[CHANCE].slots)


def shortcuts_command(*words):
    return CliRunner().invoke(app, ["language", "shortcuts", *words])


@pytest.mark.parametrize(
    "words",
    [
        ("--settings", "direct,reasoning"),
        ("--settings", "reasoning", "--by", "pattern"),
        ("--settings", "spatial,direct", "--tasks", "BinFill", "--by", "slot"),
        ("--settings", "direct", "--split", "none", "--seeds", "3"),
    ],
    ids=" ".join,
)
def test_the_command_prints_a_row_for_each_setting_pattern_or_slot(words, snapshot):
    assert shortcuts_command("--tasks", "StopCube", *words).output == snapshot


@pytest.mark.parametrize(
    ("value", "text"), [(0.25, "+25.0 (+21.1 to +28.9)"), (-0.02, "−2.0 (−5.9 to +1.9)")]
)
def test_how_far_a_shortcut_exceeds_chance_is_printed_with_sign_and_interval(value, text):
    """The standard error is 0.02: 1.96 times 2 points to both sides."""
    assert excess_text(Excess(value, 0.02), 1) == text


def test_the_caption_of_a_table_names_the_adjustment_of_its_intervals():
    rows = [ShortcutRow((name,), 9, {}, Excess(0.1, 0.02)) for name in ("direct", "spatial")]
    caption = str(shortcut_table(rows, "Shortcuts").caption)
    assert caption.endswith("with 95 % intervals, Bonferroni-adjusted for 2 rows.")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--by", "colour"), "colour"),
        (("--plan", plan_file(forms="implied")), "implied"),
        (("--split", "tset"), "tset"),
        (("--tasks", "StopCube", "--settings", "spatial"), "no spatial setting in StopCube"),
        (("--split", "none"), "nothing to score"),
        (("--seeds", "-1"), "seeds is -1; it must be a whole number from 0"),
        (("--learned", "--split", "val"), "choose --split test"),
        (("--plan", plan_file(distractors=0)), "distractors"),
    ],
)
def test_a_wrong_option_of_the_shortcuts_command_is_one_sentence(words, sentence):
    outcome = shortcuts_command("--tasks", "StopCube", *words)
    assert outcome.exit_code
    assert isinstance(outcome.exception, (InvalidValueError, UnknownNameError))
    assert sentence in str(outcome.exception)


def test_without_scikit_learn_the_learned_floors_are_refused_with_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "sklearn.neural_network", None)
    outcome = shortcuts_command("--tasks", "StopCube", "--learned")

    assert isinstance(outcome.exception, MissingDependencyError)
    assert "[report]'" in str(outcome.exception)


def test_rates_of_learners_are_columns_with_an_interval_that_widens_with_the_rows():
    """In StopCube the words alone give the visit away in 9 of 10; 100 rows adjust it more than 1.

    Such a rate is called a floor: it takes no understanding of the scene.
    """
    pytest.importorskip("sklearn")
    (row,) = shortcut_rows(("StopCube",), ("test",), ("direct",), InstructionOptions(), learning=0)
    assert list(row.shares) == ["chance", *SURFACE_RULES, *LEARNED_FLOORS]
    assert row.shares["text-only"].goals > 0.9

    low, high = row.excess.interval(1)
    assert 0.5 < low < row.excess.value < high < 1

    wide = row.excess.interval(100)
    assert wide[0] < low < high < wide[1]
