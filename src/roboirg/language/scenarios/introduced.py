"""What a scenario's words can name: the values that its slots stand for, and how they are said.

- *introduced value*: a value with its type, which says how it is put into words; a place or a
  person has words of its own.
- *kind*: that type: ``color``, ``number``, ``visit``, ``place``, ``clue``, ``person`` …
- *referent*: the value for which words stand that point back.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from roboirg.language.instruction import REFERENCE, Expression
from roboirg.language.number_words import agreeing_number, cardinal, ordinal, plural, times
from roboirg.language.phrases import Phrase, antecedent, listed, plain
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.scenarios.markup import Slot

FORMER: tuple[Expression, ...] = ("former", "latter")
RANKS: tuple[Expression, ...] = ("first", "second", "third")
_NUMBER_FORMS: Mapping[str, Callable[[int], str]] = {
    "ordinal": ordinal,
    "cardinal": cardinal,
    "times": times,
}
"""How a number is said in a form; any other form is a noun to be counted."""


class IntroducedValue(NamedTuple):
    """A value to be named.

    Attributes:
        slot: of its mentions; empty for words that are no mention.
        kind: type of the value: ``color``, ``number``, ``visit``, ``place`` …
        value: of its mentions.
        words: how it is said; empty for the usual words of its kind.
        form: the only form in which a place can be said, ``spot`` or None.
    """

    slot: str
    kind: str
    value: str | int
    words: str = ""
    form: str | None = None

    def said(self, form: str | None) -> str:
        """Return the words for the value in a form, or as a number of a noun.

        For 3: ``ordinal`` gives *third*, ``times`` *three times*, the noun ``lap`` *three laps*.
        Texts have no other forms than their words.
        """
        # Colors, places and clues have no other forms; numbers may have words of their own.
        if isinstance(self.value, str) or (self.words and form is None):
            return self.words or str(self.value)
        if form is None:
            form = "ordinal" if self.kind in ("visit", "placement") else "cardinal"
        if form in _NUMBER_FORMS:
            return _NUMBER_FORMS[form](self.value)
        noun = form if self.value == 1 else plural(form)
        return f"{cardinal(self.value)} {noun}"


Values = Mapping[str, tuple[IntroducedValue, ...]]
"""By slot: one value, or several."""


class PointedValue(NamedTuple):
    """What words that point back stand for: the slot and the value of their mentions."""

    slot: str
    value: str | int


class Ranked(NamedTuple):
    """Values of which one is named by its position in the list.

    Attributes:
        introduced: the values, with the position as ``rank``.
        expression: the class of words for the position, *the former*.
    """

    introduced: Introduced
    expression: Expression


@dataclass(frozen=True, slots=True)
class Introduced:
    """The values that the words of an episode can name, by slot.

    Attributes:
        values: one or several for each slot; those of a list in its order.
    """

    values: Values

    def count(self, controller: str) -> int:
        """Return the number with which words agree: that of a slot, or how many values it has."""
        return agreeing_number([introduced.value for introduced in self.values[controller]])

    def phrase(self, slot: Slot) -> Phrase:
        """Return the words for a slot, each value a mention: *red and blue* for ``{list}``.

        Several values are joined by *and*; ``{list:or}`` and ``{list:nor}`` join them by that word.
        """
        joint = "and"
        form = slot.form
        if form in ("or", "nor"):
            joint = form
            form = None
        phrases: list[Phrase] = []
        for value in self.values[slot.name]:
            words = value.said(form)
            if value.slot:
                phrases.append(antecedent(words, value.slot, value.value))
            else:
                phrases.append(plain(words))
        return listed(phrases, joint)

    def referent(self, name: str) -> PointedValue:
        """Return the slot and value for which words stand that point back at a slot.

        *them*, for the colors red and blue, stands for ``red and blue``. Values of different slots
        have the slot ``reference``.
        """
        values = self.values[name]
        if len(values) == 1:
            return PointedValue(values[0].slot, values[0].value)
        slots = {value.slot for value in values}
        slot = slots.pop() if len(slots) == 1 else REFERENCE
        return PointedValue(slot, " and ".join(str(value.value) for value in values))

    def ranked(self, name: str, *, ordinals: bool) -> Ranked:
        """Return the values with one more: words for the position of a slot's value in the list.

        Of two values it is *the former* or *the latter*, of three *the second one*. With
        `ordinals`, words of two values are also of the class of *the first*.
        """
        members = [member.value for member in self.values["list"]]
        position = members.index(self.values[name][0].value)
        words = f"the {RANKS[position]} one"
        expression = RANKS[position]
        if len(members) == len(FORMER):
            words = f"the {FORMER[position]}"
            if not ordinals:
                expression = FORMER[position]
        rank = IntroducedValue("", "rank", position + 1, words)
        return Ranked(self.with_values(rank=(rank,)), expression)

    def with_values(self, **added: tuple[IntroducedValue, ...]) -> Introduced:
        """Return the same with further slots."""
        return Introduced({**self.values, **added})


class Offer(NamedTuple):
    """One way to lead to the goal, for scenarios to say.

    Attributes:
        fields: of the command, that point back.
        values: what is introduced, by slot; those of the goal are known anyway.
        notes: entries of the metadata.
        listed: the slot of which a list is introduced; empty if none is, None for any.
        remark: the name of the remark that chooses; empty if none does.
    """

    fields: Collection[str]
    values: Values
    notes: Mapping[str, object]
    listed: str | None = ""
    remark: str = ""


def named(value: GoalValue) -> IntroducedValue:
    """Return a value of the goal, to be named."""
    return IntroducedValue(value.slot, value.slot_type, value.value)


def goal_values(request: InstructionRequest, first: int = 0) -> Values:
    """Return the goal's values by slot, ``colors``, and one by one by field, ``colors.0``.

    A goal of red and blue gives ``colors``, both, ``colors.0``, red, and ``colors.1``, blue.
    Amounts, numbers of cubes by color, have no order: the one with the index `first` gets the
    fields of the first. Words that point back at them stand for their colors.
    """
    values: dict[str, tuple[IntroducedValue, ...]] = {}
    for value in request.goal_values:
        values[value.slot] = tuple(map(named, request.values_in(value.slot)))
        values[value.field] = (named(value),)
    if request.values_of("amount"):
        for slot in ("colors", "counts"):
            in_order = list(values[slot])
            in_order.insert(0, in_order.pop(first))  # this one to the front
            values |= several(slot, in_order)
        values["amounts"] = values["colors"]
    return values


def several(name: str, values: Sequence[IntroducedValue]) -> Values:
    """Return the slots of several values: all together, ``list``, and one by one, ``list.0``."""
    slots = {name: tuple(values)}
    for at, value in enumerate(values):
        slots[f"{name}.{at}"] = (value,)
    return slots
