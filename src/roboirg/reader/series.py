"""Series: how often, at which visit, at which of the targets that the video shows.

- *visit*: the moving cube is on its target; *passed*: visits to let go by before acting.
- *placement*: the robot puts a cube on a target in the video; a rank counts these.
- *way*: over which targets something swings, by their sides.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

from roboirg.reader.phrases import FoundPhrase, PhraseRule, compiled
from roboirg.reader.tokens import ADVERBS, number_of, ordinal_of

Relation = Literal["before", "after"]
LAST = -1
LAST_BUT_ONE = -2
"""Ranks from the end of a series."""


class Visit(NamedTuple):
    """A visit of the cube to the target.

    Attributes:
        rank: 1 for the first, negative from the end; None for the next one.
    """

    rank: int | None


class TargetWay(NamedTuple):
    """The sides of the targets over which something goes, in order."""

    sides: tuple[str, ...]


class Target(NamedTuple):
    """A target, as words name it.

    Attributes:
        side: of the robot.
        rank: of the placement there, negative from the end.
        relation: of the placement to the press of the button.
    """

    side: str | None = None
    rank: int | None = None
    relation: Relation | None = None


_RANK_FROM_END = {
    "last": LAST, "very last": LAST, "final": LAST, "penultimate": LAST_BUT_ONE,
    "second to last": LAST_BUT_ONE, "next to last": LAST_BUT_ONE, "last but one": LAST_BUT_ONE,
}  # fmt: skip
_PARTS = {
    "WHO": r"(?:the robot|the arm|it|you|he|she|we|they|(?:the |a )(?:same |other )?"
    r"(?:COLOR )?cube|the other one|the (?:COLOR )?one)",
    "AUX": r"(?:(?:was|were|is|had|has|have|been|got|being|did) )*",
    "DONE": r"(?:used|visited|put|places?|placed|chose|chosen|set|stood|touched|moved|filled"
    r"|dropped|went|landed|rested|sat|sitting|standing|laid|was|made|put down|placed down|shown)",
    "USED": r"(?:(?:(?:that|which|where|on which|to which|in which) )?(?:WHO )?AUXDONE"
    r"(?: (?:it|the cube|a cube|the other one|cubes|WHO))?(?: (?:on|down|to|at|there|in(?! "
    r"VIDEO)))*)",
    "SHOWN": r"(?:(?:in|from|of|during|by) VIDEO|in the sequence|of the sequence)",
    "NEAR": r"(?:(?:right|directly|just|shortly|from|at the moment|the moment) )*",
    "PRESS": r"(?:(?:the |a |his |its )?button(?:'s)? (?:AUX)?(?:press|pressed|push|pushed|presses"
    r"|pressing|hit)|(?:the )?(?:WHO "
    r")?AUX(?:press|pressed|push|pushed|pressing|pushing|hit|hitting)"
    r"(?: of)?(?: (?:the )?button| it)?|the button)",
    "WHEN": r"(?:NEAR(?P<when>before|after) PRESS)",
    "NTH": r"(?:ORDINAL|(?:very )?last|final|penultimate|second to last|next to last|last but one)",
    "GETS": r"(?:reach(?:es|ed|ing)?|arriv(?:es|ed|ing)|gets?|got|getting|pass(?:es|ed|ing)?"
    r"|cross(?:es|ed|ing)?|visit(?:s|ed|ing)?|comes?|came|coming|is|enters?|entered|hits?"
    r"|touch(?:es)?"
    r"|go(?:es)?|went|returns?|lands?|moves?|slides?|runs?|stops?|travels?|makes it|appears?|has)",
    "ON": r"(?:(?:at|on|over|by|past|across|through|to|in|above|up to|within|back|the|inside of) "
    r")*",
    "CUBE": r"(?:(?:the |this |that )?(?:(?:moving|sliding|running) )?cube|it)",
    "ARRIVAL": r"(?:(?:that |when |where )?CUBE (?:has |will )?(?:been |be )?GETS"
    r"(?: (?:ON)?GOALTARGET| there)?)",
    "GOALTARGET": r"target#\d+",
    "OCCASION": r"(?:time|visit|pass|passage|passing|crossing|occasion|arrival|stop|round|turn)",
    "OF": r"(?: of (?:the|this) (?:moving )?cube| (?:over|to|across|at|on|through|of|by) "
    r"GOALTARGET)*",
    "MANY": r"(?:(?P<many>NUMBER) (?:times|passes|visits|crossings)|(?P<adverb>once|twice|thrice))",
}  # fmt: skip
_TARGET = compiled(
    r"(?:the |a |that |same |very )*(?:(?P<rank>NTH) )?(?:of the (?:two |three |four )?)?targets?"
    r"(?: number (?P<number>NUMBER)| of the (?P<of>NTH) (?:placement|placing)"
    r"| of (?:placement|placing) (?:number )?(?P<placing>NUMBER))?"
    r"(?: (?:USED|SHOWN|WHEN)(?: (?:(?:for )?the )?(?P<at>NTH)(?: time)?)?)*",
    _PARTS,
)
_WHERE = compiled(
    r"(?:the (?:spot|place|location|position|one) )?(?:where|on which|on what) (?:the )?WHO AUX"
    r"(?:(?P<first>NTH) )?(?:DONE(?: WHO| it| the cube| a cube)?(?: (?:on|down|to|at|there))* )?"
    r"(?:(?:SHOWN )?WHEN(?: SHOWN)?|(?:SHOWN )?(?:(?:for )?the )?(?P<at>NTH)(?: time)?(?: SHOWN)?"
    r"|SHOWN)",
    _PARTS,
)
_PRESS_TARGET = compiled(r"(?:the )?(?P<when>pre|post|before|after) press target", _PARTS)
_PLACING = compiled(
    r"(?:the )?(?P<rank>NTH) (?:placement|placing|spot|place|location|position)(?: "
    r"(?:USED|SHOWN))*",
    _PARTS,
)
_SIDE_TARGET = compiled(
    r"(?:the |your )?(?P<side>SIDE)(?: hand| side)? target|(?:the )?target (?:on|at|to) (?:the "
    r"|your )"
    r"(?P<on>SIDE)(?: side)?"
)
_VISIT = compiled(
    r"(?:(?:on|at|during|for|in|with|upon) )?(?:exactly )?(?:the |its |his )?(?:cube's )?"
    r"(?P<rank>NTH) OCCASIONOF(?: ARRIVAL)?(?: OF)?"
    r"|(?:on|at|during|for) (?:OCCASION )(?:number |no )?(?P<number>NUMBER)OF"
    r"|(?:wait )?(?:when|as|once|whenever|the moment|at the moment|as soon as|until) CUBE (?:has "
    r"|is )?"
    r"GETS(?: (?:ON)?GOALTARGET)? (?:for )?(?:the |its )?(?P<when>NTH) (?:time|visit)"
    r"(?: (?:ON)?GOALTARGET)?"
    r"|(?:when|as|once|as soon as) CUBE makes (?:the |its )(?P<makes>NTH) OCCASIONOF",
    _PARTS,
)
_NEXT = compiled(
    r"(?:(?:on|at|during|for) )?(?:the |its )(?:very )?(?:next|following) (?:OCCASION|one)OF"
    r"(?: ARRIVAL)?|(?:when|as soon as) it (?:comes|gets|arrives|is) (?:back|there again|again)",
    _PARTS,
)
_PASSED = compiled(
    r"(?:let|allow|wait|after|once|until|when)(?: (?:for|until|till|that))* (?:CUBE )?"
    r"(?:to |has |have )?(?:GETS )?(?:by )?(?:(?:ON)?GOALTARGET )?MANY(?: (?:ON)?GOALTARGET)?"
    r"(?: first)?",
    _PARTS,
)
_TIMES = compiled(
    r"(?:(?:for )?a total of |for |in all |all in all |x )?(?:(?P<number>NUMBER) (?:time|times|x"
    r"|rounds?|cycles?|reps?|repetitions|laps?|swings?)|(?P<adverb>once|twice|thrice)"
    r"|a (?P<single>single) time)(?: (?:in total|total|in all|altogether|overall|in a row|over))*"
    r"|x (?P<x>NUMBER)"
)
_MORE = compiled(
    r"(?:(?P<number>NUMBER) (?:more times?|times? more|additional times?|further times?)"
    r"|another (?P<another>NUMBER) times|another time|a second time|(?P<adverb>once|twice) more"
    r"|once again)"
)
_WAY = compiled(
    r"(?:from|starting (?:at|from)) (?:the |your )?(?P<start>SIDE)HAND(?: target| one)?(?: over)?"
    r" (?:, )?(?:and )?(?:then )?(?:OVER )?(?:the |your )?(?P<end>SIDE)HAND(?: target| one)?"
    r"(?: between (?:the |both )?(?:two )?targets)?"
    r"|(?:first )?(?:OVER )?(?:both )?(?:the |your )?(?P<over>SIDE)HAND(?: target| one)?"
    r" (?:(?:,|and|then|to|next) )*(?:OVER )?(?:the |your )?(?P<then>SIDE)HAND (?:target|one)",
    {"OVER": r"(?:over|to|above|on|to the top of|on top of|towards?|over to)",
     "HAND": r"(?:[ -]hand|[ -]side)?"},
)  # fmt: skip


def _times(found: FoundPhrase) -> int:
    """Return the number of repetitions that a phrase names: 3 for *three times*, 2 for *twice*.

    Each group of the phrase holds another way to say it; without a number it is once.
    """
    for name in ("number", "many", "another", "x"):
        if found[name]:
            return number_of(found[name]) or 0
    return ADVERBS[found["adverb"] or "once"]


def _rank(words: list[str]) -> int | None:
    """Return the only rank that ordinals name: 2 for ``["second", ""]``, -1 for ``["last"]``.

    None if they name none or two that differ.
    """
    ranks = {_RANK_FROM_END.get(word) or ordinal_of(word) for word in words if word}
    return ranks.pop() if len(ranks) == 1 else None


def _visit(found: FoundPhrase) -> Visit | None:
    """Return the visit that a phrase names; None if it names several."""
    if found["number"]:
        return Visit(number_of(found["number"]))
    rank = _rank([found["rank"], found["when"], found["makes"]])
    return None if rank is None else Visit(rank)


def _next_visit(_found: FoundPhrase) -> Visit:
    """Return the next visit, whichever that is."""
    return Visit(None)


def _way(found: FoundPhrase) -> TargetWay:
    """Return the sides that a phrase names, in its order."""
    sides = (found["start"], found["end"], found["over"], found["then"])
    return TargetWay(tuple(side for side in sides if side))


def _side_target(found: FoundPhrase) -> Target:
    """Return the target on a side."""
    return Target(found["side"] or found["on"])


def _target(found: FoundPhrase) -> Target | None:
    """Return a target with the placement that its words name; None if they name several.

    A placement is that of the cube in the video: *the second target used before the press* has the
    rank 2 and the relation ``before``. The groups of the phrase hold ordinals and numbers.
    """
    ordinals = [found["rank"], found["at"], found["of"], found["first"]]
    rank = _rank(ordinals)
    if rank is None and any(ordinals):
        return None  # "the second target used first"
    number = found["placing"] or found["number"]
    if number:
        rank = number_of(number)
    return Target(None, rank, _relation(found["when"]))


def _relation(word: str) -> Relation | None:
    """Return the relation to the press that a word names, *pre* or *after*; None without one."""
    if not word:
        return None
    if word in ("pre", "before"):
        return "before"
    return "after"


TARGET_RULES = (
    # Before single targets: "from your right to your left target".
    PhraseRule("way", _WAY, _way),
    PhraseRule("target", _SIDE_TARGET, _side_target),
    PhraseRule("target", _PRESS_TARGET, _target),
    PhraseRule("target", _WHERE, _target),
    # Before single placements: "the target of the last placement".
    PhraseRule("target", _TARGET, _target),
    PhraseRule("target", _PLACING, _target),
    # After targets, which these may hold: "the second time it passes target#1".
    PhraseRule("passed", _PASSED, _times),
    PhraseRule("visit", _VISIT, _visit),
    PhraseRule("visit", _NEXT, _next_visit),
)
"""Targets, and visits of a cube to one; where nothing is said, the order does not matter."""
TIMES_RULES = (
    # Before other numbers: "three times more".
    PhraseRule("more", _MORE, _times),
    PhraseRule("times", _TIMES, _times),
)
"""Repetitions."""
