"""Things: the words for a cube, a tape, a box or a container, and for where it stands.

- *description*: all that words say of a thing, ``Description``.
- *place*: words for where it stands; *anchor*: another thing in them, *next to the button*.
- *chunk*: what has been read stands in the patterns as ``thing#3``, ``place#4``.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from typing import Literal, NamedTuple, cast

from roboirg.reader.phrases import Chunks, FoundPhrase, PhraseRule, Rewrites, compiled
from roboirg.reader.places import Place, Side
from roboirg.reader.tokens import color_of, number_of, ordinal_of

PlaceMoment = Literal["first", "last"]
ALL_OF_THEM = -1
"""The number of *all red cubes*."""


class Description(NamedTuple):
    """A description of one thing or of several.

    Attributes:
        noun: ``cube``, ``container``, ``box`` or ``tape``; ``one`` for any of them.
        color: of the thing.
        number: how many of them, or `ALL_OF_THEM`; None if the words do not say.
        is_definite: whether it is *the* or *that*, so that it may have been named before.
        is_shown: whether it is the one that the video shows.
        place: where it stands.
        moment: of the place: before or after things change places.
        under: what a container covers.
        like: what has the same color.
    """

    noun: str
    color: str | None = None
    number: int | None = None
    is_definite: bool = False
    is_shown: bool = False
    place: Place | None = None
    moment: PlaceMoment | None = None
    under: Description | None = None
    like: Description | None = None

    @property
    def is_open(self) -> bool:
        """Whether the words say nothing about the color."""
        return (
            self.color is None and self.place is None and self.under is None and self.like is None
        )


_PARTS = {
    "DET": r"(?:(?:all (?:of )?(?:the )?|each |every |both |those |these |this |that |the |an? "
    r"|any "
    r"|its |another |whichever )(?:of (?:the|those) )?)",
    "THINGS": r"(?:(?:COLOR )?(?:cube|container|tape|box|one)(?:e?s)?)",
    "DEEP": r"(?P<depth>front|back|near|far|top|bottom|rear)",
    "ACROSS": r"(?P<side>SIDE)",
    "ANCHOR": r"(?P<anchor>(?:thing|target|button)#\d+|(?:the )?bin)(?!INNER)",
    "OTHER": r"(?P<other>(?:thing|target|button)#\d+|(?:the )?bin)(?!INNER)",
    "INNER": r" (?:WHERE )*(?:place#|ORDINAL NEAREST|NEAREST|farthest|next to|near|between|beside"
    r"|right (?:by|next))",
    "RANKED": r"(?:(?P<rank>ORDINAL)(?: one| place)? )?",
    "NEAREST": r"(?:closest|nearest|next closest|next nearest)",
    "THE": r"(?:the |your |its |a )",
    "OWN": r"(?:the |your |the camera's )?",
    "EDGE": r"(?: hand)?(?: side| end| edge)?(?: of the (?:table|workspace|board|row))?",
    "WHERE": r"(?:(?:(?:that|which) )?(?:is|are|stands?|sits?|lies|was|were|stood|started|sat)"
    r"(?: out)?|located|standing|sitting|placed|positioned|lying|found|situated)",
    "LATER": r"(?:right now|now|currently|at the moment)",
    "EARLIER": r"(?:(?:at|in) the (?:start|beginning)|at first|originally|initially|in the video)",
    "OVER": r"(?:(?:that|which) )?(?:now )?(?:(?:is|was) )?(?:now )?(?:placed )?(?:over|above|on "
    r"top of|on|hiding|hides|covering"
    r"|covers|containing|contains|concealing|conceals|holding|holds|with|has|having|around|of)",
    "BELOW": r"(?:under|underneath|beneath|below|in)",
    "HIDDEN": r"(?:hidden|hiding|placed|put|located|sitting|found|covered)",
}  # fmt: skip
_BEHIND_NOUNS = Rewrites(
    r"((?:DET)?(?:NUMBER )?)(cubes?|box|boxes|tapes?|ones?) (?:of|in|that is|which is|colored)(?: "
    r"the)?"
    r"(?: color)? (COLOR)(?: color)?(?! (?:cube|one|box|tape))=>\1\3 \2",
    r"((?:DET)?)(?:(front|back|near|far|top|bottom) )(SIDE)(?: hand)? (THINGS)=>\1\4 at the \2 \3",
    r"((?:DET)?)(SIDE)(?: hand)? (THINGS)=>\1\3 on the \2",
    r"((?:DET)?)(?:far )?(SIDE)most (THINGS)=>\1\3 \2most",
    r"((?:DET)?)(ORDINAL )?(NEAREST|farthest) (THINGS) (to|from)=>\1\4 \2\3 \5",
    r"((?:DET)?)(ORDINAL) (THINGS)(?= from (?:the |your )?(?:SIDE|front|back|rear))=>\1\3 \2",
    r"((?:DET)?)(ORDINAL )?(NEAREST|farthest) (THINGS)=>\1\4 \2\3 to you",
    r"((?:DET)?)(?:very )?middle (THINGS)=>\1\2 in the middle",
    r"((?:DET)?)(front|back|rear) (THINGS)=>\1\3 in the \2",
    parts=_PARTS,
)
"""Words for a place that stand before a noun go behind it."""
_PLACES: Mapping[str, Place] = {
    r"(?:(?:in|at|near|NEAREST to|toward|towards) )?OWN(?P<depth>front|back|rear|top|bottom)(?: "
    r"and)? "
    r"ACROSS(?: corner)?(?: of the (?:table|workspace|board))?(?! side)": Place("corner"),
    r"(?:(?:in|at|near|NEAREST to) )?OWN(?P<depth>near|far) ACROSS corner(?: of the table)?":
        Place("corner"),
    r"NEAREST to OWNACROSS corner DEEP(?: to| from)? YOU": Place("corner"),
    r"RANKEDfrom OWNACROSS(?: side)?(?:PICTURE)?": Place("side"),
    r"RANKEDfrom the DEEP": Place("depth"),
    r"RANKED(?:farthest )?(?:on|to|at|in|from) OWN(?:far |very |extreme )+ACROSSEDGE(?:PICTURE)?":
        Place("side"),
    r"RANKEDfarthest (?:on|to|at) OWNACROSSEDGE(?:PICTURE)?": Place("side"),
    r"(?:all the way|most|far|farthest) (?:on|to|at|over on) OWNACROSSEDGE(?:PICTURE)?":
        Place("side"),
    r"RANKEDACROSSmost(?:PICTURE)?": Place("side"),
    r"(?:on|to|at) OWNACROSS(?! of (?:ANCHOR|the (?:table|button)))EDGE(?:PICTURE)?":
        Place("side", is_loose=True),
    r"RANKEDNEAREST(?: to| from)? YOU|all the way (?:in|at|to) the front": Place("depth", depth=-1),
    r"RANKEDfarthest(?: away)?(?: from| to)? YOU|farthest away(?! from)"
    r"|all the way (?:in|at|to) the back": Place("depth", depth=1),
    r"(?:in|at) (?:the )?front|(?:close|near|right next) to YOU": Place("depth", None, -1,
                                                                        is_loose=True),
    r"(?:in|at) (?:the )?(?:back|rear)|far (?:away )?from YOU": Place("depth", None, 1,
                                                                      is_loose=True),
    r"in (?:the )?(?:exact |very )?middle(?: of the (?:table|row|workspace|three))?":
        Place("middle"),
    r"between ANCHOR and OTHER": Place("between"),
    r"(?:to|on) the ACROSS(?: side)? of ANCHOR": Place("aside"),
    r"RANKEDNEAREST to ANCHOR": Place("distance", depth=-1),
    r"RANKEDfarthest (?:away )?from ANCHOR": Place("distance", depth=1),
    r"(?:right )?(?:next to|by|near|close to|beside|adjacent to|near to) ANCHOR":
        Place("distance", depth=-1, is_loose=True),
}  # fmt: skip
_MAX_DEPTH = 3
"""Anchors that other anchors describe; deeper ones are not read."""
_BACK = ("back", "far", "top", "rear")
_AMONG = compiled(
    r"place#(?P<place>\d+) (?:among|of) (?:the )?(?P<size>NUMBER) (?:(?:cubes|containers|ones) )?"
    r"place#(?P<group>\d+)"
)

_NAMED = compiled(
    r"(?P<det>DET)?(?:(?P<count>NUMBER) (?:more |of the |of those |of )?)?"
    r"(?P<shown>(?:very )?same |video |shown |demonstrated |correct )?(?:single |moving )?"
    r"(?:(?P<color>COLOR)s?(?: colored)? )?(?!one "
    r"(?:like|of|COLOR)\b)(?P<noun>cube|container|tape|box|one)(?:e?s)?",
    _PARTS,
)
_COLORED = compiled(
    r"(?P<det>DET)?(?:(?P<count>NUMBER) (?:more |of the )?)?(?P<color>COLOR)s?", _PARTS
)
"""*blue*, *two greens*: without a noun."""
_OWNED = compiled(
    r"(?:the )?(?P<color>COLOR)(?:'s| (?:cube|one)'s)(?: container| one)?"
    r"|(?:the )?(?P<other>COLOR) container",
    _PARTS,
)
_LIKE = compiled(
    r"(?P<count>NUMBER|an?)(?: more)?(?: cubes?)? (?:like|(?:of|in|with) the (?:same )?color "
    r"(?:as|of)|the (?:same )?color (?:as|of)) thing#(?P<like>\d+)"
)
_STANDING = compiled(
    r"thing#(?P<thing>\d+)(?P<words>(?: WHERE| LATER| EARLIER)*) place#(?P<place>\d+)"
    r"(?P<time> LATER| EARLIER)?",
    _PARTS,
)
_COVERING = compiled(
    r"thing#(?P<thing>\d+) OVER thing#(?P<under>\d+)(?: (?:HIDDEN )?BELOW it| in it| HIDDEN| "
    r"BELOW)?"
    r"(?: in VIDEO)?",
    _PARTS,
)
_COVERING_IT = compiled(r"thing#(?P<thing>\d+) OVER (?:it|them)", _PARTS)
_COVERING_PLACE = compiled(r"thing#(?P<thing>\d+) (?:over|above|on top of) place#(?P<place>\d+)")
_COVERED = compiled(
    r"thing#(?P<thing>\d+) (?:(?:BELOW|on|at) which|where|that|which|you (?:can )?find"
    r"|(?:that|where) you (?:can )?find)(?: is)? thing#(?P<under>\d+)(?: is| was)?(?: HIDDEN)?"
    r"(?: BELOW)?",
    _PARTS,
)
_SHOWN = compiled(
    r"thing#(?P<thing>\d+)(?: (?:as|like|used|shown|moved|handled|seen|that|which|you|the robot|was"
    r"|were|had|being|been|it|saw|has|did|is|previously|picked|lifted|picks|lifts|up|down|and|put"
    r"|from|placed"
    r"))* (?:(?:in|from|of|during|by) VIDEO(?: before)?|as before"
    r"|(?:picked|lifted)(?: up)?(?: before| earlier| previously)?|before|earlier)",
    _PARTS,
)
_EACH = compiled(r"(?P<count>NUMBER|an?) (?:cube )?(?:(?:of|from|in) (?:each|every)|per) color")


def read_things(chunks: Chunks) -> None:
    """Replace the words for things, and for where they stand, by chunks.

    A chunk is one word for a phrase that was read: *the red cube on the left* first becomes
    ``thing#0 place#1``, and then ``thing#2``, which another description can follow.
    """
    chunks.text = _BEHIND_NOUNS.apply(chunks.text)
    chunks.apply(_NAMES)
    # Descriptions may follow descriptions: "the cube on the left of the cube next to the bin".
    while chunks.apply(_DESCRIPTIONS):
        pass
    chunks.apply(_LIKENESSES)


def _place(found: FoundPhrase, place: Place) -> Place | None:
    """Return a place with what its words name: a side, a rank, and the things that it refers to.

    Of *second from the left*, the side ``left`` and the rank 2; of *next to the bin*, the bin, an
    anchor. None if the anchors are described by too many others to be read.

    Args:
        found: the words, *second from the left*.
        place: of the kind that such words name.
    """
    if found["depth"]:
        place = place._replace(depth=1 if found["depth"] in _BACK else -1)
    anchors = tuple(_anchor(found, name) for name in ("anchor", "other") if found[name])
    if any(map(_is_deep, anchors)):
        return None
    return place._replace(
        side=cast("Side | None", found["side"] or None),
        rank=ordinal_of(found["rank"]) or 1,
        is_mirrored="picture" in found.text or "camera" in found.text,
        anchors=anchors,
    )


def _is_deep(anchor: object) -> bool:
    """Return whether a thing is described by a thing that is described by another, and so on.

    *the cube next to the cube next to the cube next to the cube by the bin* is too deep to be read.
    """
    levels = 0
    while isinstance(anchor, Description) and anchor.place is not None and anchor.place.anchors:
        anchor = anchor.place.anchors[0]
        levels += 1
    return levels >= _MAX_DEPTH


def _anchor(found: FoundPhrase, name: str) -> object:
    """Return the description of a thing, or the kind of a fixture: ``target#1``, ``the bin``."""
    kind, _, _ = found[name].partition("#")
    if kind == "thing":
        return found.value(name)
    return kind.removeprefix("the ")


