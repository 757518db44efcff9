"""Read counts, visits and targets: *twice*, *at the third visit*, *the second target in the video*.

- A *visit* begins when the moving cube of StopCube reaches its target.
- A *placement* is a moment of the video: the robot puts a cube on a target. Ranks count these.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

from roboirg.reader.phrases import PhraseMatch, PhraseRule, compiled
from roboirg.reader.tokens import ADVERBS, number_of, ordinal_of

Relation = Literal["before", "after"]
LAST = -1
LAST_BUT_ONE = -2
"""Ranks are counted from 1; negative ones count from the end, like indices of a list."""


class Visit(NamedTuple):
    """A visit of the moving cube to its target.

    *At the second visit* gives ``Visit(2)``, *the last time it gets there* ``Visit(LAST)``.

    Attributes:
        rank: 1 for the first visit, negative from the end; None for *the next visit*.
    """

    rank: int | None


class SwingPath(NamedTuple):
    """The sides of the targets over which a cube is swung, in order.

    *From your right to your left target* gives ``SwingPath(("right", "left"))``.
    """

    sides: tuple[str, ...]


class Target(NamedTuple):
    """What words say of a target; None where they say nothing.

    *The second target used before the press* gives ``Target(rank=2, relation="before")``, *the
    left target* ``Target(side="left")``.

    Attributes:
        side: ``left`` or ``right`` of the robot.
        rank: which of the video's placements was on this target: 1 for the first, negative from
            the end.
        relation: whether that placement came before or after the press of the button.
    """

    side: str | None = None
    rank: int | None = None
    relation: Relation | None = None


# The patterns below are for phrases in their normalized spelling, in which targets that were read
# before are placeholders, `target#1`. Names in capitals stand for the parts in `_PARTS`.
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
# "the second target", "target number 2", "the target used before the press"
_TARGET = compiled(
    r"(?:the |a |that |same |very )*(?:(?P<rank>NTH) )?(?:of the (?:two |three |four )?)?targets?"
    r"(?: number (?P<number>NUMBER)| of the (?P<of>NTH) (?:placement|placing)"
    r"| of (?:placement|placing) (?:number )?(?P<placing>NUMBER))?"
    r"(?: (?:USED|SHOWN|WHEN)(?: (?:(?:for )?the )?(?P<at>NTH)(?: time)?)?)*",
    _PARTS,
)
# "where the cube was put second", "the spot where it stood before the button was pressed"
_WHERE = compiled(
    r"(?:the (?:spot|place|location|position|one) )?(?:where|on which|on what) (?:the )?WHO AUX"
    r"(?:(?P<first>NTH) )?(?:DONE(?: WHO| it| the cube| a cube)?(?: (?:on|down|to|at|there))* )?"
    r"(?:(?:SHOWN )?WHEN(?: SHOWN)?|(?:SHOWN )?(?:(?:for )?the )?(?P<at>NTH)(?: time)?(?: SHOWN)?"
    r"|SHOWN)",
    _PARTS,
)
# "the pre press target"
_PRESS_TARGET = compiled(r"(?:the )?(?P<when>pre|post|before|after) press target", _PARTS)
# "the second placement", "the last spot used in the video"
_PLACING = compiled(
    r"(?:the )?(?P<rank>NTH) (?:placement|placing|spot|place|location|position)(?: "
    r"(?:USED|SHOWN))*",
    _PARTS,
)
# "your left target", "the target on the left"
_SIDE_TARGET = compiled(
    r"(?:the |your )?(?P<side>SIDE)(?: hand| side)? target|(?:the )?target (?:on|at|to) (?:the "
    r"|your )"
    r"(?P<on>SIDE)(?: side)?"
)
# "at the third visit", "on visit number 3", "when the cube gets there for the third time"
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
# "at the next visit", "when it comes back"
_NEXT = compiled(
    r"(?:(?:on|at|during|for) )?(?:the |its )(?:very )?(?:next|following) (?:OCCASION|one)OF"
    r"(?: ARRIVAL)?|(?:when|as soon as) it (?:comes|gets|arrives|is) (?:back|there again|again)",
    _PARTS,
)
# "let the cube pass twice", "after two visits"
_PASSED = compiled(
    r"(?:let|allow|wait|after|once|until|when)(?: (?:for|until|till|that))* (?:CUBE )?"
    r"(?:to |has |have )?(?:GETS )?(?:by )?(?:(?:ON)?GOALTARGET )?MANY(?: (?:ON)?GOALTARGET)?"
    r"(?: first)?",
    _PARTS,
)
# "three times", "twice in total", "x 3"
_TIMES = compiled(
    r"(?:(?:for )?a total of |for |in all |all in all |x )?(?:(?P<number>NUMBER) (?:time|times|x"
    r"|rounds?|cycles?|reps?|repetitions|laps?|swings?)|(?P<adverb>once|twice|thrice)"
    r"|a (?P<single>single) time)(?: (?:in total|total|in all|altogether|overall|in a row|over))*"
    r"|x (?P<x>NUMBER)"
)
# "two more times", "another time", "once more"
_MORE = compiled(
    r"(?:(?P<number>NUMBER) (?:more times?|times? more|additional times?|further times?)"
    r"|another (?P<another>NUMBER) times|another time|a second time|(?P<adverb>once|twice) more"
    r"|once again)"
)
# "from the right to the left target", "over the right target, then to the left target"
_SWING_PATH = compiled(
    r"(?:from|starting (?:at|from)) (?:the |your )?(?P<start>SIDE)HAND(?: target| one)?(?: over)?"
    r" (?:, )?(?:and )?(?:then )?(?:OVER )?(?:the |your )?(?P<end>SIDE)HAND(?: target| one)?"
    r"(?: between (?:the |both )?(?:two )?targets)?"
    r"|(?:first )?(?:OVER )?(?:both )?(?:the |your )?(?P<over>SIDE)HAND(?: target| one)?"
    r" (?:(?:,|and|then|to|next) )*(?:OVER )?(?:the |your )?(?P<then>SIDE)HAND (?:target|one)",
    {"OVER": r"(?:over|to|above|on|to the top of|on top of|towards?|over to)",
     "HAND": r"(?:[ -]hand|[ -]side)?"},
)  # fmt: skip


def _read_number_of_times(match: PhraseMatch) -> int:
    """Return the number in a phrase: 3 for *three times*, 2 for *twice more* or *another 2 times*.

    Each group of the patterns holds another wording of the number. Phrases without any, *one more
    time* or *once again*, mean 1.
    """
    for name in ("number", "many", "another", "x"):
        if match[name]:
            return number_of(match[name]) or 0
    return ADVERBS[match["adverb"] or "once"]


def _common_rank(ordinals: list[str]) -> int | None:
    """Return the rank that all ordinals agree on: 2 for ``["second", ""]``, -1 for ``["last"]``.

    Empty texts are ordinals that were not said. None if none was, or if two differ.
    """
    ranks = {_RANK_FROM_END.get(word) or ordinal_of(word) for word in ordinals if word}
    return ranks.pop() if len(ranks) == 1 else None


def _read_visit(match: PhraseMatch) -> Visit | None:
    """Return the visit that a phrase names: ``Visit(2)`` for *at the second visit*.

    None if it names several, so that the phrase stays unread.
    """
    if match["number"]:  # "at visit 2"
        return Visit(number_of(match["number"]))
    rank = _common_rank([match["rank"], match["when"], match["makes"]])
    return None if rank is None else Visit(rank)


def _read_next_visit(_match: PhraseMatch) -> Visit:
    """Return the next visit, *the next time it gets there*, without saying which one that is."""
    return Visit(None)


def _read_swing_path(match: PhraseMatch) -> SwingPath:
    """Return the sides that a phrase names: *over the right to the left target* -> right, left."""
    sides = (match["start"], match["end"], match["over"], match["then"])
    return SwingPath(tuple(side for side in sides if side))


def _read_side_target(match: PhraseMatch) -> Target:
    """Return the target on a side: *your left target*, or *the target on the left*."""
    return Target(match["side"] or match["on"])


def _read_target(match: PhraseMatch) -> Target | None:
    """Return a target that is named by a placement of the video.

    *The second target used before the press* gives ``Target(rank=2, relation="before")``, *the
    target of placement 3* ``Target(rank=3)``, and *the target after the press* no rank. None if its
    ordinals contradict each other, *the second target used first*, so that the phrase stays unread.

    Reads `_PRESS_TARGET`, `_WHERE`, `_TARGET` and `_PLACING`; a group that a pattern lacks, or that
    matched nothing, is ``""``.
    """
    relation = _relation(match["when"])
    ordinals = [match["rank"], match["at"], match["of"], match["first"]]
    rank = _common_rank(ordinals)
    if rank is None and any(ordinals):
        return None
    number = match["placing"] or match["number"]
    if number:
        rank = number_of(number)
    return Target(None, rank, relation)


def _relation(word: str) -> Relation | None:
    """Return ``before`` for *pre* or *before*, ``after`` for *post* or *after*, None for ``""``."""
    if not word:
        return None
    if word in ("pre", "before"):
        return "before"
    return "after"


# Rules apply from first to last, and take their words from those after them.
TARGET_RULES = (
    # Before single targets: "from your right to your left target".
    PhraseRule("way", _SWING_PATH, _read_swing_path),
    PhraseRule("target", _SIDE_TARGET, _read_side_target),
    PhraseRule("target", _PRESS_TARGET, _read_target),
    PhraseRule("target", _WHERE, _read_target),
    # Before single placements: "the target of the last placement".
    PhraseRule("target", _TARGET, _read_target),
    PhraseRule("target", _PLACING, _read_target),
    # After targets, which these may hold: "the second time it passes target#1".
    PhraseRule("passed", _PASSED, _read_number_of_times),
    PhraseRule("visit", _VISIT, _read_visit),
    PhraseRule("visit", _NEXT, _read_next_visit),
)
"""Targets, and visits of a cube to one. Rules without a comment could stand in any order."""
TIMES_RULES = (
    # Before other numbers: "three times more".
    PhraseRule("more", _MORE, _read_number_of_times),
    PhraseRule("times", _TIMES, _read_number_of_times),
)
"""Repetitions."""
