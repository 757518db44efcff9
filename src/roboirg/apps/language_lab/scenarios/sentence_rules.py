"""What no sentence of a scenario may say, whatever the episode: found without rendering it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from roboirg.core.episode import ALL_COLORS
from roboirg.language.number_words import CARDINALS, ORDINALS
from roboirg.language.scenarios.markup import Agreement, Pointer, Slot, Text, pointers_in
from roboirg.language.scenarios.scenario import PEOPLE, Scenario

_SLOT = r"\{[^}]*\}"
NEVER: Mapping[str, str] = {
    r"you(?:'ve| have)? (?:just )?saw|you(?:'ve| have) (?:just )?seen|as you saw": (
        "what was seen is not checked"
    ),
    r"look(?:ing)? at": "the thing may be covered or not there yet",
    r"point(?:ing|ed) (?:at|to)": "nobody points",
    r"(?:picture|image|photo|video) shows": "what is shown is not checked",
    r"you(?:'ve| have)? (?:just |already )?(?:tried|did|done) (?:this|that|it)"
    r"|time for (?:just )?one more|nobody has (?:lifted|touched|moved|picked)": (
        "nothing was done yet"
    ),
    rf"(?:he|she|they|person:None\}}) (?:already|still) (?:has|have) the {_SLOT} (?:cube|one)"
    r"|has (?:taken|found) the|found nothing": "the thing is on the table",
    r"as i (?:just )?said|i (?:just|already) (?:said|told you)|mentioned (?:earlier|before|above)"
    r"|(?:written|said|see|read) (?:above|below)|(?:this|last|next) (?:sentence|message|prompt)": (
        "depends on how the words are delivered"
    ),
    r"there (?:are|is) [^.]*\bon the table": "what is on the table is not checked",
    r"two times fewer|two fewer times": "heard as half of it; say 'one time fewer' only",
    r"minus": "people subtract in words; say 'fewer'",
    r"neither of (?:those|these|them)|not that color": (
        "one is left; say 'the other one' or 'the one that's left'"
    ),
    r"(?:leaves?|tunes? in|ha[sd] to go|have to go|calls?|arrives?) on (?:its|the(?: cube's)?) "
    rf"{_SLOT} (?:visit|pass)": "a visit is no time of day",
    rf"at the other moment|between the times|of the {_SLOT} (?:one|cube)s? (?:we|i|he|she|they)"
    r"|so many mails|vote[sd]? about|third from your": "wrong English",
    r"favorite color|favou?rite": "a taste decides nothing; say why it matters today",
    r"nearest|closest|farthest|leftmost|rightmost|all the way (?:on|in|at|to) (?:the|your)": (
        "a place is a slot, {place} or {clue}"
    ),
    "|".join(ALL_COLORS): "a color is a slot",
}
"""Words that would be false, ambiguous or wrong, and why."""
COVERED = (
    r"(?:look at|watch|keep an eye on|(?:can|do) you see|here's|there's) (?:the )?"
    rf"(?:{_SLOT} cube|it|both)"
)
"""Words for a cube in plain view."""
_PLACED = r"(?!{}|one|started)[a-z]+ \{{(?:place|aside)[.\d]*:None"
"""Another thing than that which the place is of."""
_NAMED = "|".join((*ALL_COLORS, *(set(CARDINALS) - {"one"}), *ORDINALS, "twice"))
_VALUE = re.compile(
    rf"\b(?!first of all\b|(?:at )?first[,.]|second[,.!?])(?:{_NAMED})\b"
    r"|(?<!\bat )\bonce\b(?! \w|_)|\bonce (?:a|an|or|and|more|again|per|every|each|only)\b"
    r"|\b(?:left|right)(?:most\b|[ -](?:hand|side|one|cube|container|target|end|corner)\b)"
    r"|\b(?:on|to|from|at) (?:the|your|my|its) (?:far )?(?:left\b|right\b"
    r"(?! (?:track|foot|path|page|lines|moment|time|place|people|person|answer|address|way)\b))"
)
"""Words that could be a value: *on the right*, but not *all right*; *once a day*, but not *once
we're done*. *One* is a pronoun most of the time."""
_SILENT = ("distractors", "cue")
"""Fields that name no value at all."""
_COMMAND = ("lead", "say", "remarks")
"""Fields of the command, which may point back only."""
_FREE_SLOTS = PEOPLE | {"rank", "step"}
_COUNTS = {"counts.0", "counts.1"}
"""Slots that a command may state next to words that point back."""
_POINTED_AT = {
    "remarks.former": "list.0", "remarks.latter": "list.1",
    "remarks.not_former": "list.0", "remarks.not_latter": "list.1",
}  # fmt: skip
"""What a remark of direct-rival points at first."""
_DESCRIBED = ("place", "clue", "rest")
"""Slots that can stand for a container itself."""


