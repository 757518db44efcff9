"""Commands in words from outside: their templates, cases and phrases, and which fits a goal."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from roboirg.core.episode import Goal, SlotValue, values_in

ROBOMME_NAME = "robomme"
"""Name of the wordings with RoboMME's sentences, before the @ of their identity."""
FIELD = re.compile(r"\{([a-z]+(?:\.[0-9])?)\}")
"""A field of a template, such as ``{color}`` or ``{colors.1}``."""
PLACE_NOUN = r"(?:target|disc|plate|pad|goal|place|spot|location|position)"
"""Pattern of the nouns for what a cube is placed on."""
_AFTER_PLACE = re.compile(rf"\b{PLACE_NOUN} $")
_AFTER_PREPOSITION = re.compile(r"\b(?:for|on|at|in|by|during) $")
_RELATIVE_CLAUSE = re.compile(r" (?:that|which|where|it|(?:the|a) cube) ")


class StatedPhrase(NamedTuple):
    """The words for one value of a goal.

    Attributes:
        before: words that stay when only the core is replaced: *the container hiding*.
        core: words that name the value: *the red cube*.
        after: as `before`.
    """

    before: str
    core: str
    after: str

    @property
    def text(self) -> str:
        """All of the words."""
        return f"{self.before}{self.core}{self.after}"

    @property
    def is_place(self) -> bool:
        """Whether the core stands for a target: *the target right before the button press*."""
        return re.match(rf"(?:the|its|an?) .*\b{PLACE_NOUN}\b", self.core) is not None


@dataclass(frozen=True, slots=True)
class WordedCommand:
    """One template.

    Attributes:
        text: the sentence, with fields.
        when: the slot values of the goals that it is for; empty for all.
        phrases: field or slot → value → words.
        pointed: the fields that referring expressions must fill; with none, they may fill any.
    """

    text: str
    when: Mapping[str, SlotValue] = field(default_factory=dict)
    phrases: Mapping[str, Mapping[str, StatedPhrase]] = field(default_factory=dict)
    pointed: frozenset[str] = frozenset()

    @property
    def fields(self) -> tuple[str, ...]:
        """The fields of the template, in order."""
        return tuple(FIELD.findall(self.text))

    def phrase(self, name: str, value: str) -> StatedPhrase | None:
        """Return the words for a value of a field; ``colors`` has those of ``colors.1``, too."""
        return self._table(name).get(value)

    def _table(self, name: str) -> Mapping[str, StatedPhrase]:
        return self.phrases.get(name) or self.phrases.get(name.partition(".")[0], {})

    def fits(self, goal: Goal, pointed: Collection[str] = ()) -> bool:
        """Return whether the template states a goal.

        It must have the fields in `pointed`, which referring expressions fill, and needs no words
        for their values.
        """
        values = goal_fields(goal)
        slots = goal.as_mapping()
        if any(slots.get(slot) != value for slot, value in self.when.items()):
            return False
        if not set(self.fields) <= set(values) or not set(pointed) <= set(self.fields):
            return False
        if not self.pointed <= set(pointed) or not all(map(self._can_point, pointed)):
            return False
        for name, value in values.items():
            if name not in self.fields:
                if not _slots_of(name) <= set(self.when):
                    return False
            elif name not in pointed and self.phrase(name, value) is None:
                return False
        return True

    def _can_point(self, name: str) -> bool:
        """Return whether a referring expression can take the place of the words for a field."""
        before, _, after = self.text.partition(f"{{{name}}}")
        return all(
            _gives_way(name, before + phrase.before, phrase, phrase.after + after)
            for phrase in self._table(name).values()
        )

    def slots_said(self, goal: Goal) -> set[str]:
        """Return the slots whose values the words around the fields say."""
        left = {name for name in goal_fields(goal) if name not in self.fields}
        return set().union(*map(_slots_of, left)) & set(self.when)

    def state(self, goal: Goal) -> str:
        """Return the explicit command for a goal that the template fits."""
        values = goal_fields(goal)

        def words(found: re.Match[str]) -> str:
            phrase = self.phrase(found[1], values[found[1]])
            return found[0] if phrase is None else phrase.text

        return FIELD.sub(words, self.text)


@dataclass(frozen=True, slots=True)
class TaskWordings:
    """The commands of one task.

    Attributes:
        commands: templates; of several that fit a goal, the first one is used.
        own: settings whose commands stay our own.
    """

    commands: tuple[WordedCommand, ...]
    own: frozenset[str] = frozenset()

    def find(self, goal: Goal, pointed: Collection[str] = ()) -> WordedCommand | None:
        """Return the template for a goal; None if there is none. See `WordedCommand.fits`."""
        return next((one for one in self.commands if one.fits(goal, pointed)), None)

    def phrase(
        self, goal: Goal, name: str, only: WordedCommand | None = None
    ) -> StatedPhrase | None:
        """Return the words for the value of a field.

        Args:
            goal: the goal.
            name: of the field.
            only: the template whose words they are; None for the one that states the goal, and
                if it has none for the field, the first one that has some.
        """
        value = goal_fields(goal).get(name, "")
        stated = self.find(goal)
        commands = self.commands if stated is None else (stated, *self.commands)
        if only is not None:
            commands = (only,)
        for command in commands:
            found = command.phrase(name, value)
            if name in command.fields and found is not None:
                return found
        return None


@dataclass(frozen=True, slots=True)
class Wordings:
    """The content of a wording file.

    Attributes:
        name: of the wordings.
        fingerprint: of the file's content.
        tasks: the commands of each task.
        source: where the words come from, in a sentence.
    """

    name: str
    fingerprint: str
    tasks: Mapping[str, TaskWordings]
    source: str = ""

    @property
    def identity(self) -> str:
        """Name and fingerprint, as in records."""
        return f"{self.name}@{self.fingerprint}"


def _gives_way(name: str, before: str, phrase: StatedPhrase, after: str) -> bool:
    """Return whether a referring expression reads well between these words.

    It is an adverbial for numbers and visits (*just as often*, *during that visit*), a target for
    placements, and for moments a target or an adverbial (*the target used then*, *placed then*).
    """
    if name in ("repeats", "visit"):
        return _AFTER_PREPOSITION.search(before) is None
    if name not in ("placement", "relation"):
        return True
    if phrase.is_place:
        return _RELATIVE_CLAUSE.match(after) is None
    return name == "relation" and _AFTER_PLACE.search(before) is None


def goal_fields(goal: Goal) -> dict[str, str]:
    """Return the value of each field that states a goal: ``{"color": "red", "repeats": "3"}``.

    A color with a count is one field, ``cubes.0``, with a value such as ``"2 red"``.
    """
    slots = goal.as_mapping()
    if "counts" in slots:
        return {f"cubes.{at}": f"{count} {color}" for at, (color, count) in enumerate(goal.amounts)}
    return {name: str(value) for slot in slots for name, value in fields_of(goal, slot)}


def fields_of(goal: Goal, slot: str) -> Iterator[tuple[str, str | int]]:
    """Yield the value of each field for a slot, with an index if the slot has several."""
    several = isinstance(goal[slot], tuple)
    for at, one in enumerate(values_in(goal[slot])):
        yield f"{slot}.{at}" if several else slot, one


def _slots_of(name: str) -> set[str]:
    base = name.partition(".")[0]
    return {"colors", "counts"} if base == "cubes" else {base}


def goal_name(goal: Goal) -> str:
    """Return the name that records have for a goal: ``color red, repeats 3``.

    It stays as it is, because records that were published are compared with it.
    """
    return ", ".join(f"{name} {value}" for name, value in goal_fields(goal).items())
