"""The goals that the declared meaning of an instruction leaves open in a scene.

The listener, the chance level, the checker of scenarios, the floors and the exports ask here what
an instruction means. Places and what there is to see are looked up in the scene,
with their margins; the goal of the episode is never read.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from roboirg.core.episode import Episode, Goal, SceneObject
from roboirg.language.grounded import spoken_clues
from roboirg.language.instruction import Described, Meaning, Term
from roboirg.language.landmarks import candidates_in, things_of_color
from roboirg.language.places import things_at
from roboirg.language.request import values_of_goal
from roboirg.tasks import get_task, goals_of

Value = str | int
Values = frozenset[Value]
Operand = Value | Described


def meant_goals(meaning: Meaning, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals that all of an instruction leaves; empty if its terms give no value."""
    return _goals_with(_values_of(meaning.terms, meaning, episode), meaning, episode)


def command_goals(meaning: Meaning, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals that the last utterance alone leaves."""
    return _goals_with(_values_of(meaning.settled, meaning, episode), meaning, episode)


def candidate_goals(meaning: Meaning, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals among which a guess is blind: those with values that the words offer.

    To pick one of two that are named takes no understanding of which one is meant.
    """
    values = _values_of(meaning.settled, meaning, episode)
    for field, term in meaning.terms.items():
        if field not in values and term.operation in ("rank", "other"):
            offered = [_operand_values(operand, field, episode) for operand in term.operands]
            values[field] = frozenset[Value]().union(*offered)
    return _goals_with(values, meaning, episode)


def field_values(meaning: Meaning, field: str, episode: Episode) -> Values:
    """Return the values that an instruction gives a field: none if it is open, one if clear."""
    term = meaning.terms.get(field)
    return frozenset() if term is None else _term_values(term, field, episode)


def _values_of(fields: Iterable[str], meaning: Meaning, episode: Episode) -> dict[str, Values]:
    """Return the values that an instruction gives some of its fields."""
    return {field: _term_values(meaning.terms[field], field, episode) for field in fields}


def _goals_with(
    values: Mapping[str, Values], meaning: Meaning, episode: Episode
) -> tuple[Goal, ...]:
    """Return the scene's goals with the fields of a meaning and one of the values in each."""
    found: list[Goal] = []
    for goal in goals_of(episode):
        own = {value.field: value.value for value in values_of_goal(goal)}
        has_fields = not meaning.terms or own.keys() == meaning.terms.keys()
        if has_fields and all(own[field] in possible for field, possible in values.items()):
            found.append(goal)
    return tuple(found)


def _term_values(term: Term, field: str, episode: Episode) -> Values:
    """Return the values that a term gives a field: one if it is clear, none without operands."""
    if term.operation == "without":
        return _values_without(term.operands, field, episode)
    operand = _chosen_operand(term)
    if operand is None:
        return frozenset()
    if term.operation in ("double", "half", "step"):
        return frozenset([_reckoned(term, operand)]) if isinstance(operand, int) else frozenset()
    return _operand_values(operand, field, episode)


def _chosen_operand(term: Term) -> Operand | None:
    """Return the operand from which a value follows; None if there is none, or if it is open."""
    operands, rank = term.operands, term.rank
    if term.operation == "rank":
        return operands[rank - 1] if 1 <= rank <= len(operands) else None
    if term.operation == "other":
        is_pair = len(operands) == 2 and rank in (1, 2)  # noqa: PLR2004
        return operands[2 - rank] if is_pair else None
    return operands[0] if len(operands) == 1 else None


def _reckoned(term: Term, number: int) -> int:
    """Return the number that follows from another one."""
    if term.operation == "double":
        return 2 * number
    if term.operation == "half":
        return number // 2
    return number + term.step


def _values_without(operands: tuple[Operand, ...], field: str, episode: Episode) -> Values:
    """Return what is left of a field's values, or of the things, when some are set aside."""
    described = [operand for operand in operands if isinstance(operand, Described)]
    if not described:
        return _possible_values(field, episode).difference(operands)
    aside = [_described_thing(operand, episode) for operand in described]
    things = candidates_in(episode.scene, get_task(episode.task).commands.pointed)
    left = [thing for thing in things if thing not in aside]
    if None in aside or len(left) != 1:
        return frozenset()
    return _values_of_thing(left[0], field, episode)


def _operand_values(operand: Operand, field: str, episode: Episode) -> Values:
    """Return the values of a field for which an operand stands."""
    if not isinstance(operand, Described):
        return frozenset([operand])
    thing = _described_thing(operand, episode)
    return frozenset() if thing is None else _values_of_thing(thing, field, episode)


def _described_thing(described: Described, episode: Episode) -> SceneObject | None:
    """Return the only thing that fits a description; None if none is clear by the margin."""
    kind = get_task(episode.task).commands.pointed
    if described.kind == "place":
        return things_at(episode.scene, kind, described.frame).get(described.phrase)
    for found in spoken_clues(episode.scene, kind):
        if found.clue.words == described.phrase:
            return found.thing
    return None


def _values_of_thing(thing: SceneObject, field: str, episode: Episode) -> Values:
    """Return the values of a field by which a goal would ask for a thing: its color."""
    kind = get_task(episode.task).commands.pointed
    return frozenset(
        color
        for color in _possible_values(field, episode)
        if thing in things_of_color(episode.scene, kind, str(color))
    )


def _possible_values(field: str, episode: Episode) -> Values:
    """Return all values that the scene's goals have in the slot of a field."""
    slot = field.partition(".")[0]
    found: set[Value] = set()
    for goal in goals_of(episode):
        found.update(value.value for value in values_of_goal(goal) if value.slot == slot)
    return frozenset(found)
