"""Read descriptions of objects, *the red cube next to the button*, and of places on the table.

The objects (*things*) are cubes, tapes, boxes and containers. An *anchor* is the reference object
of a place: in *next to the button*, the button. In patterns, ``thing#3`` and ``place#4`` are
placeholders for phrases that were read before (`roboirg.reader.phrases`).
"""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from typing import Literal, NamedTuple, cast

from roboirg.reader.phrases import PhraseMatch, PhraseRule, PlaceholderText, Rewrites, compiled
from roboirg.reader.places import Place, Side
from roboirg.reader.tokens import color_of, number_of, ordinal_of

Moment = Literal["start", "end"]
"""Before the first swap of things, or after the last one."""
ALL_OF_THEM = -1
"""The number in the description *all red cubes*."""


class Description(NamedTuple):
    """What words say of one thing or of several; None where they say nothing.

    *two red cubes* gives ``Description("cube", color="red", number=2)``, *the container over the
    red one* ``Description("container", number=1, is_definite=True, covers=...)``.

    Attributes:
        noun: ``cube``, ``container``, ``box`` or ``tape``; ``one`` for any of them.
        color: of the thing.
        number: how many of them, or `ALL_OF_THEM`.
        is_definite: whether it is *the* or *that*, so that it may have been named before.
        is_shown: whether it is the one that the video shows.
        place: where it stands.
        moment: when it stands at its place, which swaps may change.
        covers: the cube under a container.
        same_color_as: another thing, in *two more of the same color as the red cube*.
    """

    noun: str
    color: str | None = None
    number: int | None = None
    is_definite: bool = False
    is_shown: bool = False
    place: Place | None = None
    moment: Moment | None = None
    covers: Description | None = None
    same_color_as: Description | None = None

    @property
    def leaves_color_open(self) -> bool:
        """Whether nothing says which color, as in *a cube*: no color, place or other thing."""
        clues = (self.color, self.place, self.covers, self.same_color_as)
        return all(clue is None for clue in clues)


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
"""Words for a place move behind the noun: *the left cube* -> *the cube on the left*.

The order counts, so that the longer of two wordings is found.
"""
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
        Place("side", allows_several=True),
    r"RANKEDNEAREST(?: to| from)? YOU|all the way (?:in|at|to) the front": Place("depth", depth=-1),
    r"RANKEDfarthest(?: away)?(?: from| to)? YOU|farthest away(?! from)"
    r"|all the way (?:in|at|to) the back": Place("depth", depth=1),
    r"(?:in|at) (?:the )?front|(?:close|near|right next) to YOU": Place("depth", None, -1,
                                                                        allows_several=True),
    r"(?:in|at) (?:the )?(?:back|rear)|far (?:away )?from YOU": Place("depth", None, 1,
                                                                      allows_several=True),
    r"in (?:the )?(?:exact |very )?middle(?: of the (?:table|row|workspace|three))?":
        Place("middle"),
    r"between ANCHOR and OTHER": Place("between"),
    r"(?:to|on) the ACROSS(?: side)? of ANCHOR": Place("aside"),
    r"RANKEDNEAREST to ANCHOR": Place("distance", depth=-1),
    r"RANKEDfarthest (?:away )?from ANCHOR": Place("distance", depth=1),
    r"(?:right )?(?:next to|by|near|close to|beside|adjacent to|near to) ANCHOR":
        Place("distance", depth=-1, allows_several=True),
}  # fmt: skip
"""Wordings of places, in the order in which they are tried, and what each says by itself.

`_read_place` adds what the words name: the side, the rank, the anchors.
"""
_MAX_DEPTH = 3
"""Anchors that are described by further anchors, up to this many deep, are read."""
_BACK = ("back", "far", "top", "rear")
"""Words for the side of the table that is away from the robot."""
# "place#1 of the two place#2": on the left of the two in the back
_AMONG = compiled(
    r"place#(?P<place>\d+) (?:among|of) (?:the )?(?P<size>NUMBER) (?:(?:cubes|containers|ones) )?"
    r"place#(?P<group>\d+)"
)

