"""Score shortcuts on instructions: how often a slot, and the whole goal, is guessed right.

Only the slots that the command (the last utterance) leaves out are scored, as the others need no
understanding of the context.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple, cast

from roboirg.core.episode import Goal, values_in
from roboirg.core.errors import InvalidValueError
from roboirg.language.instruction import Described, Meaning
from roboirg.language.instruction import hidden_slots as hidden_in
from roboirg.language.meaning import picked_operand
from roboirg.shortcuts.command_chance import blind_goals, right_share
from roboirg.shortcuts.goal_learner import InstructedEpisode
from roboirg.shortcuts.goal_vocabulary import Value
from roboirg.shortcuts.surface_rules import SURFACE_RULES
from roboirg.shortcuts.text_guess import TextGuess, goal_share, guess_goal, slot_share

CHANCE = "chance"
"""Name of the blind guess, among those of the rules."""


class ShortcutScore(NamedTuple):
    """The score of one shortcut on one instruction.

    Attributes:
        slots: for each slot that is scored, the expected share of its values that are right, 0 to
            1.
        goal: the probability that the whole goal is right, 0 to 1.
    """

    slots: Mapping[str, Fraction]
    goal: Fraction


def hidden_slots(instructed: InstructedEpisode) -> tuple[str, ...]:
    """Return the goal slots whose values the command does not name, in the order of the goal.

    *The red one is Bob's. Lift it twice.* -> ``("color",)``.
    """
    episode, instruction = instructed
    hidden = hidden_in(instruction, episode.goal)
    return _in_order(hidden, episode.goal)


def counted_slots(instructed: InstructedEpisode) -> tuple[str, ...]:
    """Return the goal slots by which an instruction is scored, in the order of the goal.

    They are those whose values have to be seen in the scene, which the metadata of the instruction
    list as ``touched``; without any, all that the command leaves out.
    """
    episode, instruction = instructed
    touched = cast("list[str]", instruction.metadata.get("touched", []))
    return _in_order(touched, episode.goal) or hidden_slots(instructed)


def _in_order(slots: Collection[str], goal: Goal) -> tuple[str, ...]:
    """Return some slots in the order in which a goal has them."""
    return tuple(slot for slot, _ in goal.slots if slot in slots)


def counted_positions(instructed: InstructedEpisode) -> Mapping[str, Sequence[int]]:
    """Return which values of each scored slot are scored, by their index in the slot.

    All are, unless the text names some of them: of *the container next to the button, and the one
    over the red cube* only the first color has to be found in the scene -> ``{"colors": [0]}``.
    """
    return {slot: _positions_in(slot, instructed) for slot in counted_slots(instructed)}


def _positions_in(slot: str, instructed: InstructedEpisode) -> Sequence[int]:
    """Return which values of a slot are scored, by their index in it; see `counted_positions`."""
    episode, instruction = instructed
    positions = range(len(values_in(episode.goal[slot])))
    # Amounts may be said in another order than the goal has, so their indices do not match.
    if len(positions) == 1 or "counts" in episode.goal.as_mapping():
        return positions
    meaning = instruction.meaning
    described = [index for index in positions if _is_described(meaning, f"{slot}.{index}")]
    return described or positions


def _is_described(meaning: Meaning | None, field: str) -> bool:
    """Return whether the words describe a thing by its place or history instead of its value.

    *the container next to the button* is described, *the red one* is not. `field` names the value
    in the meaning: ``"colors.1"`` is the second color. An instruction without a known meaning
    (None) describes nothing.
    """
    term = meaning.terms.get(field) if meaning else None
    return term is not None and isinstance(picked_operand(term), Described)


def score_chance(instructed: InstructedEpisode) -> ShortcutScore:
    """Return the expected score of a blind guess among the goals that command and scene allow.

    With three colors and nothing known, it gets a third of the slot right, and a third of the
    goals. Values that are not scored are known to the guesser; see `counted_positions`.
    """
    episode, instruction = instructed
    goals = blind_goals(instruction, episode)
    share = right_share(goals, episode)
    if share is None:
        raise InvalidValueError(f"{episode.key}: no meaning is known of {instruction.text!r}.")
    slots = {}
    for slot, positions in counted_positions(instructed).items():
        guesses = [values_in(goal[slot]) for goal in goals]
        slots[slot] = _slot_chance(guesses, values_in(episode.goal[slot]), positions)
    return ShortcutScore(slots, share)


def _slot_chance(
    guesses: Sequence[Sequence[Value]], meant: Sequence[Value], positions: Sequence[int]
) -> Fraction:
    """Return the expected share of right values if one of some guesses of a slot is drawn.

    Guesses red-blue, red-green and blue-red where red-blue is meant and position 1 is scored:
    position 0 is known, so only the first two are possible, and one of them is right -> 1/2.

    Args:
        guesses: values of the slot, all equally likely; the right one is among them.
        meant: the right values.
        positions: indices of the values that are scored; the guesser knows all others.
    """
    known = set(range(len(meant))).difference(positions)
    numbers_right = []  # of scored values, for each possible guess
    for guess in guesses:
        right = _right_positions(guess, meant)
        if known <= right:
            numbers_right.append(len(right) - len(known))
    return Fraction(sum(numbers_right), len(numbers_right) * len(positions))


def _right_positions(guess: Sequence[Value], meant: Sequence[Value]) -> set[int]:
    """Return at which indices a guess has the right value; it may be of another length."""
    right = set()
    for index, (value, wanted) in enumerate(zip(guess, meant, strict=False)):
        if value == wanted:
            right.add(index)
    return right


def score_guess(guess: TextGuess, instructed: InstructedEpisode) -> ShortcutScore:
    """Return the score of a guess: the share of each scored slot, and of the goal, that is right.

    Red or blue, where red is right, scores 1/2 in the slot ``color``.
    """
    episode, _ = instructed
    slots = {}
    for slot, positions in counted_positions(instructed).items():
        slots[slot] = slot_share(guess, slot, episode.goal[slot], positions)
    return ShortcutScore(slots, goal_share(guess, episode))


def score_rule(rule: str, instructed: InstructedEpisode) -> ShortcutScore:
    """Return the score of a surface rule, such as ``first-mention``, on an instruction.

    The rule sees only the text.
    """
    episode, instruction = instructed
    return score_guess(guess_goal(rule, instruction.text, episode.task), instructed)


def rule_scores(instructed: InstructedEpisode) -> dict[str, ShortcutScore]:
    """Return the scores of a blind guess (``chance``) and of all surface rules, by name."""
    scores = {CHANCE: score_chance(instructed)}
    for rule in SURFACE_RULES:
        scores[rule] = score_rule(rule, instructed)
    return scores
