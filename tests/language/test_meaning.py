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
SCENE = get_episode("PickXtimes", "test", 0)


def options_of(task):
    """Yield options of every setting, form, pool and delivery of a task."""
    for setting, form, pool, delivery in itertools.product(
        settings_of(get_task(task)), ("implicit", "resolved"), POOLS, DELIVERIES
    ):
        yield InstructionOptions(setting, form, wordings=pool, delivery=delivery)


def said_of(task, step):
    """Yield published episodes with everything that can be said of them."""
    for episode in scenes_of(task, 0)[::step]:
        for options in options_of(task):
            if find_refusal(episode, options) is None:
                yield episode, options, instruct_with(episode, options)


def is_goal_alone(goals, episode):
    return bool(goals) and all(is_right(goal, episode) for goal in goals)


@pytest.mark.parametrize("task", WRITTEN)
@pytest.mark.parametrize("step", [10, pytest.param(1, marks=pytest.mark.slow)])
def test_the_declared_meaning_is_the_goal_and_no_other(task, step):
    for episode, options, said in said_of(task, step):
        assert is_goal_alone(understood_goals(said, episode), episode), said.text
        left = goals_of_command(said, episode)
        assert episode.goal in left, said.text
        assert set(left) >= set(blind_goals(said, episode)) >= {episode.goal}, said.text
        if options.setting == "explicit" or options.form == "resolved":
            assert is_goal_alone(left, episode), said.text


@pytest.mark.parametrize("task", WRITTEN)
def test_an_implicit_command_alone_leaves_more_than_the_goal_unless_the_scene_has_no_more(task):
    """Or its words agree with a single one, *once for that take*: the chance level knows it."""
    for episode, options, said in said_of(task, 10):
        is_implicit = options.setting != "explicit" and options.form == "implicit"
        agrees_with_one = any(said.meaning.agrees.values())
        if is_implicit and agrees_with_one:
            assert options.setting != "direct-rival", said.text
        elif is_implicit and is_goal_alone(goals_of_command(said, episode), episode):
            open_fields = said.meaning.terms.keys() - said.meaning.settled
            assert all(len(values_left(name, episode)) == 1 for name in open_fields), said.text


def fields_of(goal):
    return {value.field: value.value for value in values_of_goal(goal)}


def values_left(name, episode):
    """Return the values of a field among the goals that agree with the right one in the others."""
    own = fields_of(episode.goal)
    found = set()
    for goal in goals_of(episode):
        values = fields_of(goal)
        if values.keys() == own.keys() and all(
            values[other] == own[other] for other in own if other != name
        ):
            found.add(values[name])
    return found


@pytest.mark.parametrize("task", WRITTEN)
def test_another_value_in_the_introduction_is_another_goal(task):
    moved = 0
    for episode, options, said in said_of(task, 25):
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
def test_what_was_not_said_means_nothing(setting):
    said = instruct_with(SCENE, InstructionOptions(setting))
    unsaid = {name: term._replace(operands=()) for name, term in said.meaning.terms.items()}
    assert meaning.meant_goals(Meaning(unsaid), SCENE) == ()


def test_no_words_leave_all_goals_and_scrambled_ones_have_no_meaning():
    options = InstructionOptions("direct")
    silent = say_arm(SCENE, options, "silent").instruction
    assert understood_goals(silent, SCENE) == goals_of(SCENE)

    scrambled = say_arm(SCENE, options, "scrambled").instruction
    assert scrambled.meaning is None
    assert understood_goals(scrambled, SCENE) == goals_of_command(scrambled, SCENE) == ()
    assert right_share(blind_goals(scrambled, SCENE), SCENE) is None


def test_a_place_means_nothing_where_no_thing_is_clear_by_the_margin():
    clear = Described("no such place", "place", "robot")
    term = Term("same", (clear,))
    assert meaning.meant_goals(Meaning({"color": term, "repeats": Term("same", (1,))}), SCENE) == ()


def test_a_rival_is_a_guess_between_two_and_the_command_leaves_more():
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


FAULTS = {
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


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_operations_pointers_places_or_clues_is_found(fault, monkeypatch):
    FAULTS[fault](monkeypatch)
    texts = itertools.chain.from_iterable(said_of(task, 4) for task in WRITTEN)
    assert any(
        not is_goal_alone(understood_goals(said, episode), episode) for episode, _, said in texts
    )


def test_amounts_have_no_order_and_them_may_be_of_any_number_of_colors():
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


def test_the_rest_is_all_cubes_but_those_that_are_kept():
    kept = 0
    for episode, options, said in said_of("BinFill", 1):
        if options.setting == "grounded" and said.meaning.terms["counts.0"].operation == "without":
            cubes = candidates_in(episode.scene, "cube")
            assert episode.goal["counts"] == (len(cubes) - 3,), said.text
            kept += 1
    assert kept