# "the red cube", "two more cubes", "the same container"
_NAMED = compiled(
    r"(?P<det>DET)?(?:(?P<count>NUMBER) (?:more |of the |of those |of )?)?"
    r"(?P<shown>(?:very )?same |video |shown |demonstrated |correct )?(?:single |moving )?"
    r"(?:(?P<color>COLOR)s?(?: colored)? )?(?!one "
    r"(?:like|of|COLOR)\b)(?P<noun>cube|container|tape|box|one)(?:e?s)?",
    _PARTS,
)
# "blue", "two greens": without a noun
_COLORED = compiled(
    r"(?P<det>DET)?(?:(?P<count>NUMBER) (?:more |of the )?)?(?P<color>COLOR)s?", _PARTS
)
# "blue's container", "the red cube's container", "the blue container"
_OWNED = compiled(
    r"(?:the )?(?P<color>COLOR)(?:'s| (?:cube|one)'s)(?: container| one)?"
    r"|(?:the )?(?P<other>COLOR) container",
    _PARTS,
)
# "two more of the same color as thing#1", "two like thing#1"
_SAME_COLOR = compiled(
    r"(?P<count>NUMBER|an?)(?: more)?(?: cubes?)? (?:like|(?:of|in|with) the (?:same )?color "
    r"(?:as|of)|the (?:same )?color (?:as|of)) thing#(?P<like>\d+)"
)
# "thing#1 that was place#2": the cube that was on the left
_STANDING = compiled(
    r"thing#(?P<thing>\d+)(?P<words>(?: WHERE| LATER| EARLIER)*) place#(?P<place>\d+)"
    r"(?P<time> LATER| EARLIER)?",
    _PARTS,
)
# "thing#1 over thing#2": the container over the red cube
_COVERING = compiled(
    r"thing#(?P<thing>\d+) OVER thing#(?P<under>\d+)(?: (?:HIDDEN )?BELOW it| in it| HIDDEN| "
    r"BELOW)?"
    r"(?: in VIDEO)?",
    _PARTS,
)
# "thing#1 over it"
_COVERING_IT = compiled(r"thing#(?P<thing>\d+) OVER (?:it|them)", _PARTS)
# "thing#1 over place#2": the container over what is on the left
_COVERING_PLACE = compiled(r"thing#(?P<thing>\d+) (?:over|above|on top of) place#(?P<place>\d+)")
# "thing#1 under which thing#2 is hidden"
_COVERED = compiled(
    r"thing#(?P<thing>\d+) (?:(?:BELOW|on|at) which|where|that|which|you (?:can )?find"
    r"|(?:that|where) you (?:can )?find)(?: is)? thing#(?P<under>\d+)(?: is| was)?(?: HIDDEN)?"
    r"(?: BELOW)?",
    _PARTS,
)
# "thing#1 that was lifted in the video"
_SHOWN = compiled(
    r"thing#(?P<thing>\d+)(?: (?:as|like|used|shown|moved|handled|seen|that|which|you|the robot|was"
    r"|were|had|being|been|it|saw|has|did|is|previously|picked|lifted|picks|lifts|up|down|and|put"
    r"|from|placed"
    r"))* (?:(?:in|from|of|during|by) VIDEO(?: before)?|as before"
    r"|(?:picked|lifted)(?: up)?(?: before| earlier| previously)?|before|earlier)",
    _PARTS,
)
# "two of each color"
_EACH = compiled(r"(?P<count>NUMBER|an?) (?:cube )?(?:(?:of|from|in) (?:each|every)|per) color")


def read_things(sentence: PlaceholderText) -> None:
    """Replace the descriptions of things in a sentence by placeholders.

    *lift the red cube on the left* first becomes ``lift thing#0 place#1``, and then ``lift
    thing#2``: the meaning of number 2 is a `Description` with color and place.
    """
    sentence.text = _BEHIND_NOUNS.apply(sentence.text)
    sentence.apply(_NAMES)
    # Descriptions may follow descriptions: "the cube on the left of the cube next to the bin".
    while sentence.apply(_DESCRIPTIONS):
        pass
    sentence.apply(_LIKENESSES)


