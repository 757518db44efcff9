"""Shortcuts: how far simple rules on the words get without understanding them.

A rule guesses the value that was named first (first-mention), last (last-mention) or not at all
(elimination), or it understands single phrases such as *one fewer than that* (surface). A guess is
a tuple of values, equally likely, for each place of each slot of the goal.
"""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from language_variants import TASKS, expressible_options, first_episodes
from plan_files import plan_file
from typer.testing import CliRunner

from roboirg.core.episode import values_in
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import instruct, instruct_with
from roboirg.language.settings import settings_of
from roboirg.main import app
from roboirg.shortcuts.goal_learner import LEARNED_FLOORS
from roboirg.shortcuts.goal_vocabulary import goal_vocabulary
from roboirg.shortcuts.shortcut_scores import (
    counted_positions,
    counted_slots,
    rule_scores,
    score_chance,
    score_guess,
    score_rule,
)
from roboirg.shortcuts.shortcut_shares import Excess, ShortcutRow
from roboirg.shortcuts.shortcut_tables import excess_text, shortcut_rows, shortcut_table
from roboirg.shortcuts.surface_rules import SURFACE_RULES
from roboirg.shortcuts.text_guess import draw_goal, goal_share, guess_goal, slot_share
from roboirg.tasks import get_task, goals_of
from roboirg.tasks.splits.splits import get_episode

COLORS = ("blue", "green", "red")
each_task = pytest.mark.parametrize("task", TASKS)


@pytest.mark.parametrize(
    ("rule", "text", "colors"),
    [
        ("first-mention", "I like the red cube. My door is green. Take it once.", ("red",)),
        ("last-mention", "I like the red cube. My door is green. Take it once.", ("green",)),
        ("elimination", "I like the red cube. My door is green. Take it once.", ("blue",)),
        ("surface", "I like the red cube. My door is green. Take it once.", ("red",)),
        ("elimination", "I like the red cube. Take it once.", ("blue", "green")),
        ("elimination", "Red, green and blue are nice. Take it once.", ("blue", "green", "red")),
        ("last-mention", "Red and blue. A cube of a color other than that pair once.", ("blue",)),
        ("surface", "Red and blue. Take the cube of a color other than that pair.", ("green",)),
        ("surface", "I like the red cube and the blue cube. I mean the latter.", ("blue",)),
        ("surface", "Here are red and blue. Not the former. Take the cube I mean.", ("blue",)),
        ("surface", "Here are red and blue. Not the former but the latter. Take it.", ("red",)),
        ("first-mention", "Look at the cube at the far left. Take it.", ("blue", "green", "red")),
        ("elimination", "A green door. Take the red cube once.", ("red",)),
    ],
)
def test_each_surface_rule_guesses_the_color_that_its_reading_of_the_words_gives(
    rule, text, colors
):
    """Several colors are a draw between them. What the command states is no guess."""
    assert guess_goal(rule, text, "PickXtimes")["color"] == (colors,)


@pytest.mark.parametrize(
    ("rule", "text", "numbers"),
    [
        ("first-mention", "My number is four. The bus is two minutes late. Do it.", (4,)),
        ("last-mention", "My number is four. The bus is two minutes late. Do it.", (2,)),
        ("elimination", "My number is four. The bus is two minutes late. Do it.", (1, 3, 5)),
        ("surface", "My number is four. Take the red cube one time fewer than that.", (3,)),
        ("surface", "My number is two. Take the red cube two more times than that.", (4,)),
        ("surface", "My number is two. Take the red cube twice as many times as that.", (4,)),
        ("surface", "Take the red cube half as many times as six.", (3,)),
        ("surface", "The bell rang six times. Take the red cube half as often as that.", (3,)),
        ("surface", "I knock twice. Take the red cube just as often.", (2,)),
        ("first-mention", "My number is four. Take the red cube one time fewer than that.", (4,)),
        ("first-mention", "I like those two. Take the one there twice.", (2,)),
        ("first-mention", "Take one of them as before.", (1, 2, 3, 4, 5)),
        ("last-mention", "My number is 4. Take it that many times.", (4,)),
    ],
)
def test_each_surface_rule_guesses_the_number_that_its_reading_of_the_words_gives(
    rule, text, numbers
):
    """Numbers from one to five are possible; several are a draw between them.

    A rule sees words, not meaning: "first-mention" takes the first number, "last-mention" the
    last, "elimination" those that were not said, and "surface" computes (*one time fewer than*
    four is 3).
    """
    assert guess_goal(rule, text, "PickXtimes")["repeats"] == (numbers,)