def broken_sentences(scenario: Scenario, pointed: str) -> Iterator[str]:
    """Yield what is wrong with the sentences of a scenario of a task.

    `pointed` is the kind of object that a place distinguishes in the task.
    """
    noun = pointed.removeprefix("hidden_")
    never = {**NEVER, _PLACED.format(noun): f"a place follows {noun!r} or 'one'"}
    if pointed == "container":
        never[COVERED] = "the cube is under a container"
    is_lifted = pointed in ("container", "hidden_cube")
    for name, texts in scenario.texts.items():
        for text in texts:
            for complaint in _wrong(name, text, never):
                yield f"{name}: {complaint}"
            if is_lifted and name.startswith("say.") and not _names_container(text):
                yield (
                    f"{name}: says {literal(text)!r} of a cube, but a container is lifted; write "
                    "'the container over <...>' or 'the one over <...>'"
                )


def _names_container(text: Text) -> bool:
    """Return whether words are for a container: *the one over it*, not *it* of a cube."""
    slots = {pointer.of.partition(".")[0] for pointer in pointers_in(text)}
    return "over " in literal(text) or not slots.isdisjoint(_DESCRIBED)


def _wrong(name: str, text: Text, never: Mapping[str, str]) -> Iterator[str]:
    field, words = name.partition(".")[0], literal(text)
    for pattern, reason in never.items():
        found = re.search(rf"\b(?:{pattern})\b", words, re.IGNORECASE)
        if found:
            yield f"has the words {found[0]!r}; {reason}"
    if field in ("lead", "remarks") and not words.endswith(" "):
        yield f"must end with a space: {words!r}"
    pointers = list(pointers_in(text))
    if field in (*_SILENT, *_COMMAND):
        outside = literal(tuple(part for part in text if not isinstance(part, Pointer)))
        values = set(_VALUE.findall(outside.lower()))
        if field in _COMMAND and pointers:  # "twice as often as that" is a relation of the table
            values -= {"twice", "two"}
        if values:
            yield f"names {', '.join(sorted(values))}, which could be a value"
    if field not in ("introduction", "competing", "resolved"):
        said = {part.name for part in text if isinstance(part, Slot)} - _FREE_SLOTS
        if field == "say":
            said -= _COUNTS
        if said:
            yield f"says {{{', '.join(sorted(said))}}}; a value may only be pointed at there"
    if field == "distractors" and pointers:
        yield "points back; a distractor leads away"
    wanted, first = _POINTED_AT.get(name), pointers[0].of if pointers else "nothing"
    if wanted and first != wanted:
        yield f"must first point at {wanted}, not at {first}"


def blanked(scenario: Scenario) -> Iterator[str]:
    """Yield the frame, and the sentences with their slots blanked, but those of the command."""
    yield f"frame {scenario.fields.frame}"
    for name, texts in scenario.texts.items():
        if not name.startswith(("say", "resolved")):
            found = [re.sub(_SLOT, "_", literal(text)).lower().strip() for text in texts]
            # "So ..." is no sentence.
            yield from (words for words in found if len(words.split()) > 2)  # noqa: PLR2004


def literal(text: Text) -> str:
    """Return the words with the slots and their forms: ``Put it on {repeats:times}.``."""
    words = []
    for part in text:
        if isinstance(part, Pointer):
            words.append(literal(part.parts))
        elif isinstance(part, Agreement):
            words.append(" ".join(filter(None, (part.one, part.many))))
        elif isinstance(part, Slot):
            words.append(f"{{{part.name}:{part.form}}}")
        else:
            words.append(part.text)
    return "".join(words)