def _member(found: FoundPhrase) -> Place:
    """Return a place among a few things, *on the left of the two in the back*."""
    place: Place = found.value("place")
    return place._replace(group=found.value("group"), size=number_of(found["size"]) or 0)


def _number_of_each(found: FoundPhrase) -> int:
    """Return how many there are of each color."""
    return number_of(found["count"]) or 1


def _named(found: FoundPhrase) -> Description:
    """Return what a phrase with a noun, a color or both says of a thing.

    *two red cubes* has the noun ``cube``, the color ``red`` and the number 2. Without a noun it is
    ``one``; *the* and *this* make it definite.
    """
    determiner, _, _ = found["det"].partition(" ")  # of "all of the", the first word
    if found["count"]:
        number = number_of(found["count"])
    else:
        number = _number_by(determiner, is_plural=found.text.endswith("s"))
    return Description(
        found["noun"] or "one",
        color_of(found["color"]),
        number,
        is_definite=determiner in ("the", "this", "that", "those", "these", "your"),
        is_shown=bool(found["shown"]),
    )


def _number_by(determiner: str, *, is_plural: bool) -> int | None:
    """Return how many things words without a number mean: *a cube* is one; None if unclear."""
    if determiner in ("all", "each", "every", "both"):
        return ALL_OF_THEM
    if determiner in ("a", "an", "another", "the", "") and not is_plural:
        return 1
    return None