@pytest.mark.parametrize(
    ("rule", "text", "visits"),
    [
        ("first-mention", "I wait for the third visit. Press during that visit.", (3,)),
        ("elimination", "I wait for the third visit. Press during that visit.", (2, 4, 5)),
        ("surface", "I wait for the third visit. Press during the visit right before that.", (2,)),
        ("surface", "I wait for the third visit. Press two visits after that.", (5,)),
        ("surface", "I say four. Press on the visit whose number is one less than that.", (3,)),
        ("elimination", "Press during its fifth visit.", (5,)),
    ],
)
def test_each_surface_rule_guesses_the_visit_that_its_reading_of_the_words_gives(
    rule, text, visits
):
    """In StopCube, at which visit of the cube the button is to be pressed: the second to fifth."""
    assert guess_goal(rule, text, "StopCube")["visit"] == (visits,)


@pytest.mark.parametrize(
    ("rule", "first", "second"),
    [
        ("first-mention", ("red",), ("blue",)),
        ("elimination", ("green",), ("blue", "green", "red")),
    ],
)
def test_rules_guess_the_colors_of_two_containers_by_the_former_and_the_latter(rule, first, second):
    """Elimination has one color left for the first container, and draws from all for the second."""
    text = "Red and blue. Lift the container over the former, then the container over the latter."
    assert guess_goal(rule, text, "VideoUnmask") == {"colors": (first, second)}


@pytest.mark.parametrize(
    ("rule", "first", "second"),
    [("surface", ("green",), ("red",)), ("last-mention", ("blue",), ("blue",))],
)
def test_the_rule_surface_understands_neither_of_those_and_the_other(rule, first, second):
    """Red and blue are named, so green is neither; blue was chosen, so the other is red."""
    text = (
        "My kitchen is painted red and blue. Of the two, I would choose blue. Lift the container "
        "over the cube that is neither of those, then lift the container over the cube in the "
        "other of those colors."
    )
    assert guess_goal(rule, text, "VideoUnmask") == {"colors": (first, second)}


def test_rules_draw_from_all_colors_if_the_words_name_none():
    """Two containers are to be lifted; for each, all three colors are as likely."""
    text = "Look left and right. Lift the container at the former place, then at the latter."
    assert guess_goal("surface", text, "VideoUnmask") == {"colors": (COLORS, COLORS)}


def test_rules_guess_amounts_in_the_order_of_mention():
    """A guess has one place for each color, and its count at the same place."""
    text = "She wants two red cubes and one blue cube. Put the former and the latter into the bin."
    assert guess_goal("first-mention", text, "BinFill") == {
        "colors": (("red",), ("blue",)),
        "counts": ((2,), (1,)),
    }


@pytest.mark.parametrize(
    ("rule", "named", "moment"),
    [
        ("surface", "before", "after"),
        ("surface", "after", "before"),
        ("last-mention", "before", "before"),
        ("last-mention", "after", "after"),
    ],
)
def test_each_surface_rule_guesses_which_of_two_moments_is_meant(rule, named, moment):
    """He prefers the one, so *the other of the two* is meant: only "surface" understands it."""
    text = (
        "Of the two moments right before and right after the press, he prefers the one right "
        f"{named} it. Take the red cube and put it at the other of the two moments, not that one."
    )

    assert guess_goal(rule, text, "VideoPlaceButton")["relation"] == ((moment,),)


def test_a_guess_of_amounts_in_another_order_than_the_goals_is_right():
    """The goal is three red cubes and one green cube."""
    episode = get_episode("BinFill", "test", 3)
    text = "She wants one green cube and three red cubes. Put the former and the latter into it."

    guess = guess_goal("first-mention", text, "BinFill")

    assert goal_share(guess, episode) == 1
    assert draw_goal(guess, goals_of(episode), np.random.default_rng(0)) == episode.goal


