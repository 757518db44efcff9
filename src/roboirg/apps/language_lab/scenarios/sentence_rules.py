"""What no sentence of a scenario may say, whatever the episode: found without rendering it."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping

from roboirg.core.episode import ALL_COLORS
from roboirg.language.instruction import REFERENCE
from roboirg.language.number_words import CARDINALS, ORDINALS
from roboirg.language.scenarios.markup import Agreement, Pointer, Slot, Text, pointers_in
from roboirg.language.scenarios.scenario import Scenario

NEVER: Mapping[str, str] = {
    r"you(?:'ve| have)? (?:just )?saw|you(?:'ve| have) (?:just )?seen|as you saw": (
        "in turns it is heard before the video"
    ),
    r"look(?:ing)? at": "the thing may be covered or not there yet",
    r"point(?:ing|ed) (?:at|to)": "nobody points",
    r"(?:picture|image|photo|video) shows": "what is shown is not checked",
    r"you(?:'ve| have)? (?:just )?(?:tried|did|done) (?:this|that|it)": "the robot did nothing yet",
    r"there (?:are|is) [^.]*\bon the table": "what is on the table is not checked",
    r"two times fewer|two fewer times": "heard as half of it; say 'that many times minus two'",
    r"at the other moment|between the times": "wrong English",
    r"favorite color|favou?rite": "a taste decides nothing; say why it matters today",
}
"""Words that would be false, ambiguous or wrong, and why."""
_VALUES = frozenset(
    {*ALL_COLORS, *CARDINALS, *ORDINALS, "once", "twice", "left", "right", "leftmost", "rightmost"}
) - {"one"}
"""Words that could be a value. *One* is a pronoun most of the time."""
_SILENT = ("distractors", "cue")
"""Fields that name no value at all."""
_COMMAND = ("lead", "say", "remarks")
"""Fields of the command, which may point back only."""
_FREE_SLOTS = ("person", "he", "him", "his", "rank", "step")
_WORD = re.compile(r"[a-z']+")


def broken_sentences(scenario: Scenario) -> Iterator[str]:
    """Yield what is wrong with the sentences of a scenario."""
    for name, texts in scenario.texts.items():
        for text in texts:
            for complaint in _wrong(name.partition(".")[0], text):
                yield f"{name}: {complaint}"
    yield from _wrong_remarks(scenario)


def _wrong(field: str, text: Text) -> Iterator[str]:
    words = literal(text)
    for pattern, reason in NEVER.items():
        found = re.search(rf"\b(?:{pattern})\b", words, re.IGNORECASE)
        if found:
            yield f"has the words {found[0]!r}; {reason}"
    if re.search(r"  | [.,;:?!]|^ ", words) or ("," * 2) in words:
        yield f"has a space or comma too many: {words!r}"
    if field in (*_SILENT, *_COMMAND):
        outside = " ".join(part for part in text if isinstance(part, str))
        values = _VALUES & set(_WORD.findall(outside.lower()))
        if field in _COMMAND:  # "twice as often as that" is a relation of the table
            values -= {"twice", "two"} if any(pointers_in(text)) else set()
        if values:
            yield f"names {', '.join(sorted(values))}, which could be a value"
        said = {part.name for part in text if isinstance(part, Slot)} - _free(_FREE_SLOTS)
        if said:
            yield f"says {{{', '.join(sorted(said))}}}; a value may only be pointed at there"
    if field in _SILENT and any(pointers_in(text)) and field == "distractors":
        yield "points back; a distractor leads away"
    if field in ("introduction", "reinforcement", "competing") and not text:
        yield "is empty"


def _free(names: Collection[str]) -> set[str]:
    return {f"{name}{number}" for name in names for number in ("", ".2")}


def _wrong_remarks(scenario: Scenario) -> Iterator[str]:
    """Yield remarks of direct-rival that point at the wrong one of the two."""
    at = {"former": "list.0", "latter": "list.1"}
    for name, texts in scenario.texts.items():
        field, _, remark = name.partition(".")
        if field != "remarks":
            continue
        wanted = at[remark.removeprefix("not_")]
        for text in texts:
            first = next((one.of for one in pointers_in(text)), None)
            if first != wanted:
                yield f"{name}: must first point at {wanted}, not at {first or 'nothing'}"


def blanked(scenario: Scenario) -> Iterator[str]:
    """Yield the sentences of a scenario with their slots blanked, but those of the command."""
    for name, texts in scenario.texts.items():
        if not name.startswith(("say", "resolved")):
            for text in texts:
                if len(literal(text).split()) > 2:  # noqa: PLR2004 - "So ..." is no sentence
                    yield literal(text).strip().lower()


def undeclared(scenario: Scenario) -> Iterator[str]:
    """Yield what the command points at and the introduction does not name."""
    named = {part.name for part in scenario.text("introduction") if isinstance(part, Slot)}
    named |= {name.partition(".")[0] for name in named}
    for name, texts in scenario.texts.items():
        if not name.startswith(("say", "lead", "remarks", "reinforcement", "cue")):
            continue
        for text in texts:
            for pointer in pointers_in(text):
                if not _is_named(pointer.of, named, scenario):
                    yield f"{name}: points at {pointer.of}, which the introduction does not name"


def _is_named(name: str, named: Collection[str], scenario: Scenario) -> bool:
    base = name.partition(".")[0]
    listed = scenario.fields.list
    if name in named or base in named:
        return True
    # A value of the goal is one of the list, or follows from a reference.
    derived = {"list", "excluded", REFERENCE, "clue", "place"} & set(named)
    return bool(derived) if base == listed or scenario.fields.derive else False


def literal(text: Text) -> str:
    """Return the words that are always said, with a gap for each slot: ``Put it on, _ times.``."""
    words = []
    for part in text:
        if isinstance(part, Pointer):
            words.append(literal(part.parts))
        elif isinstance(part, Agreement):
            words.append(f"{part.one} {part.many}")
        else:
            words.append("_" if isinstance(part, Slot) else part)
    return "".join(words)