def _like(found: FoundPhrase) -> Description:
    """Return cubes of the color of another thing: *one more of the same color as the red one*."""
    number = number_of(found["count"]) or 1
    return Description("cube", number=number, like=found.value("like"))


def _standing(found: FoundPhrase) -> Description | None:
    """Return a thing with the place that words after it name; None if it is described already.

    *the cube that was on the left* also says when it stood there: at first.
    """
    thing: Description = found.value("thing")
    if thing.place is not None or thing.under is not None:
        return None
    moment = _moment(found["words"], found["time"])
    return thing._replace(place=found.value("place"), moment=moment)


def _covering(found: FoundPhrase) -> Description | None:
    """Return a container over a thing."""
    return _over(found.value("thing"), found.value("under"))


def _covering_place(found: FoundPhrase) -> Description | None:
    """Return a container over what stands at a place."""
    under = Description("cube", is_definite=True, place=found.value("place"))
    return _over(found.value("thing"), under)


def _covering_it(found: FoundPhrase) -> Description:
    """Return a thing as it is: *over it* says no more."""
    thing: Description = found.value("thing")
    return thing


def _shown(found: FoundPhrase) -> Description:
    """Return a thing as the one that the video shows."""
    thing: Description = found.value("thing")
    return thing._replace(is_shown=True)


