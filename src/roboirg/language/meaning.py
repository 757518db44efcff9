"""The goals that the declared meaning of an instruction leaves open in a scene.

A *term* says how the value of a field follows from its *operands*, the values and descriptions that
were said; `Term` lists its operations.

The listener, the chance level, the checker of scenarios, the floors and the exports ask here what
an instruction means. Places and what there is to see are looked up in the scene,
with their margins; the goal of the episode is never read.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from roboirg.core.episode import Episode, Goal, SceneObject
from roboirg.language.clues import event_clues, thing_clues
from roboirg.language.goal_fields import in_every_order
from roboirg.language.instruction import Described, Meaning, Term
from roboirg.language.landmarks import candidates_in, things_of_color
from roboirg.language.number_words import agreeing_number
from roboirg.language.places import things_at
from roboirg.language.request import values_of_goal
from roboirg.tasks import get_task, goals_of

Value = str | int
Values = frozenset[Value]
Operand = Value | Described


def meant_goals(meaning: Meaning, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals of the scene that fit everything that was said.

    One goal for a clear instruction, none if its words contradict each other or the scene.
    """
    return _goals_with(_values_of(meaning.terms, meaning, episode), meaning, episode)


def command_goals(meaning: Meaning, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals of the scene that fit the command alone, without the utterances before it.

    After *Red is nice. Lift it twice.*, the command settles the repeats and leaves the color open:
    every color, twice.
    """
    return _goals_with(_values_of(meaning.settled, meaning, episode), meaning, episode)


def candidate_goals(meaning: Meaning, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals left to a guesser who knows which values were listed, not which is meant.

    After *red or blue; take the latter*, both colors are left. A field whose value the command
    itself says has that value, one that is picked from a list has any value of the list, and all
    others are open.
    """
    possible = _values_of(meaning.settled, meaning, episode)
    for field, term in meaning.terms.items():
        is_picked = term.operation in ("rank", "other")
        if is_picked and field not in meaning.settled:
            possible[field] = _listed_values(term, field, episode)
    return _goals_with(possible, meaning, episode)


def field_values(meaning: Meaning, field: str, episode: Episode) -> Values:
    """Return the values that a field of the goal can have by what was said: ``{"red"}``.

    Empty if nothing was said about it.
    """
    term = meaning.terms.get(field)
    return frozenset() if term is None else _term_values(term, field, episode)


def _values_of(fields: Iterable[str], meaning: Meaning, episode: Episode) -> dict[str, Values]:
    """Return the possible values of some fields by their terms: ``{"color": {"red"}}``.

    A term says how the value of a field follows from what was said. Each field must have one.
    """
    return {field: _term_values(meaning.terms[field], field, episode) for field in fields}


def _goals_with(
    possible: Mapping[str, Values], meaning: Meaning, episode: Episode
) -> tuple[Goal, ...]:
    """Return the goals of the scene that have, in each field that was said, a possible value.

    Args:
        possible: for some fields, the values that the words allow: ``{"color": {"red"}}``.
        meaning: of the instruction.
        episode: with the scene; its own goal is not read.
    """
    return tuple(goal for goal in goals_of(episode) if _can_be_meant(goal, possible, meaning))


def _can_be_meant(goal: Goal, possible: Mapping[str, Values], meaning: Meaning) -> bool:
    """Return whether a goal of the scene fits what was said.

    It fits if each of its fields, such as ``color`` or ``repeats``, has a value that the words
    allow, and if singular and plural agree with it. A goal of a field that was not said does not
    fit.

    Args:
        goal: of the scene.
        possible: for some fields, the values that the words allow: ``{"color": {"red"}}``.
        meaning: of the instruction.
    """
    if meaning.goals and goal not in meaning.goals:
        return False
    # Without words about the goal, or with "Put them into the bin", any number of colors fits.
    may_have_other_fields = not meaning.terms or ("counts.0" in meaning.terms and not possible)
    for ordered_goal in in_every_order(goal):
        value_by_field = {value.field: value.value for value in values_of_goal(ordered_goal)}
        if not may_have_other_fields and value_by_field.keys() != meaning.terms.keys():
            continue  # it asks for two containers, and the words for one
        if _has_values(value_by_field, possible) and _agrees(value_by_field, meaning.agrees):
            return True
    return False


def _has_values(by_field: Mapping[str, Value], possible: Mapping[str, Values]) -> bool:
    """Return whether a goal, by field, has a possible value in each field that is asked for.

    ``{"color": "red", "repeats": 2}`` with ``{"color": {"red", "blue"}}`` has.
    """
    return all(by_field[field] in values for field, values in possible.items())


def _agrees(value_by_field: Mapping[str, Value], is_singular_by_slot: Mapping[str, bool]) -> bool:
    """Return whether a goal agrees with the singular or plural of the words about it.

    *Once for each take* speaks of several, ``{"repeats": False}``, so a goal of one repeat does not
    fit.

    Args:
        value_by_field: the values of the goal.
        is_singular_by_slot: by slot or field, whether the words are in the singular.
    """
    for slot, is_single in is_singular_by_slot.items():
        values = []
        for field, value in value_by_field.items():
            if slot in (field, field.partition(".")[0]):  # "counts.0" is a field of "counts"
                values.append(value)
        number = agreeing_number(values)  # 0 if the goal does not have the slot
        goal_is_single = number == 1
        if number and goal_is_single != is_single:
            return False
    return True


def _term_values(term: Term, field: str, episode: Episode) -> Values:
    """Return the values that the words allow for a field of the goal.

    A term is an operation on operands, what was said: ``double`` of 2 gives ``{4}``, ``rank`` 1 of
    red and blue ``{"red"}``. Empty if it picks nothing, or what it picks is not in the scene.

    Args:
        term: of the field.
        field: of the goal, ``colors.1``.
        episode: with the scene in which descriptions, *on the left*, are looked up.
    """
    if term.operation == "without":
        return _values_without(term.operands, field, episode)
    operand = picked_operand(term)
    if operand is None:
        return frozenset()
    if isinstance(operand, int) and term.operation in ("double", "half", "step"):
        return frozenset([_computed_number(term, operand)])
    return _operand_values(operand, field, episode)


def picked_operand(term: Term) -> Operand | None:
    """Return the one of a term's operands, the values that were said, that it picks.

    Of red and blue, ``rank`` 1 picks red, ``other`` than rank 1 picks blue. None if it picks none
    or several: ``same`` picks both.
    """
    picked = []
    for position, operand in enumerate(term.operands, start=1):
        if _is_picked(position, term):
            picked.append(operand)
    return picked[0] if len(picked) == 1 else None


def _is_picked(position: int, term: Term) -> bool:
    """Return whether a term picks the operand at a position, from 1.

    ``rank`` picks the one at its rank, ``other`` all but that one, and all others pick each.
    """
    if term.operation == "rank":
        return position == term.rank
    if term.operation == "other":
        return position != term.rank
    return True


def _computed_number(term: Term, number: int) -> int:
    """Return the number that a term computes from another one, its operand.

    ``double`` gives 6 from 3, ``half`` 2 from 4, and ``step`` with the step -1 gives 2 from 3.
    """
    if term.operation == "double":
        return 2 * number
    if term.operation == "half":
        return number // 2
    return number + term.step


def _values_without(operands: Sequence[Operand], field: str, episode: Episode) -> Values:
    """Return the values of a field that are left when some values, or things, are set aside.

    In a scene of red, blue and green cubes, *neither red nor blue* leaves ``{"green"}``. Things may
    be set aside by descriptions, *the one on the left*; then the only thing left gives the value.
    For a number of cubes, *all but three* of five leaves ``{2}``.

    Args:
        operands: what is set aside: values, or descriptions.
        field: of the goal, ``color``.
        episode: with the scene.
    """
    described = [operand for operand in operands if isinstance(operand, Described)]
    if described:
        return _values_of_last_thing(described, field, episode)
    if field == "counts.0":  # all cubes but three
        number = len(_things_to_point_at(episode))
        return frozenset(number - int(str(kept)) for kept in operands)  # what is not kept
    return _possible_values(field, episode).difference(operands)


def _values_of_last_thing(
    descriptions: Sequence[Described], field: str, episode: Episode
) -> Values:
    """Return the values of the only thing that is left when the described things are set aside.

    A description is such as *on the left*. Empty if one fits nothing, or if several things or none
    are left.
    """
    remaining = list(_things_to_point_at(episode))
    for description in descriptions:
        thing = _described_thing(description, episode)
        if thing is None:
            return frozenset()
        if thing in remaining:
            remaining.remove(thing)
    if len(remaining) != 1:
        return frozenset()
    return _values_of_thing(remaining[0], field, episode)


def _things_to_point_at(episode: Episode) -> Sequence[SceneObject]:
    """Return the cubes or containers of the scene that words such as *on the left* can mean."""
    return candidates_in(episode.scene, get_task(episode.task).things.pointed)


def _listed_values(term: Term, field: str, episode: Episode) -> Values:
    """Return the values of a field for which any operand of a term, anything that was said, stands.

    For ``rank`` 1 of red and blue: both.
    """
    found: set[Value] = set()
    for operand in term.operands:
        found |= _operand_values(operand, field, episode)
    return frozenset(found)


def _operand_values(operand: Operand, field: str, episode: Episode) -> Values:
    """Return the values that words of an instruction give a field of the goal.

    For ``color`` the value ``"red"`` gives ``{"red"}``; the description *on the left* gives the
    color of the cube there. Empty if no single thing fits the description, or if the thing has no
    value of this field.

    Args:
        operand: a value that was said, or a description of a thing in the scene or the video.
        field: of the goal, ``color``, or ``colors.1`` for the second of several.
        episode: with the scene; its own goal is not read.
    """
    if not isinstance(operand, Described):
        return frozenset([operand])
    # With a video, clues are about what happened in it; without one, about where a thing stands.
    if episode.scene.past and operand.kind == "clue":
        return _values_of_event(operand, field, episode)
    thing = _described_thing(operand, episode)
    if thing is None:
        return frozenset()
    return _values_of_thing(thing, field, episode)


def _values_of_event(described: Described, field: str, episode: Episode) -> Values:
    """Return the value of a field to which words for something in the video lead; empty if none.

    *The cube that the robot moved* leads to its color.
    """
    found = set()
    for event in event_clues(episode.scene):
        if event.clue.words == described.phrase and event.slot == field:
            found.add(event.value)
    return frozenset(found)


def _described_thing(described: Described, episode: Episode) -> SceneObject | None:
    """Return the only thing in the scene that fits a description; None if no single one does.

    The description is a place, *on the left*, or a clue, *the cube in the middle*.
    """
    task = get_task(episode.task)
    if described.kind == "place":
        thing_by_place = things_at(episode.scene, task.things.pointed, described.frame)
        return thing_by_place.get(described.phrase)
    for thing_clue in thing_clues(episode.scene, task):
        if thing_clue.clue.words == described.phrase:
            return thing_clue.thing
    return None


def _values_of_thing(thing: SceneObject, field: str, episode: Episode) -> Values:
    """Return the colors by which a goal can ask for a thing: ``{"red"}`` for a red cube.

    A container has the colors of what is under it.

    Args:
        thing: of the scene.
        field: of the goal, ``colors.1``, whose slot decides which colors are possible.
        episode: with the scene.
    """
    kind_of_thing = get_task(episode.task).things.pointed
    found = set()
    for color in _possible_values(field, episode):
        if thing in things_of_color(episode.scene, kind_of_thing, str(color)):
            found.add(color)
    return frozenset(found)


def _possible_values(field: str, episode: Episode) -> Values:
    """Return the values that a field can have in any goal of the scene: ``{"red", "blue"}``.

    They are those of its slot: for ``colors.1``, the second color, the colors of all goals.
    """
    slot = field.partition(".")[0]  # of "colors.1", the second color
    found: set[Value] = set()
    for goal in goals_of(episode):
        found.update(value.value for value in values_of_goal(goal) if value.slot == slot)
    return frozenset(found)
