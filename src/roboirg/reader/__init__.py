"""The interpreter: read a command about a scene, and find the goals of the task that fit it.

It reads commands that state their values, in our words or in other people's. It does not read what
comes before a command. `docs/references.md` says more.

A text is split into sentences (`tokens`). Each is parsed into clauses, a verb with its arguments,
and the words that no rule reads (`command`). The last sentences that are commands make up the
*command*; what is before them is *remarks*. The clauses of the command then leave some of the
scene's goals (`constraints`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from roboirg.core.episode import Goal, Scene, SlotValue, values_in
from roboirg.reader.command import Clause, ParsedSentence, parse_sentence
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

    *Lift the red cube twice* gives the goal with ``color`` red and ``repeats`` 2. It reads commands
    that state their values, in our words or in other people's as far as it knows these. What comes
    before the command is not read, so a command that points back at it is refused. What an
    instruction means by declaration is in `roboirg.language.meaning`.

    Args:
        text: the command, or a whole text that ends with it.
        scene: what the robot may know: objects, colors, positions, what moves.
        task: name of the task.

    Raises:
        UnknownNameError: there is no such task.
    """
    goals = get_task(task).goals(scene)
    command, remarks = _split_off_command(split_sentences(text))
    unread = [sentence for sentence in command if not sentence.is_command]
    clauses: list[Clause] = []
    for sentence in command:
        clauses += sentence.clauses
    if unread or not _ask_for_something(clauses):
        return _without_goals(unread)
    return _interpret_clauses(clauses, remarks, goals, scene)


def _interpret_clauses(
    clauses: Sequence[Clause], remarks: Iterable[Sentence], goals: Sequence[Goal], scene: Scene
) -> Interpretation:
    """Return which of some goals of a scene fit the clauses of a command, all of which were read.

    `remarks` are the sentences before the command.
    """
    # "Lift it." means once only if nothing before it says how often.
    once_by_default = not any(map(_speaks_of_number, remarks))
    try:
        fitting = fitting_goals(clauses, goals, scene, once_by_default=once_by_default)
    except UnfitWordsError as error:
        return Interpretation((), (str(error),))
    return Interpretation(fitting, _complaints_about(fitting))


def _ask_for_something(clauses: Iterable[Clause]) -> bool:
    """Return whether any clause has a verb, or a thing to handle: *the red cube, please*."""
    return any(clause.verb or clause.has("thing", "each") for clause in clauses)


def _complaints_about(fitting: Sequence[Goal]) -> tuple[str, ...]:
    """Return why a command does not mean a single goal, in words; empty if it does.

    Two goals that differ in color give ``("leaves color open: it can be red or blue",)``.

    Args:
        fitting: the goals that fit the command.
    """
    if not fitting:
        return ("no goal of the task fits everything that the text says",)
    if len(fitting) > 1:
        return (_complaint_of_open_slots(fitting),)
    return ()


class _SplitText(NamedTuple):
    """A text as its command and what comes before.

    Attributes:
        command: the last sentences that are commands, parsed.
        remarks: the sentences before them.
    """

    command: list[ParsedSentence]
    remarks: list[Sentence]


def _split_off_command(sentences: Sequence[Sentence]) -> _SplitText:
    """Return a text as its command, the last sentences that ask for something, and its remarks.

    *It is late. Lift the red cube. Then press the button. Thank you.* has the command *Lift the red
    cube. Then press the button.* and the remark *It is late.*

    The sentences are read from the last one. The first one found with words that no rule reads ends
    the command. It belongs to the command if nothing but thanks comes after it or if it asks to
    handle a thing, *lift the big cube*, and counts as a remark as well.
    """
    command: list[ParsedSentence] = []
    for position in range(len(sentences) - 1, -1, -1):
        words = sentences[position]
        parsed = parse_sentence(words)
        if not parsed.clauses and not parsed.unread:
            continue  # "Thank you."
        if parsed.is_command:
            command.insert(0, parsed)
            continue

        # This sentence has words that are not read: the command begins after it or in it.
        remarks = list(sentences[:position])
        after_colon = None if command else _command_after_colon(words)
        if after_colon is not None:
            remark = words[: -len(after_colon) - 1]
            return _SplitText([parse_sentence(after_colon)], [*remarks, remark])
        if not command or parsed.is_like_command:
            command.insert(0, parsed)
        return _SplitText(command, [*remarks, words])
    return _SplitText(command, [])


def _command_after_colon(words: Sentence) -> Sentence | None:
    """Return the words after the last colon of a sentence if they are a command; else None.

    *My task for you: lift the red cube* -> *lift the red cube*. None also if there is a color
    before the colon that the command does not repeat, *the red one: lift it*, as the words before
    would be part of what is asked.
    """
    if ":" not in words[1:]:
        return None
    colon = len(words) - 1 - words[::-1].index(":")
    command = words[colon + 1 :]
    colors = {color_of(word.removesuffix("'s")) for word in words[:colon]}
    colors.discard(None)  # of words that are no color
    is_repeated = colors.issubset(map(color_of, command))
    return command if is_repeated and parse_sentence(command).is_command else None


def _speaks_of_number(words: Iterable[str]) -> bool:
    """Return whether a remark has a number, or words such as *again* that may say how often."""
    return any(word in _COUNTING_WORDS or word in ADVERBS or number_of(word) for word in words)


def _without_goals(sentences: Sequence[ParsedSentence]) -> Interpretation:
    """Return the result for a text that is not understood: no goals, and why, in sentences.

    *Stack the cube* gives ``finds no command`` and ``does not know the word "stack"``.

    Args:
        sentences: those of the command that are not read to the end; none for an empty text.
    """
    unread: dict[str, None] = {}  # each word once, in the order of speaking
    has_verb = False
    for sentence in sentences:
        unread |= dict.fromkeys(sentence.unread)
        if any(clause.verb for clause in sentence.clauses):
            has_verb = True
    known = [word for word in unread if is_known(word)]
    unknown = tuple(word for word in unread if not is_known(word))

    complaints = []
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
    slots = []
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
