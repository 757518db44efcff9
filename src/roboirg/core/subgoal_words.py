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
_FORMS: tuple[tuple[str, PrimitiveKind, str | None], ...] = (
    (
        rf"{_PICK} (?:{_ORDINAL} )?(?:correct )?{_COLOR}(?P<thing>cube|tape)(?: up)?{_TIME}",
        "pick_cube",
        None,
    ),
    (
        rf"{_PICK} (?:correct )?container(?: up)?(?: that hides the \w+ cube)?",
        "pick_container",
        "container",
    ),
    (rf"(?:place|put|drop) {_HELD} on(?:to)? (?:the )?(?:correct )?target", "place_on", "target"),
    (rf"(?:place|put|drop) {_HELD} in(?:to)? the bin", "drop_into", "bin"),
    (rf"(?:place|put|drop) {_HELD} in(?:to)? the {_COLOR}box", "put_into", "box"),
    (
        rf"move to the top of the (?:(?P<side>right|left)(?:-side)? )?target{_TIME}",
        "move_over",
        "target",
    ),
    (rf"(?:place|put|drop) {_HELD} on(?:to)? (?:the )?table", "put_down", None),
    (rf"put (?:{_HELD} down|down {_HELD})", "put_down", None),
    (r"move to the top of the button(?: to prepare)?", "hover", "button"),
    (r"press the button to stop the cube on the target", "press", "target"),
    (rf"press the (?:{_ORDINAL} )?button(?: to stop| to finish)?", "press", "button"),
    (r"(?:remain )?static|hold still|leave the tapes where they are", "hold", None),
)
"""The words of each form; the primitive; the kind of object that a point or the words select, if
one does. Words about what is hidden or correct are read and select nothing."""


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
    """Return what a subgoal asks for; None if it has no form of the grammar."""
    words, point = split_point(" ".join(subgoal.lower().split()).rstrip("."))
    words, steps = split_steps(words)
    for form, kind, thing in _FORMS:
        if (found := re.fullmatch(form, words)) is not None:
            said = found.groupdict()
            return Request(
                kind,
                said.get("thing") or thing,
                said.get("color"),
                said.get("side"),
                point,
                WAIT_STEPS if steps is None else steps,
            )
    return None
