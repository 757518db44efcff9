"""The interpreter: find all goals that fit a text about a scene.

It is independent of the generator: it uses none of its templates, constants or metadata. It knows
as much English as the benchmark needs, the objects on the table, what moves, what the video
shows, and which goals a task can have. `docs/interpreter.md` explains its parts.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from roboirg.core.episode import Goal, Scene, SlotValue
from roboirg.reader.command import is_command, read_command
from roboirg.reader.comprehension import (
    CALCULATIONS,
    ComprehensionGap,
    find_gaps,
    is_unknown_command,
)
from roboirg.reader.constraints import goal_constraints
from roboirg.reader.discourse_context import names_camera, read_discourse, read_remark
from roboirg.reader.leftovers import left_over
from roboirg.reader.negations import NOT_AT, is_negated_command, unread_negations
from roboirg.reader.observations import observe
from roboirg.reader.paraphrases import paraphrased
from roboirg.reader.pick_order import in_order
from roboirg.reader.places import place_mentions
from roboirg.reader.reference_resolution import ReferenceResolver
from roboirg.reader.repetitions import added_up
from roboirg.reader.selections import (
    read_selection,
    unread_change,
    unsettled_choice,
    with_selection,
)
from roboirg.reader.temporal_relations import mentioned_times
from roboirg.reader.tokens import Sentence, split_sentences
from roboirg.reader.vocabulary import VERBS
from roboirg.tasks import get_task

__all__ = ["Interpretation", "interpret"]

_CALLS = {("get", word) for word in ("ready", "set", "going", "started")}
"""How sentences begin that call for attention, with a verb of commands."""


class Interpretation(NamedTuple):
    """The result of reading a text.

    Attributes:
        goals: every goal that fits the text. One if the text says everything; none if it
            contradicts itself or the scene, gives no command, or gives one that the interpreter
            does not understand to the end.
        not_understood: complaints in plain sentences.
        unknown_words: the words of the command that the interpreter does not know or cannot use,
            in lower case and American spelling, each once.
    """

    goals: tuple[Goal, ...]
    not_understood: tuple[str, ...]
    unknown_words: tuple[str, ...] = ()


def interpret(text: str, scene: Scene, task: str) -> Interpretation:
    """Return all goals of a task that fit a text: a whole prompt, its command, or any other text.

    Args:
        text: the prompt.
        scene: what the robot may know: objects, colors, positions, what moves; and from the
            video what was done, and which cube is under which container.
        task: name of the task.

    Raises:
        UnknownNameError: there is no such task.
    """
    candidates = _possible_goals(scene, task)
    said = tuple(_leads_apart(paraphrased(split_sentences(text))))
    sentences, unclear = observe(said, scene, candidates)
    if unclear:
        return Interpretation((), unclear)
    first, last = _command_span(sentences)
    gaps = _command_gaps(sentences, first, last)
    if gaps:
        return Interpretation(
            (),
            _distinct(gap.complaint for gap in gaps),
            _distinct(word for gap in gaps for word in gap.words),
        )
    before = sentences[:first]
    introduced = read_discourse(before)
    context = with_selection(introduced, before)
    slots = candidates[0].as_mapping() if candidates else {}
    words, unread = _settled(_joined(sentences[first:last]), scene, slots)
    if unread:
        return Interpretation((), tuple(f'does not understand "{one}"' for one in unread))
    command = read_command(words)
    open_choice = unsettled_choice(introduced, context, before, command.text)
    unused = (*left_over(command, tuple(slots)), *([open_choice] if open_choice else []))
    if unused:
        return Interpretation((), unused)
    times = context.times | mentioned_times(command.text)
    resolver = ReferenceResolver(scene, context, times, mirrored=names_camera(words))
    constraints = goal_constraints(candidates, command, resolver)
    goals = tuple(goal for goal in candidates if all(limit.fits(goal) for limit in constraints))
    complaints = list(resolver.complaints)
    if candidates and not goals:
        unmet = [limit for limit in constraints if not any(map(limit.fits, candidates))]
        complaints += [limit.complaint for limit in unmet]
        complaints = complaints or ["no goal of the task fits everything that the text says"]
    if len(goals) > 1 and not complaints:
        complaints = [_left_open(goals)]
    return Interpretation(goals, _distinct(complaints))


def _settled(
    words: Sentence, scene: Scene, slots: Mapping[str, SlotValue]
) -> tuple[Sentence, tuple[str, ...]]:
    """Return a command with its picks in order and its repetitions added up, and what is unread."""
    order = ""
    if "colors" in slots and "counts" not in slots:
        words, order = in_order(words)
    words, again = added_up(words, repeats="repeats" in slots, seen=bool(scene.past))
    return words, tuple(filter(None, (again, order)))


def _left_open(goals: Sequence[Goal]) -> str:
    """Return the complaint that the words leave more than one goal."""
    values = {slot: list(dict.fromkeys(goal[slot] for goal in goals)) for slot, _ in goals[0].slots}
    left = {slot: found for slot, found in values.items() if len(found) > 1}
    found = next(iter(left.values()))
    named = (" and ".join(map(str, one)) if isinstance(one, tuple) else str(one) for one in found)
    return f"leaves {' and '.join(left)} open: it can be {' or '.join(named)}"


@functools.lru_cache(maxsize=64)
def _possible_goals(scene: Scene, task: str) -> tuple[Goal, ...]:
    # Cached, because a scene is read about in many settings.
    return get_task(task).goals(scene)


def _leads_apart(sentences: Iterable[Sentence]) -> Iterator[Sentence]:
    """Yield sentences, with the words before the colon of *So let's begin: lift it* apart.

    These are a remark of their own, which may choose: *I'd take the latter: lift it*. If they name
    a value, what follows must name it again: *Two, not three: lift it twice*.
    """
    for words in sentences:
        at = words.index(":") if ":" in words else 0
        lead, rest = words[:at], words[at + 1 :]
        leads = lead and rest and rest[0] in VERBS | {"first"} and not _commands(lead)
        if leads and all(map(_repeats, _values(lead), _values(rest))):
            yield lead
            yield rest
        else:
            yield words


def _values(words: Sentence) -> tuple[frozenset[object], ...]:
    remark = read_remark(words)
    kinds = (remark.colors, remark.numbers, remark.positions, remark.places)
    return tuple(map(frozenset, kinds))


def _repeats(before: frozenset[object], after: frozenset[object]) -> bool:
    return not before or (bool(after) and after <= before)


def _commands(words: Sentence) -> bool:
    """Return whether a sentence gives a command, understood or not."""
    if words[:2] in _CALLS:
        return False
    if is_command(words) or is_negated_command(words):
        return True
    # "Leave out the former" chooses; it is no command with an unknown verb.
    return is_unknown_command(words) and read_selection(words) is None


def _command_span(sentences: tuple[Sentence, ...]) -> tuple[int, int]:
    """Return where the last run of commanding sentences begins and ends."""
    last = len(sentences)
    while last and not _commands(sentences[last - 1]):
        last -= 1
    first = last
    while first and _commands(sentences[first - 1]):
        first -= 1
    return (first, last) if last else (len(sentences), len(sentences))


def _command_gaps(sentences: tuple[Sentence, ...], first: int, last: int) -> list[ComprehensionGap]:
    """Return what the interpreter does not understand of the command.

    It goes from the sentence `first` to the one before `last`; there is none if they are the same.
    """
    negated = [words for words in sentences[:first] if is_negated_command(words)]
    following = [words for words in sentences[last:] if _matters(words)]
    gaps = [] if first < last else [ComprehensionGap("finds no command")]
    gaps += [
        ComprehensionGap(f'does not read what follows the command: "{" ".join(words)}"')
        for words in following
    ]
    gaps += [
        # Its numbers are none of the goal's.
        ComprehensionGap(f'does not calculate: "{" ".join(words)}"')
        for words in sentences[:first]
        if not CALCULATIONS.isdisjoint(words)
    ]
    gaps += [
        ComprehensionGap(f'does not understand what "{change}" changes')
        for words in sentences
        if (change := unread_change(words, sentences[first:last]))
    ]
    gaps += [
        ComprehensionGap(f'does not understand where something is not: "{" ".join(words)}"')
        for words in sentences
        for place in place_mentions(words)
        if NOT_AT.search(" ".join(words[: place.start]))
    ]
    for words in (*negated, *(sentences[first:last] or sentences[-1:]), *following):
        gaps += find_gaps(words)
    return gaps


def _matters(words: Sentence) -> bool:
    """Return whether a sentence after the command may change what it asks for."""
    remark = read_remark(words)
    if remark.dismissed:
        return False
    named = remark.colors or remark.numbers or remark.positions or remark.moments or remark.places
    return bool(named or unread_negations(words)) or not VERBS.isdisjoint(words)


def _joined(sentences: Iterable[Sentence]) -> Sentence:
    """Return the words of all sentences, with a comma after each sentence."""
    return tuple(word for words in sentences for word in (*words, ","))


def _distinct(texts: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(texts))
