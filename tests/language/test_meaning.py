"""The declared meaning: which goals the words leave in a scene."""

import itertools
from fractions import Fraction

import pytest

from roboirg.apps.language_lab.scenarios.scenario_check import scenes_of
from roboirg.core.delivery import DELIVERIES
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import POOLS
from roboirg.language import instruct_with, meaning
from roboirg.language.arms import say_arm
from roboirg.language.generator import find_refusal
from roboirg.language.instruction import Described, Meaning, Term
from roboirg.language.landmarks import candidates_in
from roboirg.language.request import values_of_goal
from roboirg.language.scenarios import amounts, declared
from roboirg.language.scenarios.scenario_file import written_words
from roboirg.language.settings import settings_of
from roboirg.shortcuts.command_chance import (
    blind_goals,
    goals_of_command,
    is_right,
    right_share,
    understood_goals,
)
from roboirg.tasks import get_task, goals_of
from roboirg.tasks.splits.splits import get_episode

WRITTEN = [*written_words()]
EPISODE = get_episode("PickXtimes", "test", 0)


def all_options_of(task):
    """Yield options of every setting, form, pool and delivery of a task."""
    for setting, form, pool, delivery in itertools.product(
        settings_of(get_task(task)), ("implicit", "resolved"), POOLS, DELIVERIES
    ):
        yield InstructionOptions(setting, form, wordings=pool, delivery=delivery)


def all_instructions_of(task, step):
    """Yield published episodes with everything that can be said of them."""
    for episode in scenes_of(task, 0)[::step]:
        for options in all_options_of(task):
            if find_refusal(episode, options) is None:
                yield episode, options, instruct_with(episode, options)


def are_all_the_right_goal(goals, episode):
    return bool(goals) and all(is_right(goal, episode) for goal in goals)


@pytest.mark.parametrize("task", WRITTEN)
@pytest.mark.parametrize("step", [10, pytest.param(1, marks=pytest.mark.slow)])
def test_an_instruction_means_the_goal_of_its_episode_and_no_other_goal(task, step):
    """Words declare their meaning, from which the goals that they leave open are computed.

    The whole dialogue leaves the right goal alone; its last sentence alone may leave more.
    """
    for episode, options, said in all_instructions_of(task, step):
        assert are_all_the_right_goal(understood_goals(said, episode), episode), said.text
        left = goals_of_command(said, episode)
        assert episode.goal in left, said.text
        assert set(left) >= set(blind_goals(said, episode)) >= {episode.goal}, said.text
        if options.setting == "explicit" or options.form == "resolved":
            assert are_all_the_right_goal(left, episode), said.text


@pytest.mark.parametrize("task", WRITTEN)
def test_an_implicit_command_needs_its_introduction_unless_the_scene_has_one_choice(task):
    """*Lift it twice* alone leaves the color open, unless all cubes have the same color.

    An exception: singular and plural can agree with one number only, *once for that take*.
    """
    for episode, options, said in all_instructions_of(task, 10):
        is_implicit = options.setting != "explicit" and options.form == "implicit"
        agrees_with_one = any(said.meaning.agrees.values())
        if is_implicit and agrees_with_one:
            assert options.setting != "direct-rival", said.text
        elif is_implicit and are_all_the_right_goal(goals_of_command(said, episode), episode):
            open_fields = said.meaning.terms.keys() - said.meaning.settled
            assert all(len(values_left(name, episode)) == 1 for name in open_fields), said.text


@pytest.mark.parametrize("speaks_of_one", [True, False])
def test_singular_words_leave_the_goals_of_one_and_plural_words_the_others(speaks_of_one):
    """*Once for that take*, or *for each take*."""
    words = Meaning({}, agrees={"repeats": speaks_of_one})

    left = meaning.command_goals(words, EPISODE)

    expected = [goal for goal in goals_of(EPISODE) if (goal["repeats"] == 1) == speaks_of_one]
    assert list(left) == expected


def values_by_field(goal):
    return {value.field: value.value for value in values_of_goal(goal)}


def values_left(name, episode):
    """Return the values of a field among the goals that agree with the right one in the others."""
    own = values_by_field(episode.goal)
    found = set()
    for goal in goals_of(episode):
        values = values_by_field(goal)
        if values.keys() == own.keys() and all(
            values[other] == own[other] for other in own if other != name
        ):
            found.add(values[name])
    return found


@pytest.mark.parametrize("task", WRITTEN)
def test_changing_one_value_of_an_introduction_changes_the_goal_that_is_meant(task):
    """The introduction says *two red cubes*; what if it had said *two blue cubes*?

    Finds words whose meaning is declared as a constant instead of by what was introduced.
    """
    moved = 0
    for episode, options, said in all_instructions_of(task, 25):
        if options.form == "resolved" or options.setting == "explicit":
            continue
        for name, term in said.meaning.terms.items():
            for operand in term.operands:
                others = meaning._possible_values(name, episode) - {operand}
                if isinstance(operand, Described) or not others:
                    continue
                other = min(others, key=str)
                changed = term._replace(
                    operands=tuple(other if part == operand else part for part in term.operands)
                )
                goals = meaning.meant_goals(Meaning({**said.meaning.terms, name: changed}), episode)
                if term.operation == "same":
                    assert episode.goal not in goals, said.text
                moved += episode.goal not in goals
    assert moved > 50


@pytest.mark.parametrize("setting", ["direct", "spatial", "contextual", "reasoning"])
def test_a_command_that_points_at_values_nobody_introduced_means_no_goal(setting):
    said = instruct_with(EPISODE, InstructionOptions(setting))
    unsaid = {name: term._replace(operands=()) for name, term in said.meaning.terms.items()}
    assert meaning.meant_goals(Meaning(unsaid), EPISODE) == ()


