"""The data of an instruction: utterances with their stages, and the mentions in them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, get_args

from roboirg.core.episode import Goal
from roboirg.language.landmarks import Frame

Form = Literal["implicit", "resolved"]
UtteranceStage = Literal["introduction", "reinforcement", "distractor", "cue", "command"]
Role = Literal["antecedent", "anaphor"]
Expression = Literal[
    "it", "them", "one", "former", "latter", "first", "second", "third",
    "that", "then", "there", "pair", "each", "other",
]  # fmt: skip

FORMS: tuple[Form, ...] = get_args(Form)
REFERENCE = "reference"
"""Slot of the mentions that only lead to the goal, such as a number to count from."""


@dataclass(frozen=True, slots=True)
class Utterance:
    """One turn of the speaker.

    Attributes:
        stage: its part in the text; the last one is the ``command``.
        text: its words, *Red is nice.*
    """

    stage: UtteranceStage
    text: str


@dataclass(frozen=True, slots=True)
class Mention:
    """Characters of an utterance that name a value (antecedent) or point back at one (anaphor).

    In *Red is nice.*, *Red* is an antecedent of the slot ``color``; in *Lift it.*, *it* is an
    anaphor with the value ``red``.

    Attributes:
        utterance: index of the utterance.
        start: first character of the span in that utterance's text.
        end: one past the last character.
        role: antecedent or anaphor.
        expression: class of an anaphor, ``it``; None for an antecedent.
        slot: name of the goal slot, or ``reference`` for values that only lead to the goal: two
            colors or moments, the chosen one of them, the quantity or position to count from.
        value: the referent: for a goal slot one of the goal's values, or all of them
            (``red and green``) for a plural.
    """

    utterance: int
    start: int
    end: int
    role: Role
    expression: Expression | None
    slot: str
    value: str | int


class Described(NamedTuple):
    """A thing or a number that is described instead of named; the scene decides which one it is.

    Attributes:
        phrase: the description, as it was said.
        kind: whether it names a place on the table, or what there is to see.
        frame: whose left and right a place means.
    """

    phrase: str
    kind: Literal["place", "clue"]
    frame: Frame


class Term(NamedTuple):
    """How the value of a field of the command follows from what was said.

    Attributes:
        operation: ``same``, the only operand; ``rank``, the operand of a position; ``other``, of
            two operands the one without that position; ``without``, what the operands leave of all
            that the scene has; ``double`` and ``half`` of a number; ``step``, a number and some
            more or less.
        operands: what was said, in the order of speaking.
        rank: the position, from 1; 0 without one.
        step: added to the number; negative for less.
    """

    operation: Literal["same", "rank", "other", "without", "double", "half", "step"]
    operands: tuple[str | int | Described, ...]
    rank: int = 0
    step: int = 0


class Meaning(NamedTuple):
    """What an instruction means by declaration; `roboirg.language.meaning` finds the goals.

    Attributes:
        terms: by field of the command; empty if the words say nothing about the goal.
        settled: the fields that the last utterance settles alone, as it has all that their terms
            need.
        goals: of a whole sentence without fields, all that it can mean; empty if terms say it.
        agrees: by slot of the goal, whether the last utterance speaks of one (*once for that
            take*) or of several (*once for each take*); only where its words agree with it.
    """

    terms: Mapping[str, Term]
    settled: frozenset[str] = frozenset()
    goals: tuple[Goal, ...] = ()
    agrees: Mapping[str, bool] = {}


@dataclass(frozen=True, slots=True)
class Instruction:
    """Everything said to the robot in one episode.

    Attributes:
        task: name of the task.
        episode: the episode's key, ``task/split/index``.
        setting: name of the setting, for example ``"direct"``.
        form: ``implicit``, or ``resolved``, in which the command names the referents of its
            referring expressions. The explicit setting is its own resolved form.
        utterances: in the order of speaking; the last one is the command.
        mentions: in the order of their position.
        metadata: reasoning pattern, context stages, landmarks, frame of reference, template
            ids, language version; plain JSON values.
        meaning: what it means by declaration; None if none is declared.
    """

    task: str
    episode: str
    setting: str
    form: Form
    utterances: tuple[Utterance, ...]
    mentions: tuple[Mention, ...] = ()
    metadata: Mapping[str, object] = field(default_factory=dict)
    meaning: Meaning | None = None

    @property
    def text(self) -> str:
        """The prompt for policies: the texts of all utterances, joined by spaces."""
        return " ".join(utterance.text for utterance in self.utterances)

    @property
    def turns(self) -> tuple[str, ...]:
        """The text of each utterance, in the order of speaking."""
        return tuple(utterance.text for utterance in self.utterances)

    @property
    def command(self) -> str:
        """The text of the last utterance, which states the task."""
        return self.utterances[-1].text

    def span(self, mention: Mention) -> str:
        """Return the words of a mention of this instruction: ``it``."""
        return self.utterances[mention.utterance].text[mention.start : mention.end]


def command_expressions(mentions: Iterable[Any], last: int) -> tuple[str, ...]:
    """Return the classes of the words that point back in the last utterance, each once.

    *Lift it there.* gives ``("it", "there")``. Such words in earlier utterances do not count, as
    they add no referent.

    Args:
        mentions: of an instruction, or of its record.
        last: index of the last utterance, the command.
    """
    of_command = [mention.expression for mention in mentions if mention.utterance == last]
    return tuple(dict.fromkeys(name for name in of_command if name is not None))


def hidden_slots(instruction: Instruction, goal: Goal) -> frozenset[str]:
    """Return the slots of the goal whose values the last utterance, the command, does not name.

    The earlier utterances have to give them. Of *Red is nice. Lift it twice.*, a goal of ``color``
    and ``repeats``, that is ``color``. Empty for an instruction that is a whole sentence of a
    wording file.
    """
    if instruction.meaning is not None and instruction.meaning.goals:
        return frozenset()  # a whole sentence
    command_index = len(instruction.utterances) - 1
    hidden = set(goal.as_mapping())
    for mention in instruction.mentions:
        if mention.utterance == command_index and mention.role == "antecedent":
            hidden.discard(mention.slot)
    return frozenset(hidden)
