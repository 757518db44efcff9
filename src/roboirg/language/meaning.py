"""The goals that the declared meaning of an instruction leaves open in a scene.

The listener, the chance level, the checker of scenarios, the floors and the exports ask here what
an instruction means. Places and what there is to see are looked up in the scene,
with their margins; the goal of the episode is never read.
"""

from __future__ import annotations

from collections.abc import Mapping

from roboirg.core.episode import Episode, Goal, SceneObject
from roboirg.core.goal_slots import SLOT_TYPE_NAMES
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.grounded import spoken_clues
from roboirg.language.instruction import Described, Meaning, Term
from roboirg.language.landmarks import candidates_in
from roboirg.language.places import things_at
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.template_sampler import sampler_of
from roboirg.language.worded_command import fields_of
from roboirg.tasks import get_task, goals_of

Value = str | int
Values = frozenset[Value]


def meant_goals(meaning: Meaning, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals that all of an instruction leaves; empty if its terms give no value."""
    values = {name: _values_of(term, name, episode) for name, term in meaning.terms.items()}
    return _goals_with(values, meaning, episode)


def command_goals(meaning: Meaning, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals that the last utterance alone leaves."""
    return _goals_with(_settled_values(meaning, episode), meaning, episode)


def candidate_goals(meaning: Meaning, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals among which a guess is blind: those with values that the words offer.

    To pick one of two that are named takes no understanding of which one is meant.
    """
    values = _settled_values(meaning, episode)
    for name, term in meaning.terms.items():
        if name not in values and term.operation in ("rank", "other"):
            offered = [_operand_values(operand, name, episode) for operand in term.operands]
            values[name] = frozenset[Value]().union(*offered)
    return _goals_with(values, meaning, episode)


def field_values(meaning: Meaning, name: str, episode: Episode) -> Values:
    """Return the values that an instruction gives a field: none if it is open, one if clear."""
    term = meaning.terms.get(name)
    return frozenset() if term is None else _values_of(term, name, episode)


def _settled_values(meaning: Meaning, episode: Episode) -> dict[str, Values]:
    return {name: _values_of(meaning.terms[name], name, episode) for name in meaning.settled}


def _goals_with(
    values: Mapping[str, Values], meaning: Meaning, episode: Episode
) -> tuple[Goal, ...]:
    """Return the scene's goals with the fields of a meaning and one of the values in each."""
    found: list[Goal] = []
    for goal in goals_of(episode):
        own = _field_values(goal)
        has_fields = not meaning.terms or own.keys() == meaning.terms.keys()
        if has_fields and all(own[name] in possible for name, possible in values.items()):
            found.append(goal)
    return tuple(found)


def _field_values(goal: Goal) -> dict[str, Value]:
    """Return the value of each field of a goal."""
    found: dict[str, Value] = {}
    for slot, _ in goal.slots:
        found.update(fields_of(goal, slot))
    return found


def _values_of(term: Term, name: str, episode: Episode) -> Values:
    """Return the values that a term gives a field: one if it is clear, none without operands."""
    operands = term.operands
    rank = term.rank
    if term.operation == "without":
        return _values_without(operands, name, episode)
    if term.operation == "rank":
        operands = operands[rank - 1 : rank] if rank > 0 else ()
    if term.operation == "other":
        is_pair = len(operands) == 2 and rank in (1, 2)  # noqa: PLR2004
        operands = (operands[2 - rank],) if is_pair else ()
    if len(operands) != 1:
        return frozenset()
    (operand,) = operands
    if term.operation in ("double", "half", "step"):
        return frozenset([_reckoned(term, operand)]) if isinstance(operand, int) else frozenset()
    return _operand_values(operand, name, episode)


def _reckoned(term: Term, number: int) -> int:
    """Return the number that follows from another one."""
    if term.operation == "double":
        return 2 * number
    if term.operation == "half":
        return number // 2
    return number + term.step


def _values_without(operands: tuple[Value | Described, ...], name: str, episode: Episode) -> Values:
    """Return what is left of a field's values, or of the things, when some are set aside."""
    described = [operand for operand in operands if isinstance(operand, Described)]
    if not described:
        return _possible_values(name, episode).difference(operands)
    aside = [_thing_at(operand, episode) for operand in described]
    things = candidates_in(episode.scene, get_task(episode.task).commands.pointed)
    left = [thing for thing in things if thing not in aside]
    if None in aside or len(left) != 1:
        return frozenset()
    return _values_of_thing(left[0], name, episode)


def _possible_values(name: str, episode: Episode) -> Values:
    """Return all values that the scene's goals have in the slot of a field."""
    slot = name.partition(".")[0]
    found: set[Value] = set()
    for goal in goals_of(episode):
        found.update(dict(fields_of(goal, slot)).values())
    return frozenset(found)


def _operand_values(operand: Value | Described, name: str, episode: Episode) -> Values:
    """Return the values of a field for which an operand stands."""
    if not isinstance(operand, Described):
        return frozenset([operand])
    if operand.kind == "clue":
        return _values_seen(operand, name, episode)
    thing = _thing_at(operand, episode)
    return frozenset() if thing is None else _values_of_thing(thing, name, episode)


def _thing_at(place: Described, episode: Episode) -> SceneObject | None:
    """Return the only thing at a place; None if none is clear by the margin."""
    pointed = get_task(episode.task).commands.pointed
    return things_at(episode.scene, pointed, place.frame).get(place.phrase)


def _values_of_thing(thing: SceneObject, name: str, episode: Episode) -> Values:
    """Return the values of a field by which a goal would ask for a thing."""
    request = _request_of(episode)
    return frozenset(
        value
        for value in _possible_values(name, episode)
        if thing in request.objects_to_point_at(_goal_value(name, value))
    )


def _values_seen(clue: Described, name: str, episode: Episode) -> Values:
    """Return the values of a field that have a clue in the scene or the video."""
    pointed = get_task(episode.task).commands.pointed
    for thing, known in spoken_clues(episode.scene, pointed):
        if known.words == clue.phrase:
            return _values_of_thing(thing, name, episode)
    return frozenset()


def _goal_value(name: str, value: Value) -> GoalValue:
    slot = name.partition(".")[0]
    return GoalValue(name, slot, SLOT_TYPE_NAMES[slot], value)


def _request_of(episode: Episode) -> InstructionRequest:
    """Return a request by which things of a scene are looked up."""
    options = InstructionOptions("grounded")
    return InstructionRequest(episode, get_task(episode.task), options, sampler_of(episode))
