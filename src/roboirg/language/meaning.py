"""The goals that the declared meaning of an instruction leaves open in a scene.

The listener, the chance level, the checker of scenarios, the floors and the exports ask here what
an instruction means. Places and what there is to see are looked up in the scene,
with their margins; the goal of the episode is never read.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence

from roboirg.core.episode import Episode, Goal, SceneObject
from roboirg.language.grounded import spoken_clues
from roboirg.language.instruction import Described, Meaning, Term
from roboirg.language.landmarks import candidates_in, things_of_color
from roboirg.language.number_words import agreeing_number
from roboirg.language.places import things_at
from roboirg.language.request import GoalValues, values_of_goal
from roboirg.tasks import get_task, goals_of

Value = str | int
Values = frozenset[Value]
Operand = Value | Described


def meant_goals(meaning: Meaning, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals of the scene that fit everything that was said."""
    return _goals_with(_values_of(meaning.terms, meaning, episode), meaning, episode)


def command_goals(meaning: Meaning, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals that fit the command alone: it settles some fields, the others are open."""
    return _goals_with(_values_of(meaning.settled, meaning, episode), meaning, episode)


def candidate_goals(meaning: Meaning, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals left to a guesser who heard which values were listed, not which is meant.

    A field that the command settles has its value, one that is picked from a list has any value
    of the list, and all others are open.
    """
    possible = _values_of(meaning.settled, meaning, episode)
    for field, term in meaning.terms.items():
        is_picked = term.operation in ("rank", "other")
        if is_picked and field not in meaning.settled:
            possible[field] = _listed_values(term, field, episode)
    return _goals_with(possible, meaning, episode)


def field_values(meaning: Meaning, field: str, episode: Episode) -> Values:
    """Return the values that a field can have by what was said; empty if no term is about it."""
    term = meaning.terms.get(field)
    return frozenset() if term is None else _term_values(term, field, episode)


def _values_of(fields: Iterable[str], meaning: Meaning, episode: Episode) -> dict[str, Values]:
    """Return the possible values of some fields by their terms."""
    return {field: _term_values(meaning.terms[field], field, episode) for field in fields}


def _goals_with(
    possible: Mapping[str, Values], meaning: Meaning, episode: Episode
) -> tuple[Goal, ...]:
    """Return the scene's goals with the fields that were said, each with a possible value."""
    found: list[Goal] = []
    # "Put them into the bin" is said of any number of colors.
    is_any = not meaning.terms or (not possible and "counts.0" in meaning.terms)
    for goal in goals_of(episode):
        if meaning.goals and goal not in meaning.goals:
            continue
        for values in _in_every_order(goal):
            own = {value.field: value.value for value in values}
            if not is_any and own.keys() != meaning.terms.keys():
                continue  # it asks for two containers, and the words for one
            fits = all(own[field] in values for field, values in possible.items())
            if fits and _agrees(own, meaning.agrees):
                found.append(goal)
                break
    return tuple(found)


def _agrees(own: Mapping[str, Value], agrees: Mapping[str, bool]) -> bool:
    """Return whether a goal has one or several where the words speak of one or of several."""
    for slot, is_one in agrees.items():
        values = [value for field, value in own.items() if slot in (field, field.partition(".")[0])]
        number = agreeing_number(values)  # 0 if the goal does not have the slot
        if number and (number == 1) != is_one:
            return False
    return True


def _in_every_order(goal: Goal) -> Iterator[GoalValues]:
    """Yield the values of a goal, with amounts in every order, which means nothing."""
    if "counts" not in dict(goal.slots):
        yield values_of_goal(goal)
        return
    for amounts in itertools.permutations(goal.amounts):
        colors, counts = zip(*amounts, strict=True)
        yield values_of_goal(Goal.of(colors=colors, counts=counts))


def _term_values(term: Term, field: str, episode: Episode) -> Values:
    """Return the values that a term gives a field; empty if it picks no operand."""
    if term.operation == "without":
        return _values_without(term.operands, field, episode)
    operand = _picked_operand(term)
    if operand is None:
        return frozenset()
    if isinstance(operand, int) and term.operation in ("double", "half", "step"):
        return frozenset([_reckoned(term, operand)])
    return _operand_values(operand, field, episode)


def _picked_operand(term: Term) -> Operand | None:
    """Return the only operand that a term picks; None if it picks none or several."""
    picked = [
        operand
        for position, operand in enumerate(term.operands, start=1)
        if _is_picked(position, term)
    ]
    return picked[0] if len(picked) == 1 else None


def _is_picked(position: int, term: Term) -> bool:
    """Return whether a term picks the operand at a position, from 1."""
    if term.operation == "rank":
        return position == term.rank
    if term.operation == "other":
        return position != term.rank
    return True


def _reckoned(term: Term, number: int) -> int:
    """Return the number that follows from another one."""
    if term.operation == "double":
        return 2 * number
    if term.operation == "half":
        return number // 2
    return number + term.step


def _values_without(operands: Sequence[Operand], field: str, episode: Episode) -> Values:
    """Return the values of a field that are left when some values, or things, are set aside."""
    described = [operand for operand in operands if isinstance(operand, Described)]
    if described:
        return _values_of_last_thing(described, field, episode)
    if field == "counts.0":  # all cubes but three
        things = candidates_in(episode.scene, get_task(episode.task).commands.pointed)
        return frozenset(len(things) - int(str(kept)) for kept in operands)
    return _possible_values(field, episode).difference(operands)


def _values_of_last_thing(aside: Sequence[Described], field: str, episode: Episode) -> Values:
    """Return the values of the only thing that none of some descriptions fits; empty if unclear."""
    set_aside = [_described_thing(description, episode) for description in aside]
    if None in set_aside:
        return frozenset()
    things = candidates_in(episode.scene, get_task(episode.task).commands.pointed)
    left = [thing for thing in things if thing not in set_aside]
    return _values_of_thing(left[0], field, episode) if len(left) == 1 else frozenset()


def _listed_values(term: Term, field: str, episode: Episode) -> Values:
    """Return the values of a field for which any operand of a term stands."""
    found: set[Value] = set()
    for operand in term.operands:
        found |= _operand_values(operand, field, episode)
    return frozenset(found)


def _operand_values(operand: Operand, field: str, episode: Episode) -> Values:
    """Return the values of a field for which an operand stands."""
    if not isinstance(operand, Described):
        return frozenset([operand])
    thing = _described_thing(operand, episode)
    return frozenset() if thing is None else _values_of_thing(thing, field, episode)


def _described_thing(described: Described, episode: Episode) -> SceneObject | None:
    """Return the only thing in the scene that fits a description; None if there is no such one."""
    task = get_task(episode.task)
    if described.kind == "place":
        known = things_at(episode.scene, task.commands.pointed, described.frame)
        return known.get(described.phrase)
    for found in spoken_clues(episode.scene, task):
        if found.clue.words == described.phrase:
            return found.thing
    return None


def _values_of_thing(thing: SceneObject, field: str, episode: Episode) -> Values:
    """Return the colors by which a goal can ask for a thing: of a container, those under it."""
    kind_of_thing = get_task(episode.task).commands.pointed
    found: set[Value] = set()
    for color in _possible_values(field, episode):
        if thing in things_of_color(episode.scene, kind_of_thing, str(color)):
            found.add(color)
    return frozenset(found)


def _possible_values(field: str, episode: Episode) -> Values:
    """Return the values that a field's slot has in any goal of the scene."""
    slot = field.partition(".")[0]  # of "colors.1", the second color
    found: set[Value] = set()
    for goal in goals_of(episode):
        found.update(value.value for value in values_of_goal(goal) if value.slot == slot)
    return frozenset(found)