def _read_place(match: PhraseMatch, place: Place) -> Place | None:
    """Return a place with what its words name: a side, a rank, and the anchors.

    *second from the left* has the side ``left`` and the rank 2; *next to the bin* has the anchor
    ``"bin"``. None if anchors are nested too deep to be read.

    Args:
        match: the words, *second from the left*.
        place: what all places with this wording have, ``Place("side")``.
    """
    if match["depth"]:  # "at the back left"
        place = place._replace(depth=1 if match["depth"] in _BACK else -1)
    anchors = tuple(_anchor(match, group) for group in ("anchor", "other") if match[group])
    if any(map(_is_too_deep, anchors)):
        return None
    return place._replace(
        side=cast("Side | None", match["side"] or None),
        rank=ordinal_of(match["rank"]) or 1,
        is_in_picture="picture" in match.text or "camera" in match.text,
        anchors=anchors,
    )


def _is_too_deep(anchor: object) -> bool:
    """Return whether an anchor is described by an anchor that is described by another, and so on.

    *the cube next to the cube next to the cube next to the cube by the bin* is too deep to be read.
    """
    levels = 0
    while isinstance(anchor, Description) and anchor.place is not None and anchor.place.anchors:
        anchor = anchor.place.anchors[0]
        levels += 1
    return levels >= _MAX_DEPTH


def _anchor(match: PhraseMatch, group: str) -> object:
    """Return the reference object of a place, as `Place` keeps it in `anchors`.

    ``thing#3`` gives the `Description` that it stands for; a fixture gives its kind, ``the bin``
    the text ``"bin"`` and ``target#1`` ``"target"``.
    """
    kind, _, _ = match[group].partition("#")
    if kind == "thing":
        return match.value(group)
    return kind.removeprefix("the ")


def _read_place_in_group(match: PhraseMatch) -> Place:
    """Return a place among a few things: *on the left of the two in the back*.

    It is the place *on the left*, with the group *in the back* of the size 2.
    """
    place: Place = match.value("place")
    return place._replace(group=match.value("group"), group_size=number_of(match["size"]) or 0)


def _read_number_of_each(match: PhraseMatch) -> int:
    """Return how many cubes of each color are meant: 2 for *two of each color*, 1 for *a cube*."""
    return number_of(match["count"]) or 1


def _read_named(match: PhraseMatch) -> Description:
    """Return the description of a thing by a noun, a color or both.

    *two red cubes* gives ``Description("cube", "red", 2)``, and *blue* without a noun
    ``Description("one", "blue", 1)``. *The*, *this* and the like make it definite.
    """
    determiner, _, _ = match["det"].partition(" ")  # of "all of the", the first word
    if match["count"]:
        number = number_of(match["count"])
    else:
        number = _number_by_determiner(determiner, is_plural=match.text.endswith("s"))
    return Description(
        match["noun"] or "one",
        color_of(match["color"]),
        number,
        is_definite=determiner in ("the", "this", "that", "those", "these", "your"),
        is_shown=bool(match["shown"]),
    )


def _number_by_determiner(determiner: str, *, is_plural: bool) -> int | None:
    """Return how many things are meant where no number is said.

    *all cubes* gives `ALL_OF_THEM`, *a cube* or *the cube* 1, and *the cubes* None: unclear.
    """
    if determiner in ("all", "each", "every", "both"):
        return ALL_OF_THEM
    if determiner in ("a", "an", "another", "the", "") and not is_plural:
        return 1
    return None


def _read_same_color(match: PhraseMatch) -> Description:
    """Return cubes of the color of another thing: *two more of the same color as the red one*."""
    number = number_of(match["count"]) or 1
    return Description("cube", number=number, same_color_as=match.value("like"))