def test_a_silent_command_leaves_all_goals_open_and_a_scrambled_one_means_none():
    """Both are controls: one states no goal at all, the other has its words in random order."""
    options = InstructionOptions("direct")
    silent = say_arm(EPISODE, options, "silent").instruction
    assert understood_goals(silent, EPISODE) == goals_of(EPISODE)

    scrambled = say_arm(EPISODE, options, "scrambled").instruction
    assert scrambled.meaning is None
    assert understood_goals(scrambled, EPISODE) == goals_of_command(scrambled, EPISODE) == ()
    assert right_share(blind_goals(scrambled, EPISODE), EPISODE) is None


def test_a_place_that_selects_no_object_means_no_goal():
    clear = Described("no such place", "place", "robot")
    term = Term("same", (clear,))
    assert (
        meaning.meant_goals(Meaning({"color": term, "repeats": Term("same", (1,))}), EPISODE) == ()
    )


def test_without_the_command_a_rival_value_leaves_a_guess_between_two_goals():
    """In *direct-rival* the introduction names two colors, and the command points at one of them.

    Who ignores the pointer is right in half of the cases; who hears the command alone, in fewer.
    """
    shares = []
    for index in range(12):
        episode = get_episode("PickXtimes", "test", index)
        options = InstructionOptions("direct-rival")
        if find_refusal(episode, options) is None:
            said = instruct_with(episode, options)
            assert right_share(blind_goals(said, episode), episode) == Fraction(1, 2), said.text
            shares.append(right_share(goals_of_command(said, episode), episode))
    assert min(shares) < Fraction(1, 2)


def change(owner, name, made):
    """Return a fault: a function takes the place of another one, which it gets as its first."""

    def put_in(patch):
        before = getattr(owner, name)
        patch.setattr(owner, name, lambda *given: made(before, *given))

    return put_in


def entry(table, key, value):
    return lambda patch: patch.setitem(table, key, value)


PLANTED_FAULTS = {
    "minus adds": entry(declared._STEP_SIGNS, "minus", 1),
    "earlier is later": entry(declared._STEP_SIGNS, "earlier", 1),
    "right after is two after": entry(declared._STEPS, "after", 2),
    "the former is the second": entry(declared._RANK_BY_EXPRESSION, "former", 2),
    "a rank is the next one": change(declared, "_rank_of", lambda rank, *given: rank(*given) + 1),
    "the other one is the one that was taken": change(
        declared, "_taken_rank", lambda rank, *given: 3 - rank(*given)
    ),
    "a remark chooses what it sets aside": change(
        amounts,
        "chosen_term",
        lambda term, *given: term(*given)._replace(rank=3 - term(*given).rank),
    ),
    "neither of them is one of them": change(
        meaning, "_values_without", lambda _left, operands, *_: frozenset(operands)
    ),
    "twice as often is half as often": change(
        meaning,
        "_computed_number",
        lambda reckon, term, number: reckon(term._replace(operation="half"), number),
    ),
    "a list is heard backwards": change(
        declared.SaidValues, "listed", lambda listed, *given: listed(*given)[::-1]
    ),
    "a place is that of another thing": change(
        meaning, "_described_thing", lambda *given: another_if("place", *given)
    ),
    "a clue is to another thing": change(
        meaning, "_described_thing", lambda *given: another_if("clue", *given)
    ),
}


def another_if(kind, described_thing, described, episode):
    """Return another thing than the one that is described, for one kind of description."""
    thing = described_thing(described, episode)
    if described.kind != kind:
        return thing
    things = candidates_in(episode.scene, get_task(episode.task).things.pointed)
    return next((other for other in things if other != thing), None)


@pytest.mark.parametrize("fault", PLANTED_FAULTS)
def test_a_planted_fault_in_the_computation_of_meaning_is_detected(fault, monkeypatch):
    """A check of the checks: with each fault, some published text must mean a wrong goal."""
    PLANTED_FAULTS[fault](monkeypatch)
    texts = itertools.chain.from_iterable(all_instructions_of(task, 4) for task in WRITTEN)
    assert any(
        not are_all_the_right_goal(understood_goals(said, episode), episode)
        for episode, _, said in texts
    )


def test_amounts_of_two_colors_mean_the_same_goal_in_either_order():
    """The terms name the two colors of a BinFill goal in reverse: *one blue and two red cubes*.

    A command that states one color and its count leaves the other count open.
    """
    episodes = scenes_of("BinFill", 0)
    episode = next(found for found in episodes if len(found.goal["colors"]) == 2)
    (color, count), (other_color, other_count) = episode.goal.amounts
    exchanged = {
        "colors.0": other_color, "counts.0": other_count, "colors.1": color, "counts.1": count,
    }  # fmt: skip
    terms = {field: Term("same", (value,)) for field, value in exchanged.items()}

    assert meaning.meant_goals(Meaning(terms), episode) == (episode.goal,)
    assert meaning.command_goals(Meaning(terms), episode) == goals_of(episode)

    stated = Meaning(terms, frozenset({"counts.0", "colors.1", "counts.1"}))
    left = [dict(goal.amounts) for goal in meaning.command_goals(stated, episode)]
    assert {color: count, other_color: other_count} in left
    for given in left:
        assert len(given) == 2
        assert given[color] == count


def test_all_cubes_but_three_means_the_number_of_cubes_minus_three():
    kept = 0
    for episode, options, said in all_instructions_of("BinFill", 1):
        if options.setting == "grounded" and said.meaning.terms["counts.0"].operation == "without":
            cubes = candidates_in(episode.scene, "cube")
            assert episode.goal["counts"] == (len(cubes) - 3,), said.text
            kept += 1
    assert kept