def _owned(found: FoundPhrase) -> Description:
    """Return the container over a cube, *blue's container*."""
    cube = Description("cube", color_of(found["color"] or found["other"]))
    return Description("container", is_definite=True, under=cube)


def _over(thing: Description, under: Description) -> Description | None:
    """Return the container over a cube, as the description of one thing by another.

    *the container over the red cube*. None if the first thing can be no container, the second no
    cube, or if the container has another description already.
    """
    if thing.noun not in ("container", "one") or under.noun not in ("cube", "one"):
        return None
    if thing.color is not None or thing.place is not None or thing.under is not None:
        return None
    return thing._replace(noun="container", under=under._replace(noun="cube"))


def _moment(*words: str) -> PlaceMoment | None:
    """Return at which moment of the scene a thing stands at its place: ``first`` or ``last``.

    *now* is the last one, *was* and *at first* the first. None if no word says it.
    """
    text = " ".join(words)
    if re.search(r"\b(?:now|currently|at the moment)\b", text):
        return "last"
    if re.search(r"\b(?:was|were|stood|sat|started|start|beginning|first|\w+ally|video)\b", text):
        return "first"
    return None


_NAMES = (
    # "two of each color" and "blue's container" hold a number, a color or a noun of their own.
    PhraseRule("each", _EACH, _number_of_each),
    PhraseRule("thing", _OWNED, _owned),
    # With a noun before those without: "red cube", then "red".
    PhraseRule("thing", _NAMED, _named),
    PhraseRule("thing", _COLORED, _named),
)
"""Things by their names."""
_PLACE_RULES = [
    PhraseRule("place", compiled(pattern, _PARTS), functools.partial(_place, place=place))
    for pattern, place in _PLACES.items()
]
_DESCRIPTIONS = (
    *_PLACE_RULES,
    PhraseRule("place", _AMONG, _member),
    # A place goes to the nearest thing: "the container over the cube in the middle".
    PhraseRule("thing", _STANDING, _standing),
    PhraseRule("thing", _COVERING, _covering),
    PhraseRule("thing", _COVERING_PLACE, _covering_place),
    PhraseRule("thing", _COVERING_IT, _covering_it),
    PhraseRule("thing", _COVERED, _covering),
    PhraseRule("thing", _SHOWN, _shown),
)
"""Places, and words that describe a thing and stand behind it."""
_LIKENESSES = (PhraseRule("thing", _LIKE, _like),)
"""Things of the color of another one, whose description has been read."""