def _read_standing(match: PhraseMatch) -> Description | None:
    """Return a thing with the place that the words after it name: *the cube on the left*.

    *the cube that was on the left* also says when it stood there: at the start. None if the thing
    has a place already or covers something, so that the words stay unread.
    """
    thing: Description = match.value("thing")
    if thing.place is not None or thing.covers is not None:
        return None
    moment = _moment(match["words"], match["time"])
    return thing._replace(place=match.value("place"), moment=moment)


def _read_covering(match: PhraseMatch) -> Description | None:
    """Return a container by what it covers: *the container over the red cube*; None if unfit."""
    return _container_over(match.value("thing"), match.value("under"))


def _read_covering_place(match: PhraseMatch) -> Description | None:
    """Return a container by where its cube is: *the container over the place on the left*.

    None if it cannot be one, as in *the red cube over the place on the left*.
    """
    cube = Description("cube", is_definite=True, place=match.value("place"))
    return _container_over(match.value("thing"), cube)


def _read_covering_it(match: PhraseMatch) -> Description:
    """Return a thing as it is: in *the container over it*, the last two words say no more."""
    thing: Description = match.value("thing")
    return thing


def _read_shown(match: PhraseMatch) -> Description:
    """Return a thing as the one of the video: *the cube that was lifted in the video*."""
    thing: Description = match.value("thing")
    return thing._replace(is_shown=True)


def _read_owned(match: PhraseMatch) -> Description:
    """Return the container over a cube of a color: *blue's container*, *the blue container*."""
    cube = Description("cube", color_of(match["color"] or match["other"]))
    return Description("container", is_definite=True, covers=cube)


def _container_over(container: Description, cube: Description) -> Description | None:
    """Return a container that is described by the cube under it.

    None if the first description cannot be of a container or the second of a cube, or if the
    container is described already, as in *the red container over the blue cube*.
    """
    if container.noun not in ("container", "one") or cube.noun not in ("cube", "one"):
        return None
    if not container.leaves_color_open:
        return None
    return container._replace(noun="container", covers=cube._replace(noun="cube"))


def _moment(*words: str) -> Moment | None:
    """Return when a thing stands at its place, by the words around the place.

    *now* and *currently* mean ``end``; *was*, *at first*, *initially* or *in the video* mean
    ``start``. None if no word says it.
    """
    text = " ".join(words)
    if re.search(r"\b(?:now|currently|at the moment)\b", text):
        return "end"
    if re.search(r"\b(?:was|were|stood|sat|started|start|beginning|first|\w+ally|video)\b", text):
        return "start"
    return None


# Rules apply from first to last, and take their words from those after them.
_NAMES = (
    # "two of each color" and "blue's container" hold a number, a color or a noun of their own.
    PhraseRule("each", _EACH, _read_number_of_each),
    PhraseRule("thing", _OWNED, _read_owned),
    # With a noun before those without: "red cube", then "red".
    PhraseRule("thing", _NAMED, _read_named),
    PhraseRule("thing", _COLORED, _read_named),
)
"""Descriptions by a noun or color."""
_PLACE_RULES = [
    PhraseRule("place", compiled(pattern, _PARTS), functools.partial(_read_place, place=place))
    for pattern, place in _PLACES.items()
]
_DESCRIPTIONS = (
    *_PLACE_RULES,
    PhraseRule("place", _AMONG, _read_place_in_group),
    # A place goes to the nearest thing: "the container over the cube in the middle".
    PhraseRule("thing", _STANDING, _read_standing),
    PhraseRule("thing", _COVERING, _read_covering),
    PhraseRule("thing", _COVERING_PLACE, _read_covering_place),
    PhraseRule("thing", _COVERING_IT, _read_covering_it),
    PhraseRule("thing", _COVERED, _read_covering),
    PhraseRule("thing", _SHOWN, _read_shown),
)
"""Places, and words behind a thing that describe it: *on the left*, *from the video*."""
_LIKENESSES = (PhraseRule("thing", _SAME_COLOR, _read_same_color),)
"""Descriptions by another one, which has to be read first: *two like thing#1*."""