WORDS_OF_TEXTS = """
red green blue one two three first second once twice other different not before after half fewer
more the of that those cube container neighbor place take and I like 2 seven
"""
sentences = st.lists(st.sampled_from(WORDS_OF_TEXTS.split()), max_size=9).map(" ".join)
texts = st.lists(sentences, max_size=4).map(". ".join)
any_rule = st.sampled_from(sorted(SURFACE_RULES))
any_task = st.sampled_from(TASKS)


@settings(max_examples=40)
@given(text=texts, rule=any_rule, task=any_task)
def test_any_text_gives_a_guess_with_a_value_for_each_place_of_each_slot(text, rule, task):
    """`vocabulary` has for each slot of the task's goals how many values it may have."""
    vocabulary = goal_vocabulary(task)

    guess = guess_goal(rule, text, task)

    assert list(guess) == list(vocabulary)
    for slot, places in guess.items():
        assert all(places)
        assert 1 <= len(places) <= vocabulary[slot].longest


@settings(max_examples=40)
@given(text=texts, rule=any_rule, task=any_task)
def test_what_is_drawn_from_any_guess_is_a_goal_of_the_scene_or_none(text, rule, task):
    """None if no goal of the scene has the guessed values."""
    episode = get_episode(task, "test", 0)
    guess = guess_goal(rule, text, task)

    drawn = draw_goal(guess, goals_of(episode), np.random.default_rng(1))

    assert drawn is None or drawn in get_task(task).goals(episode.scene)
    assert 0 <= goal_share(guess, episode) <= 1


@settings(max_examples=40)
@given(text=texts, rule=any_rule, task=any_task)
def test_upper_case_and_doubled_spaces_do_not_change_a_guess(text, rule, task):
    """Only words count."""
    shouted = text.upper().replace(" ", "  ")
    assert guess_goal(rule, shouted, task) == guess_goal(rule, text, task)


def test_a_misspelled_rule_is_refused_with_the_right_name():
    with pytest.raises(UnknownNameError, match="first-mention"):
        guess_goal("first-mentoin", "Take it.", "PickXtimes")


@each_task
def test_every_goal_of_the_test_split_can_be_guessed(task):
    """Its values are in the vocabulary from which rules guess, and are not more than it allows."""
    vocabulary = goal_vocabulary(task)
    for episode in first_episodes(task, "test", 50):
        for slot, content in episode.goal.slots:
            values = values_in(content)
            assert set(values) <= set(vocabulary[slot].values), episode.key
            assert len(values) <= vocabulary[slot].longest, episode.key


def instructions_of(task, setting):
    """Yield (episode, instruction) of two test episodes in a setting, with all its options."""
    for episode in first_episodes(task, "test", 2):
        for options in expressible_options(episode):
            if options.setting == setting:
                yield episode, instruct_with(episode, options)


@each_task
def test_a_rule_is_scored_on_the_slots_of_the_goal_that_the_words_hide(task):
    """A slot is a part of the goal, such as its color; `counted_slots` has those whose values an
    instruction does not state. For two episodes in every setting and form, each rule gets a share
    of right values, 0 to 1, for just these slots, and one for the goal as a whole."""
    for setting in settings_of(get_task(task)):
        for told in instructions_of(task, setting):
            _, said = told
            for score in rule_scores(told).values():
                assert tuple(score.slots) == counted_slots(told), said.text
                assert all(0 <= share <= 1 for share in (score.goal, *score.slots.values()))


@each_task
def test_every_rule_is_right_if_the_words_hide_nothing(task):
    """The explicit command states every value, and rules take what is stated."""
    for told in instructions_of(task, "explicit"):
        for rule in SURFACE_RULES:
            assert score_rule(rule, told).goal == 1, told[1].text


@pytest.mark.parametrize("setting", ["direct", "contextual"])
@each_task
def test_elimination_is_right_if_the_command_names_every_value(task, setting):
    """As it does in the form *resolved*."""
    for episode, said in instructions_of(task, setting):
        if said.form == "resolved":
            assert score_rule("elimination", (episode, said)).goal == 1, said.text


def test_an_explicit_instruction_leaves_nothing_to_chance():
    """No slot is scored, and a guess of the goal is right with probability 1."""
    episode = get_episode("VideoPlaceButton", "test", 0)
    assert score_chance((episode, instruct(episode, "explicit"))) == ({}, 1)


