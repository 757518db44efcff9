"""Read a subgoal: RoboMME's grammar, simple or grounded, as the motion that it asks for."""

from __future__ import annotations

import re
from typing import NamedTuple

from roboirg.core.episode import ALL_COLORS, PrimitiveKind
from roboirg.core.subgoal_text import Point, split_point, split_steps

WAIT_STEPS = 16
"""Control steps of *remain static* without a number."""

_COLOR = rf"(?:(?P<color>{'|'.join(ALL_COLORS)}) )?"
_ORDINAL = "(?:first|second|third|fourth|fifth|sixth|seventh|eighth|ninth|tenth)"
_TIME = rf"(?: for the {_ORDINAL} time)?"
_PICK = "pick (?:up )?(?:the|a)"
_HELD = r"(?:it|the (?:\w+ )?(?:cube|tape|container))"


class _Form(NamedTuple):
    """The words of a subgoal, as a regular expression, and what they ask for.

    The object to select is of a `thing`, if the words do not name one; None if they select none.
    Words about what is hidden or correct are read and select nothing.
    """

    words: str
    kind: PrimitiveKind
    thing: str | None = None


_FORMS = (
    _Form(
        rf"{_PICK} (?:{_ORDINAL} )?(?:correct )?{_COLOR}(?P<thing>cube|tape)(?: up)?{_TIME}",
        "pick_cube",
    ),
    _Form(
        rf"{_PICK} (?:correct )?container(?: up)?(?: that hides the \w+ cube)?",
        "pick_container",
        "container",
    ),
    _Form(
        rf"(?:place|put|drop) {_HELD} on(?:to)? (?:the )?(?:correct )?target", "place_on", "target"
    ),
    _Form(rf"(?:place|put|drop) {_HELD} in(?:to)? the bin", "drop_into", "bin"),
    _Form(rf"(?:place|put|drop) {_HELD} in(?:to)? the {_COLOR}box", "put_into", "box"),
    _Form(
        rf"move to the top of the (?:(?P<side>right|left)(?:-side)? )?target{_TIME}",
        "move_over",
        "target",
    ),
    _Form(rf"(?:place|put|drop) {_HELD} on(?:to)? (?:the )?table", "put_down"),
    _Form(rf"put (?:{_HELD} down|down {_HELD})", "put_down"),
    _Form(r"move to the top of the button(?: to prepare)?", "hover", "button"),
    _Form(r"press the button to stop the cube on the target", "press", "target"),
    _Form(rf"press the (?:{_ORDINAL} )?button(?: to stop| to finish)?", "press", "button"),
    _Form(r"(?:remain )?static|hold still|leave the tapes where they are", "hold"),
)


class Request(NamedTuple):
    """What a subgoal asks for.

    Attributes:
        kind: of the primitive.
        thing: kind of the object to select; None if the motion needs none.
        color: that the words give the object.
        side: ``left`` or ``right`` of the robot, if the words say so.
        point: row and column in the front picture.
        steps: of waiting.
    """

    kind: PrimitiveKind
    thing: str | None = None
    color: str | None = None
    side: str | None = None
    point: Point | None = None
    steps: int = WAIT_STEPS


def read_subgoal(subgoal: str) -> Request | None:
    """Return what a subgoal asks for; None if it has no form of the grammar.

    ``"Pick up the red cube at <120, 80>."`` -> ``Request("pick_cube", thing="cube", color="red",
    point=(120, 80))``. Capitals, spaces and a final period do not matter. Each form is compared
    with the whole text, in the order of `_FORMS`; the first that fits counts.
    """
    plain = " ".join(subgoal.lower().split()).rstrip(".")
    words, point = split_point(plain)
    words, steps = split_steps(words)
    for form in _FORMS:
        found = re.fullmatch(form.words, words)
        if found is None:
            continue
        groups = found.groupdict()
        return Request(
            form.kind,
            thing=groups.get("thing") or form.thing,
            color=groups.get("color"),
            side=groups.get("side"),
            point=point,
            steps=WAIT_STEPS if steps is None else steps,
        )
    return None
