"""The interpreter: read a command about a scene, and find the goals of the task that fit it.

It reads commands that state their values, in our words or in other people's. It does not read what
comes before a command. `docs/interpreter.md` says more.

A text is split into *sentences* (`tokens`). Each becomes a *reading* (`command`): *acts*, such as
to lift, with what is said of them, and the words that no rule reads. The last run of readings that
command is the *command*, and what is before it *remarks*. The acts then leave some of the scene's
*goals* (`constraints`).
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from roboirg.core.episode import Goal, Scene, SlotValue, values_in
from roboirg.reader.command import Act, Reading, read_command
from roboirg.reader.constraints import UnfitWordsError, fitting_goals
from roboirg.reader.tokens import ADVERBS, Sentence, color_of, number_of, split_sentences, word_set
from roboirg.reader.vocabulary import UNSEEN_COLORS, is_known
from roboirg.tasks import get_task

__all__ = ["Interpretation", "interpret"]

_COUNTING_WORDS = word_set("time times often many more again each every both half double")
"""Words of a remark that may say how often to do what the command asks for."""


class Interpretation(NamedTuple):
    """The result of reading a text.

    Attributes:
        goals: every goal that fits the text. One if the command states everything; several if it
            leaves something open; none if it contradicts itself or the scene, gives no command, or
            has words that the interpreter does not read.
        not_understood: complaints in plain sentences; none if there is one goal.
        unknown_words: the words of the command that the interpreter does not know, in lower case
            and American spelling, each once.
    """

    goals: tuple[Goal, ...]
    not_understood: tuple[str, ...]
    unknown_words: tuple[str, ...] = ()


def interpret(text: str, scene: Scene, task: str) -> Interpretation:
    """Return all goals of a task that fit a command in plain English: the last sentences of a text.

    It reads commands that state their values, *Lift the red cube twice*, in our words or in other
    people's as far as it knows these. What comes before the command is not read, so a command that
    points back at it is refused. What an instruction means by declaration is in
    `roboirg.language.meaning`.

    Args:
        text: the command, or a whole text that ends with it.
        scene: what the robot may know: objects, colors, positions, what moves.
        task: name of the task.

    Raises:
        UnknownNameError: there is no such task.
    """
    goals = _possible_goals(scene, task)
    split_text = _split_off_command(split_sentences(text))
    unread = [reading for reading in split_text.command if not reading.is_command]
    acts: list[Act] = []
    for reading in split_text.command:
        acts += reading.acts
    if unread or not _ask_for_something(acts):
        return _without_goals(unread)
    # "Lift it." means once only if nothing before it says how often.
    is_alone = not any(map(_speaks_of_number, split_text.remarks))
    try:
        fitting = fitting_goals(acts, goals, scene, is_alone=is_alone)
    except UnfitWordsError as error:
        return Interpretation((), (str(error),))
    return Interpretation(fitting, _complaints_about(fitting))


def _ask_for_something(acts: Iterable[Act]) -> bool:
    """Return whether any of some acts has a verb, or a thing to handle."""
    return any(act.verb or act.has("thing", "each") for act in acts)


def _complaints_about(fitting: Sequence[Goal]) -> tuple[str, ...]:
    """Return why a command does not mean a single goal; empty if one fits it."""
    if not fitting:
        return ("no goal of the task fits everything that the text says",)
    if len(fitting) > 1:
        return (_complaint_of_open_slots(fitting),)
    return ()


class _SplitText(NamedTuple):
    """A text as its command and what comes before.

    Attributes:
        command: the last run of sentences that command, as they were read.
        remarks: the sentences before it.
    """

    command: list[Reading]
    remarks: list[Sentence]


@functools.lru_cache(maxsize=64)
def _possible_goals(scene: Scene, task: str) -> tuple[Goal, ...]:
    # Cached, because a scene is read about in many settings.
    return get_task(task).goals(scene)


def _split_off_command(sentences: Sequence[Sentence]) -> _SplitText:
    """Return a text as its command, the last sentences that ask for acts, and what is before.

    *It is late. Lift the red cube. Then press the button. Thank you.* has the command *Lift the red
    cube. Then press the button.* and the remark *It is late.* The sentences are read from the last
    one. One with words that no rule reads ends the run. It belongs to the command if it is the last
    one or asks to handle a thing, and counts as a remark as well.
    """
    command: list[Reading] = []
    for position in range(len(sentences) - 1, -1, -1):
        words = sentences[position]
        reading = read_command(words)
        if not reading.acts and not reading.unread:
            continue  # "Thank you."
        if reading.is_command:
            command.insert(0, reading)
            continue

        # This sentence has words that are not read: the command begins after it or in it.
        remarks = list(sentences[:position])
        if not command:
            lead_in = _split_at_colon(words)
            after_colon = read_command(lead_in.command)
            if lead_in.remark and after_colon.is_command:
                return _SplitText([after_colon], [*remarks, lead_in.remark])
        if not command or reading.is_like_command:
            command.insert(0, reading)
        return _SplitText(command, [*remarks, words])
    return _SplitText(command, [])


class _LeadIn(NamedTuple):
    """A sentence as the words before a colon, empty if there are none, and the rest."""

    remark: Sentence
    command: Sentence


def _split_at_colon(words: Sentence) -> _LeadIn:
    """Return a sentence as the words before its last colon, a remark, and the command after it.

    *My task for you: lift the red cube* is split at the colon. A sentence without a colon is all
    command, and so is one with a color before the colon that the words after it do not repeat.
    """
    unsplit = _LeadIn((), words)
    if ":" not in words:
        return unsplit
    colon = len(words) - 1
    while words[colon] != ":":
        colon -= 1
    remark = words[:colon]
    command = words[colon + 1 :]
    colors = {color_of(word.removesuffix("'s")) for word in remark}
    colors.discard(None)  # which other words give
    if not colors.issubset(map(color_of, command)):
        return unsplit
    return _LeadIn(remark, command)


def _speaks_of_number(words: Iterable[str]) -> bool:
    """Return whether a remark has a number, or words such as *again* that may say how often."""
    return any(word in _COUNTING_WORDS or word in ADVERBS or number_of(word) for word in words)


def _without_goals(readings: Sequence[Reading]) -> Interpretation:
    """Return the result for a text that is not understood: no goals, and complaints in sentences.

    `readings` are the sentences of the command with words that no rule reads; empty if there is
    none.
    """
    unread: dict[str, None] = {}  # each word once, in the order of speaking
    has_verb = False
    for reading in readings:
        unread |= dict.fromkeys(reading.unread)
        has_verb = has_verb or any(act.verb for act in reading.acts)
    known = [word for word in unread if is_known(word)]
    unknown = tuple(word for word in unread if not is_known(word))

    complaints: list[str] = []
    if not has_verb:
        complaints.append("finds no command")
    for word in unknown:
        kind = "color" if word in UNSEEN_COLORS else "word"
        complaints.append(f'does not know the {kind} "{word}"')
    if known:
        complaints.append(f'does not understand "{" ".join(known)}"')
    if not complaints:
        complaints.append('does not read what "it" points back at')
    return Interpretation((), tuple(complaints), unknown)


def _complaint_of_open_slots(goals: Sequence[Goal]) -> str:
    """Return the complaint about a command that several goals fit.

    *leaves color open: it can be red or blue* names each slot in which the goals differ, and the
    values of the first of these slots.
    """
    slots: list[str] = []
    choices: list[str] = []
    for slot, _ in goals[0].slots:
        values = dict.fromkeys(goal[slot] for goal in goals)
        if len(values) > 1:
            slots.append(slot)
            if not choices:
                choices = [_in_words(value) for value in values]
    return f"leaves {' and '.join(slots)} open: it can be {' or '.join(choices)}"


def _in_words(value: SlotValue) -> str:
    """Return what a slot holds in words: ``3``, ``red and blue``."""
    return " and ".join(map(str, values_in(value)))