@pytest.mark.parametrize(
    ("guessed", "share"),
    [
        ((("red",),), Fraction(1, 3)),
        ((("red",), ("red",), ("red",)), Fraction(2, 3)),
        ((COLORS, ("green", "blue")), Fraction(5, 18)),
        ((("red",), COLORS, ("blue",), ("green",)), Fraction(4, 9)),
    ],
    ids=["red", "red, red, red", "any, green or blue", "red, any, blue, green"],
)
def test_a_guess_is_scored_by_the_share_of_the_goals_three_values_that_it_gets_right(
    guessed, share
):
    """The goal is red, green, red. A draw from n colors counts 1/n: (1/3 + 1/2) / 3 = 5/18."""
    assert slot_share({"colors": guessed}, "colors", ("red", "green", "red"), range(3)) == share


def episodes_that_hide(hidden):
    """Return episodes with two colors in their goal, and spatial words that name all but one.

    The hidden one is the first (0) or the second (1) of the goal; its container is described by its
    place.
    """
    found = []
    for episode in first_episodes("ButtonUnmaskSwap", "test", 50):
        told = episode, instruct(episode, "spatial")
        if len(episode.goal["colors"]) == 2 and counted_positions(told)["colors"] == [hidden]:
            found.append(told)
    return found


@pytest.mark.parametrize("hidden", [0, 1], ids=["first", "second"])
def test_of_two_containers_one_of_which_is_named_only_the_other_is_scored(hidden):
    """The goal has two of three colors. A guess has the named one right, and for the hidden one all
    three colors, of which one is right: it scores 1/3, as the named one does not count. Chance is
    1/2, as the two colors of a goal differ, so two are left."""
    instructions = episodes_that_hide(hidden)
    assert instructions

    for told in instructions:
        episode, _ = told
        guess = [(color,) for color in episode.goal["colors"]]
        guess[hidden] = ("blue", "green", "red")

        assert score_guess({"colors": guess}, told).slots == {"colors": Fraction(1, 3)}
        assert score_chance(told).slots == {"colors": Fraction(1, 2)}


def test_only_the_parts_of_a_goal_that_a_text_touches_are_scored():
    """*Touched* is in the metadata of an instruction; without it, all that is hidden counts."""
    episode = get_episode("VideoPlaceButton", "test", 0)
    said = instruct(episode, "direct")
    touched = replace(said, metadata={**said.metadata, "touched": ["color"]})

    assert counted_slots((episode, said)) == ("relation",)
    assert counted_slots((episode, touched)) == ("color",)
    assert set(score_chance((episode, touched)).slots) == {"color"}


def spatial_instructions(names_a_color):
    """Return (episode, spatial instruction) of PickXtimes that name a color, or that name none."""
    found = []
    for episode in first_episodes("PickXtimes", "test", 50):
        said = instruct(episode, "spatial")
        if names_a_color == any(color in said.text for color in COLORS):
            found.append((episode, said))
    return found


@pytest.mark.parametrize(
    ("rule", "share"),
    [
        ("first-mention", 0),
        ("last-mention", 0),
        ("surface", 0),
        ("elimination", Fraction(1, 2)),
    ],
)
def test_words_for_a_place_that_name_another_cube_rule_its_color_out(rule, share):
    """Of three colors the goal is one; the words describe its cube by another one, such as *left of
    the red one*. Rules that guess what is named guess red, which is wrong; elimination guesses what
    is not named, one of two colors, and is right half of the time."""
    instructions = spatial_instructions(names_a_color=True)
    assert instructions

    for told in instructions:
        assert score_rule(rule, told).slots == {"color": share}


@pytest.mark.parametrize("rule", SURFACE_RULES)
def test_words_for_a_place_without_a_color_leave_three_colors(rule):
    """*The cube on the left*: a rule that sees no scene draws from all three."""
    for told in spatial_instructions(names_a_color=False):
        assert score_rule(rule, told).slots == {"color": Fraction(1, 3)}


def rows_by(group):
    """Return the rows of a table of shortcuts: 50 BinFill episodes in the setting *reasoning*."""
    options = InstructionOptions()
    return shortcut_rows(("BinFill",), ("test",), ("reasoning",), options, by=group)


def test_rows_by_task_have_the_task_in_their_name():
    """50 test episodes of BinFill in the setting *reasoning* make one row."""
    (row,) = rows_by("task")
    assert (row.group, row.count) == (("reasoning", "BinFill"), 50)


