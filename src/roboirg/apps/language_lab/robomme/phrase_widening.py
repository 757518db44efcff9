"""Widen the words for a value to a phrase that a referring expression can replace.

*red* becomes *the red cube*, or *the container hiding [the red cube]*; *three* becomes *three
times*; *third* becomes *for the third time*, or *the third target it was placed on*; *before*
becomes *the target where it was placed [right before the press]*.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

from roboirg.apps.language_lab.robomme.template_search import DraftTemplate
from roboirg.core.episode import ALL_COLORS
from roboirg.language.number_words import CARDINALS
from roboirg.language.worded_command import PLACE_NOUN, StatedPhrase

_COLOR = rf"(?:{'|'.join(ALL_COLORS)})"
_CUBE = r"(?:cube|block)"
_COUNT = rf"(?:{'|'.join(CARDINALS)}|[0-9]+|an?|the)"
_PLACE = rf"(?:the|an?) (?:\w+ )?{PLACE_NOUN}"
_VISIT = r"(?:time|visit|pass|occasion)"
_COVER = r"(?:container|cube|block|bin|cup|bowl|box|one)"
_PLACED = r"(?:(?:that|which|where|on which) )?(?:it|the cube|a cube) (?:was|were|is|had) "
_CLAUSE = r"[^,;]*?(?=[,;.]| and | then |$)"


class _Context(NamedTuple):
    """How far a phrase may reach, and what it must then look like.

    Attributes:
        left: pattern of words before the value that belong to the phrase.
        right: the same after it.
        whole: pattern of a complete phrase.
        before: pattern of words before the phrase that go with it, outside the brackets.
        after: the same after it.
        far: whether the phrase reaches as far as possible, or no farther than it must.
    """

    left: str
    right: str
    whole: str
    before: str = "$"
    after: str = ""
    far: bool = True


_CUBES = _Context(
    left=r"\b(?:the|an?) (?:same )?$",
    right=rf"[ -]?(?:colou?red )?{_CUBE}\b",
    whole=rf"(?:the|an?) .*\b{_COLOR}\b.*{_CUBE}",
    far=False,
)
_CONTEXTS: Mapping[str, _Context] = {
    "cube": _CUBES,
    "container": _CUBES._replace(
        before=rf"\b(?:the|an?|another) (?:\w+ )?{_COVER} (?:(?!and |then )\w+ ){{0,5}}$",
        after=rf" (?:is|was|are|were|lies|inside|under|beneath|underneath|below)\b{_CLAUSE}",
    ),
    "repeats": _Context(
        left=r"\bfor $",
        right=r" times?\b(?:\(s\))?",
        whole=r"(?:for )?(?:[\w-]+ times?(?:\(s\))?|once|twice|thrice)",
    ),
    "visit": _Context(
        left=r"\b(?:(?:for|on|at|in|by|during) )?(?:the|its) $",
        right=rf" {_VISIT}\b",
        whole=rf"(?:\w+ )?(?:the|its) [\w-]+ {_VISIT}",
    ),
    "placement": _Context(
        left=rf"\b(?:{_PLACE} (?!.*\b{PLACE_NOUN}\b)[^,;]*|the )$",
        right=rf"(?: (?:time|placement|(?:\w+ )?{PLACE_NOUN})\b)?(?: {_PLACED}{_CLAUSE})?",
        whole=rf"the .*\b{PLACE_NOUN}\b.*",
    ),
    "relation": _Context(
        left=rf"\b(?:{_PLACE} )?(?:(?:right|just|directly|immediately|shortly) )?$",
        right=rf" {_CLAUSE}",
        whole=rf"(?:{_PLACE} )?(?:\w+ )?(?:before|after|prior to|following)\b"
        r".*\b(?:button|press\w*|push\w*)\b.*",
        before=rf"\b{_PLACE}\b(?!.*\b{PLACE_NOUN}\b)[^,;]*$",
    ),
    "cubes": _Context(
        left="$",
        right=rf" (?:of the )?(?:{_COLOR}(?: {_CUBE}s?)?|{_CUBE}s?)\b",
        whole=rf"{_COUNT} (?:of the )?{_COLOR}(?: {_CUBE}s?)?",
    ),
}
_AMOUNT = re.compile(rf"({_COUNT} (?:of the )?)(.+)")


class WidenedTemplate(NamedTuple):
    """A template with phrases.

    Attributes:
        text: with fields.
        phrases: field → value → words.
        stuck: the fields whose words are no phrase that could be replaced.
    """

    text: str
    phrases: dict[str, dict[str, StatedPhrase]]
    stuck: tuple[str, ...]


def widen(draft: DraftTemplate, thing: str) -> WidenedTemplate:
    """Widen the words of every field.

    Args:
        draft: the template.
        thing: kind of object that the goal selects.
    """
    literals = list(draft.literals)
    phrases: dict[str, dict[str, StatedPhrase]] = {}
    stuck: list[str] = []
    for at, name in enumerate(draft.fields):
        kind, colored = name.partition(".")[0], "container" if thing == "container" else "cube"
        kind = kind if kind in _CONTEXTS else colored
        context, table = _CONTEXTS[kind], draft.tables[name]
        left, right = _reach(context, literals[at], literals[at + 1], table)
        cores = {value: f"{left}{words}{right}" for value, words in table.items()}
        if not all(re.fullmatch(context.whole, core) for core in cores.values()):
            phrases[name] = {value: StatedPhrase("", core, "") for value, core in table.items()}
            stuck.append(name)
            continue
        literals[at] = _without_end(literals[at], left)
        literals[at + 1] = literals[at + 1][len(right) :]
        before = _found(re.search(context.before, literals[at]))
        after = _found(re.match(context.after, literals[at + 1])) if before else ""
        literals[at] = _without_end(literals[at], before)
        literals[at + 1] = literals[at + 1][len(after) :]
        split = _amount if kind == "cubes" else _stated(before, after)
        phrases[name] = {value: split(core) for value, core in cores.items()}
    fields = (f"{{{name}}}" for name in draft.fields)
    text = literals[0] + "".join(map("".join, zip(fields, literals[1:], strict=True)))
    return WidenedTemplate(text, phrases, tuple(stuck))


def _reach(context: _Context, before: str, after: str, table: Mapping[str, str]) -> tuple[str, str]:
    """Return the words before and after a value that complete its phrase."""
    left, right = _found(re.search(context.left, before)), _found(re.match(context.right, after))
    tries = (("", ""), ("", right), (left, ""), (left, right))
    for one in tries[::-1] if context.far else tries:
        if all(re.fullmatch(context.whole, one[0] + words + one[1]) for words in table.values()):
            return one
    return "", ""


def _stated(before: str, after: str) -> Callable[[str], StatedPhrase]:
    return lambda core: StatedPhrase(before, core, after)


def _amount(words: str) -> StatedPhrase:
    found = _AMOUNT.fullmatch(words)
    return StatedPhrase("", words, "") if found is None else StatedPhrase(found[1], found[2], "")


def _found(match: re.Match[str] | None) -> str:
    return "" if match is None else match[0]


def _without_end(text: str, end: str) -> str:
    return text[: len(text) - len(end)]
