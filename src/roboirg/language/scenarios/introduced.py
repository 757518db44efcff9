"""What a scenario's words can name: the values that its slots stand for, and how they are said."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from roboirg.language.instruction import REFERENCE, Expression
from roboirg.language.number_words import agreeing_number, cardinal, ordinal, plural, times
from roboirg.language.phrases import Mentionable, MentionedValue, Phrase, antecedent, listed, plain
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.scenarios.markup import Slot
from roboirg.language.templates.derivations import MOMENTS

FORMER: tuple[Expression, ...] = ("former", "latter")
RANKS: tuple[Expression, ...] = ("first", "second", "third")


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
        """Return the words for the value in a form, or as a number of a noun."""
        if isinstance(self.value, str) or (self.words and form is None):
            return self.words or MOMENTS.get(str(self.value), str(self.value))
        if form is None:
            form = "ordinal" if self.kind in ("visit", "placement") else "cardinal"
        known = {"ordinal": ordinal, "cardinal": cardinal, "times": times}.get(form)
        if known is not None:
            return known(self.value)
        return f"{cardinal(self.value)} {form if self.value == 1 else plural(form)}"


Values = Mapping[str, tuple[IntroducedValue, ...]]
"""By slot: one value, or several."""


@dataclass(frozen=True, slots=True)
class Introduced:
    """The values that the words of an episode can name, by slot.

    Attributes:
        values: one or several for each slot; those of a list in its order.
        notes: entries of the metadata.
    """

    values: Values
    notes: Mapping[str, object] = field(default_factory=dict)

    def count(self, controller: str) -> int:
        """Return the number with which words agree: that of a slot, or how many values it has."""
        return agreeing_number([introduced.value for introduced in self.values[controller]])

    def phrase(self, slot: Slot) -> Phrase:
        """Return the words for a slot, each value a mention."""
        found = self.values[slot.name]
        joint, form = (slot.form, None) if slot.form in ("or", "nor") else ("and", slot.form)
        phrases: list[Phrase] = []
        for value in found:
            words = value.said(form)
            phrases.append(antecedent(words, value) if value.slot else plain(words))
        return listed(phrases, joint)

    def referent(self, name: str) -> Mentionable:
        """Return what mentions that point back at a slot stand for."""
        found = self.values[name]
        if len(found) == 1:
            return found[0]
        slots = {value.slot for value in found}
        slot = slots.pop() if len(slots) == 1 else REFERENCE
        return MentionedValue(" and ".join(str(value.value) for value in found), slot)

    def ranked(self, name: str, *, ordinals: bool) -> tuple[Introduced, Expression]:
        """Return the same with the rank of a slot's value in the list, and the rank's class."""
        members = [one.value for one in self.values["list"]]
        at = members.index(self.values[name][0].value)
        pair = len(members) == len(FORMER)
        words = f"the {FORMER[at]}" if pair else f"the {RANKS[at]} one"
        rank = IntroducedValue("", "rank", at + 1, words)
        return self.with_values(rank=(rank,)), FORMER[at] if pair and not ordinals else RANKS[at]

    def with_values(self, **added: tuple[IntroducedValue, ...]) -> Introduced:
        """Return the same with further slots."""
        return Introduced({**self.values, **added}, self.notes)


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
    """Return the values of the goal by field, and all of a slot with several by its name.

    Amounts have no order: that with the number `first` gets the fields of the first one. Words that
    point back at them stand for their colors.
    """
    values: dict[str, tuple[IntroducedValue, ...]] = {}
    for value in request.goal_values:
        values[value.slot] = tuple(map(named, request.values_in(value.slot)))
        values[value.field] = (named(value),)
    if request.values_of("amount"):
        for slot in ("colors", "counts"):
            found = [*values[slot]]
            values |= several(slot, [found.pop(first), *found])
        values["amounts"] = values["colors"]
    return values


def several(name: str, values: Sequence[IntroducedValue]) -> Values:
    """Return the slots of several values: one by one, and all together."""
    one_by_one = {f"{name}.{at}": (value,) for at, value in enumerate(values)}
    return {name: tuple(values), **one_by_one}