def test_rows_by_slot_add_up_to_the_row_of_all_instructions():
    """A goal of BinFill has two slots, colors and counts, and an instruction may hide one or both.
    In a table by slot each has a row, with the number of instructions that hide it and the share
    that chance gets right. Their mean, weighted by that number, is the share of the table's only
    row if it is not divided."""
    (whole,) = rows_by(None)
    colors, counts = sorted(rows_by("slot"), key=lambda row: row.group)

    right = colors.count * colors.shares["chance"].slots
    right += counts.count * counts.shares["chance"].slots

    assert colors.group == ("reasoning", "BinFill colors")
    assert counts.group == ("reasoning", "BinFill counts")
    share = right / (colors.count + counts.count)
    assert share == pytest.approx(whole.shares["chance"].slots)


def shortcuts_command(*words):
    """Return the outcome of `roboirg language shortcuts` with these options."""
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
    """The whole print is compared with a stored one."""
    assert shortcuts_command("--tasks", "StopCube", *words).output == snapshot


@pytest.mark.parametrize(
    ("value", "text"), [(0.25, "+25.0 (+21.1 to +28.9)"), (-0.02, "−2.0 (−5.9 to +1.9)")]
)
def test_how_far_a_shortcut_exceeds_chance_is_printed_with_sign_and_interval(value, text):
    """The standard error is 0.02: 1.96 times 2 points to both sides."""
    assert excess_text(Excess(value, 0.02), 1) == text


def table_of_rows(**texts):
    """Return a table of shortcuts with rows of so many texts, each 0.1 above chance."""
    excess = Excess(0.1, 0.02)
    rows = [ShortcutRow((name,), count, {}, excess) for name, count in texts.items()]
    return shortcut_table(rows, "Shortcuts")


def test_the_caption_of_a_table_names_the_adjustment_of_its_intervals():
    """An interval needs 50 texts, so two of three rows have one. Each compares a shortcut with
    chance, so intervals are adjusted for two comparisons."""
    table = table_of_rows(direct=50, spatial=80, grounded=49)

    assert "95 % intervals, Bonferroni-adjusted for 2 rows;" in str(table.caption)


def test_a_row_of_fewer_than_50_texts_has_no_interval():
    """The last column is how far a shortcut exceeds chance: here by 0.1, in points, without an
    interval."""
    *_, excesses = table_of_rows(grounded=49).columns

    assert list(excesses.cells) == ["+10.0 (too few texts)"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--settings", "spatial"), "no spatial setting in StopCube"),
        (("--split", "none"), "nothing to score"),
        (("--seeds", "-1"), "seeds is -1; it must be a whole number from 0"),
        (("--learned", "--split", "val"), "choose --split test"),
        (("--plan", plan_file(distractors=0)), "distractors"),
    ],
)
def test_a_wrong_option_of_the_shortcuts_command_is_one_sentence(words, sentence):
    """It fails before anything is scored."""
    outcome = shortcuts_command("--tasks", "StopCube", *words)

    assert isinstance(outcome.exception, (InvalidValueError, UnknownNameError))
    assert sentence in str(outcome.exception)


@pytest.fixture(scope="module")
def stopcube_row():
    """The row of StopCube in the setting *direct* with the rates of learners."""
    pytest.importorskip("sklearn")
    (row,) = shortcut_rows(("StopCube",), ("test",), ("direct",), InstructionOptions(), learning=0)
    return row


def test_rates_of_learners_are_columns_after_chance_and_rules(stopcube_row):
    """The fixture is the row of StopCube; the learners' columns come last."""
    assert list(stopcube_row.shares) == ["chance", *SURFACE_RULES, *LEARNED_FLOORS]


def test_in_stopcube_the_words_alone_give_the_visit_away_in_nine_of_ten(stopcube_row):
    """The fixture is the row of StopCube in the setting *direct*; "text-only" learns from words
    alone.
    """
    assert stopcube_row.shares["text-only"].goals > 0.9


def test_the_interval_of_what_exceeds_chance_widens_with_the_number_of_rows(stopcube_row):
    """It is adjusted for several comparisons."""
    low, high = stopcube_row.excess.interval(1)
    lower, higher = stopcube_row.excess.interval(100)

    assert lower < low < stopcube_row.excess.value < high < higher
    assert 0.5 < low < high < 1
