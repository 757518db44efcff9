"""What fills the slots of a scenario's sentences, and how it is put into words.

- *slot*: a name in braces in a sentence: ``{color}`` in *Lift the {color} cube.*
- *filler*: a value for a slot, with its kind, which decides the words: the number 3 is *three*,
  *third* or *three times*; a place or a person has words of its own.
- *kind*: ``color``, ``number``, ``visit``, ``place``, ``clue``, ``person`` …
- *content plan*: one way to say a goal without naming it in the command: which parts of the command
  are pronouns, and what the introduction names so that they can be resolved.
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
ANY_LIST = "any list"
"""As the `list_slot` of a content plan: a scenario that says it may list values of any slot."""


class Filler(NamedTuple):
    """A value that fills a slot of a sentence.

    ``Filler("color", "color", "red")`` fills ``{color}`` with *red*.

    Attributes:
        slot: of the goal, for the mention that the words become; empty for words that are no
            mention, such as a person's name.
        kind: type of the value: ``color``, ``number``, ``visit``, ``place`` …
        value: for the mention.
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
        None is the usual form: *third* for a position in a series, *three* for any other number.
        Values that are no numbers are said in one way, whatever the form.
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


FillersBySlot = Mapping[str, tuple[Filler, ...]]
"""The fillers of each slot, one or several: ``{"color": (<red>,), "list": (<red>, <blue>)}``."""


class ReferredValue(NamedTuple):
    """What a pronoun stands for: the slot and the value that its mention gets."""

    slot: str
    value: str | int


class RankedReference(NamedTuple):
    """Words for a value by its position in a list, such as *the former*.

    Attributes:
        fillers: those of the scenario, with the words as the slot ``rank``.
        expression: the class of the words: ``former``.
    """

    fillers: Fillers
    expression: Expression


@dataclass(frozen=True, slots=True)
class Fillers:
    """The fillers of all slots that the sentences of a scenario can name in an episode.

    Attributes:
        values: one or several for each slot; those of a list in the order in which it is said.
    """

    values: FillersBySlot

    def count(self, controller: str) -> int:
        """Return the number that decides between singular and plural words about a slot.

        That is the number in the slot, 3 for three repeats, or else how many values it has, 2 for
        red and blue.
        """
        return agreeing_number([filler.value for filler in self.values[controller]])

    def phrase(self, slot: Slot) -> Phrase:
        """Return the words for a slot, each value a mention: *red and blue* for ``{list}``.

        Several values are joined by *and*; ``{list:or}`` and ``{list:nor}`` join them by that word.
        """
        joint = "and"
        form = slot.form
        if form in ("or", "nor"):
            joint = form
            form = None
        phrases = []
        for value in self.values[slot.name]:
            words = value.said(form)
            if value.slot:
                phrases.append(antecedent(words, value.slot, value.value))
            else:
                phrases.append(plain(words))
        return listed(phrases, joint)

    def referent(self, name: str) -> ReferredValue:
        """Return what a pronoun for a slot stands for: for ``color`` it may be the color red.

        *them*, for the colors red and blue, stands for ``red and blue``. Values of different slots
        have the slot ``reference``.
        """
        values = self.values[name]
        if len(values) == 1:
            return ReferredValue(values[0].slot, values[0].value)
        slots = {value.slot for value in values}
        slot = slots.pop() if len(slots) == 1 else REFERENCE
        return ReferredValue(slot, " and ".join(str(value.value) for value in values))

    def ranked(self, name: str, *, ordinals: bool) -> RankedReference:
        """Return words for a slot's value by its position in the slot ``list``.

        With the list *red, blue* and blue in the slot `name`: *the latter*. Of three values it is
        *the second one*.

        Args:
            name: of a slot whose value is in the list.
            ordinals: whether the sentence has the form ``{rank:ordinal}``. The class is then
                ``second`` and not ``latter``, also for a list of two.
        """
        members = [member.value for member in self.values["list"]]
        position = members.index(self.values[name][0].value)
        words = f"the {RANKS[position]} one"
        expression = RANKS[position]
        if len(members) == len(FORMER):
            words = f"the {FORMER[position]}"
            if not ordinals:
                expression = FORMER[position]
        rank = Filler("", "rank", position + 1, words)
        return RankedReference(self.with_values(rank=(rank,)), expression)

    def with_values(self, **added: tuple[Filler, ...]) -> Fillers:
        """Return the same fillers with those of further slots; these replace present ones."""
        return Fillers({**self.values, **added})


class ContentPlan(NamedTuple):
    """One way to say a goal without naming it in the command, whatever the scenario.

    For the goal *red* by a place: *The cube on the left is wet. Lift it.* Its only field is
    ``color``, for which the command says *it*; its values hold the place *on the left*.

    Attributes:
        fields: of the command, for which it says a pronoun instead of the value: ``["color"]``.
        values: what the introduction names, by slot, besides the values of the goal, which every
            scenario can name.
        notes: entries of the instruction's metadata.
        list_slot: the goal slot of which values are listed, *red or blue*; empty if the scenario
            must not list any, `ANY_LIST` if it may list those of any slot.
        remark: name of the words before the command that choose one of two values, ``former`` or
            ``not_latter``; empty if none do.
    """

    fields: Collection[str]
    values: FillersBySlot
    notes: Mapping[str, object]
    list_slot: str = ""
    remark: str = ""


def filler_of(value: GoalValue) -> Filler:
    """Return a value of the goal as a filler for its slot, in the usual words of its type."""
    return Filler(value.slot, value.slot_type, value.value)


def goal_fillers(request: InstructionRequest, first: int = 0) -> FillersBySlot:
    """Return the goal's values as fillers, by slot, ``colors``, and by field, ``colors.0``.

    A goal of red and blue gives ``colors``, both, ``colors.0``, red, and ``colors.1``, blue.

    Args:
        request: the episode.
        first: of a goal that counts cubes, *2 red and 1 blue*, the index of the color that is named
            first and gets ``colors.0``; their order has no meaning. Such a goal also has the slot
            ``amounts``, which holds its colors.
    """
    values: dict[str, tuple[Filler, ...]] = {}
    for value in request.goal_values:
        values[value.slot] = tuple(map(filler_of, request.values_in(value.slot)))
        values[value.field] = (filler_of(value),)
    if request.values_of("amount"):
        for slot in ("colors", "counts"):
            in_order = list(values[slot])
            in_order.insert(0, in_order.pop(first))  # this one to the front
            values |= list_fillers(slot, in_order)
        values["amounts"] = values["colors"]
    return values


def list_fillers(name: str, values: Sequence[Filler]) -> FillersBySlot:
    """Return the slots of a list, all values together and one by one.

    For ``list`` with red and blue: ``list``, both, ``list.0``, red, and ``list.1``, blue.
    """
    slots = {name: tuple(values)}
    for at, value in enumerate(values):
        slots[f"{name}.{at}"] = (value,)
    return slots
