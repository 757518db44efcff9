"""What no sentence of a scenario may say, whatever the episode: found without rendering it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from roboirg.core.episode import ALL_COLORS
from roboirg.core.word_pools import PoolName
from roboirg.language.number_words import CARDINALS, ORDINALS
from roboirg.language.scenarios.markup import (
    Agreement,
    Pointer,
    Slot,
    Text,
    pointers_in,
    slots_said,
)
from roboirg.language.scenarios.scenario import PEOPLE, Scenario

_SLOT = r"\{[^}]*\}"
"""A slot as `literal` writes it: ``{repeats:times}``."""
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
_WITHOUT_VALUES = ("distractors", "cue")
"""Fields that name no value at all."""
_COMMAND_FIELDS = ("lead", "say", "remarks")
"""Fields of the command, which may point back only."""
_FREE_SLOTS = PEOPLE | {"rank", "step"}
_COUNTS = {"counts.0", "counts.1"}
"""Slots that a command may state next to words that point back."""
_POINTED_AT = {
    "remarks.former": "list.0", "remarks.latter": "list.1",
    "remarks.not_former": "list.0", "remarks.not_latter": "list.1",
}  # fmt: skip
"""What a remark of direct-rival points at first."""
_MEANT_LAST = ("placement", "relation")
"""Slots at which *that one* points: what was named last."""
_DESCRIBED = ("place", "clue", "rest")
"""Slots that can stand for a container itself."""


def broken_sentences(scenario: Scenario, pointed: str) -> Iterator[str]:
    """Yield what is wrong with a scenario's sentences: *lead: has the words 'red'; …*.

    Args:
        scenario: a text template, whose sentences are checked as they are written.
        pointed: kind of object at which the task's words point: ``cube``, ``hidden_cube`` or
            ``container``.
    """
    noun = pointed.removeprefix("hidden_")
    # These depend on the task: what a place is said of, and whether the cube can be seen.
    never = {**NEVER, _PLACED.format(noun): f"a place follows {noun!r} or 'one'"}
    if pointed == "container":
        never[COVERED] = "the cube is under a container"
    is_lifted = pointed in ("container", "hidden_cube")
    for name, texts in scenario.texts.items():
        for text in texts:
            for complaint in _sentence_complaints(name, text, never):
                yield f"{name}: {complaint}"
            if is_lifted and name.startswith("say.") and not _names_container(text):
                yield (
                    f"{name}: says {literal(text)!r} of a cube, but a container is lifted; write "
                    "'the container over <...>' or 'the one over <...>'"
                )


def _names_container(text: Text) -> bool:
    """Return whether words stand for a container, *the one over it*, and not for the cube, *it*.

    They do if they say *over*, or point back at a place or another description of the container.
    """
    slots = {pointer.of.partition(".")[0] for pointer in pointers_in(text)}
    return "over " in literal(text) or not slots.isdisjoint(_DESCRIBED)


def _sentence_complaints(name: str, text: Text, never: Mapping[str, str]) -> Iterator[str]:
    """Yield a complaint for each rule that a sentence of a scenario breaks.

    *has the words 'minus'; people subtract in words; say 'fewer'*. Rules are about its words, the
    values that it names, and what it points back at.

    Args:
        name: of its field, such as ``say.color``.
        text: the sentence.
        never: patterns of words that may not be said, and why.
    """
    field = name.partition(".")[0]
    words = literal(text)
    for pattern, reason in never.items():
        found = re.search(rf"\b(?:{pattern})\b", words, re.IGNORECASE)
        if found:
            yield f"has the words {found[0]!r}; {reason}"
    if field in ("lead", "remarks") and not words.endswith(" "):
        yield f"must end with a space: {words!r}"
    yield from _value_complaints(field, text)
    if field == "competing":
        yield from _rival_named_last(text)
    pointers = list(pointers_in(text))
    if field == "distractors" and pointers:
        yield "points back; a distractor leads away"
    if name in _POINTED_AT:
        first = pointers[0].of if pointers else "nothing"
        if first != _POINTED_AT[name]:
            yield f"must first point at {_POINTED_AT[name]}, not at {first}"


def _rival_named_last(text: Text) -> Iterator[str]:
    """Yield a complaint if a remark names a value that is not meant last.

    *That one* would then mean it. If *before* is meant, *not after but before* is right, and
    *before and not after* is wrong.
    """
    names = []  # in the order of speaking
    for part in text:
        if isinstance(part, Pointer):
            names.append(part.of)
        elif isinstance(part, Slot):
            names.append(part.name)
    for slot in _MEANT_LAST:
        rival = f"rival {slot}"
        if slot in names and rival in names and names.index(slot) < names.index(rival):
            yield f"names {{{rival}}} last, which 'that one' would mean; say it before <... {slot}>"


def _value_complaints(field: str, text: Text) -> Iterator[str]:
    """Yield a complaint for each value that a sentence names where it may only point back.

    In a ``lead``, the words before a command, neither *red* may be said nor the slot ``{color}``;
    in ``say``, the command itself, the counts of cubes may.

    Args:
        field: of the scenario, to which the sentence belongs: ``say`` for ``say.color``.
        text: the sentence.
    """
    if field in _WITHOUT_VALUES or field in _COMMAND_FIELDS:
        values = _values_in_words(field, text)
        if values:
            yield f"names {', '.join(sorted(values))}, which could be a value"
    if field not in ("introduction", "competing", "resolved"):
        slots = {slot.name for slot in slots_said(text)} - _FREE_SLOTS
        if field == "say":
            slots -= _COUNTS
        if slots:
            yield f"says {{{', '.join(sorted(slots))}}}; a value may only be pointed at there"


def _values_in_words(field: str, text: Text) -> set[str]:
    """Return the words of a sentence that could be a value of a goal: ``{"two", "left"}``.

    They are searched in its plain words, not in those that point back, such as *the second one*.
    *Twice as often as that* names no value either, so *twice* and *two* do not count next to such.

    Args:
        field: of the scenario, to which the sentence belongs: ``say`` for ``say.color``.
        text: the sentence.
    """
    plain_parts = tuple(part for part in text if not isinstance(part, Pointer))
    values = set(_VALUE.findall(literal(plain_parts).lower()))
    if field in _COMMAND_FIELDS and any(pointers_in(text)):
        values -= {"twice", "two"}  # "twice as often as that" is a relation of the table
    return values


def blanked(scenario: Scenario) -> Iterator[str]:
    """Yield a scenario's name and sentences, in small letters, with ``_`` for slots.

    So two scenarios can be compared: *My sister likes {color}.* becomes *my sister likes _.*
    Sentences of the command are left out, and so are fragments of two words or fewer.
    """
    yield f"frame {scenario.fields.frame}"
    for name, texts in scenario.texts.items():
        if name.startswith(("say", "resolved")):
            continue
        for text in texts:
            words = re.sub(_SLOT, "_", literal(text)).lower().strip()
            # "So ..." is no sentence.
            if len(words.split()) > 2:  # noqa: PLR2004
                yield words


def sentences_of(scenarios: Iterable[Scenario], pool: PoolName) -> set[str]:
    """Return the names and the sentences of a pool's scenarios, as `blanked` writes them.

    Args:
        scenarios: of any pool.
        pool: ``train`` or ``test``.
    """
    found: set[str] = set()
    for scenario in scenarios:
        if scenario.fields.pool == pool:
            found.update(blanked(scenario))
    return found


def literal(text: Text) -> str:
    """Return the words of a sentence of a scenario, without its marks for pointers and agreement.

    ``Lift <it color: it> {repeats:times}.`` becomes ``Lift it {repeats:times}.``. Of words that
    agree with a number, ``[repeats: lap|laps]``, both forms are there. A slot without a form has
    None: ``{color:None}``; patterns of rules rely on this.
    """
    words = []
    for part in text:
        if isinstance(part, Pointer):
            words.append(literal(part.parts))
        elif isinstance(part, Agreement):
            both = [form for form in (part.one, part.many) if form]
            words.append(" ".join(both))
        elif isinstance(part, Slot):
            words.append(f"{{{part.name}:{part.form}}}")
        else:
            words.append(part.text)
    return "".join(words)
