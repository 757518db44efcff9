"""Points in subgoals: from the forms that models write to pixels of the front picture.

A policy that follows grounded subgoals reads ``at <y, x>``: row and column of the front picture of
256 x 256 pixels. Models count to 1000 in both directions, and here too the row comes first.
"""

from __future__ import annotations

import re

from roboirg.policies.planning.vlm_query import UnparsableReply

PICTURE_SIZE = 256
"""Rows and columns of the front picture."""
SCALE = 1000
"""What models take for the whole height or width."""
LONGEST_SUBGOAL = 300
"""Characters; the policies cut what is longer than 128 tokens."""

_BOX = re.compile(r"(?:<\|box_start\|>)?\(\s*(\d+)\s*,\s*(\d+)\s*\)(?:<\|box_end\|>)?")
_POINT = re.compile(r"<\s*(\d+)\s*,\s*(\d+)\s*>")
_PLACE = re.compile(r" at <\d+, \d+>")
_END = re.compile(r"<\|(?:im_end|endoftext)\|>\s*$")
_FINISHED = re.compile(r"\b(?:complete|completed|finished|done)\b")


def pixel(value: int) -> int:
    """A coordinate of a model's as a row or column, 0 to 255.

    1000 is the far edge. MME-VLA makes 256 of it, which is outside of the picture.
    """
    return min(PICTURE_SIZE * value // SCALE, PICTURE_SIZE - 1)


def from_boxes(text: str) -> str:
    """A subgoal with box tokens ``<|box_start|>(y,x)<|box_end|>`` as one with pixels.

    The tokens around the numbers may be missing: servers strip them from what they return unless
    told otherwise.

    Raises:
        UnparsableReply: there is no subgoal, or one with broken points.
    """
    return _checked(_BOX.sub(_as_pixels, tidied(text)))


def from_points(text: str) -> str:
    """A subgoal with points ``<y, x>`` of 0 to 1000 as one with pixels, all in one pass.

    Raises:
        UnparsableReply: there is no subgoal, or one with broken points.
    """
    return _checked(_POINT.sub(_as_pixels, tidied(text)))


def tidied(text: str) -> str:
    """A subgoal as a model wrote it, in one line, without quotes, full stop and end token.

    In lower case, as everything that the policies were trained on.
    """
    return " ".join(_END.sub("", text).split()).lower().strip("\"'`. ")


def without_places(subgoal: str) -> str:
    """A subgoal without ``at <y, x>``: what is done, wherever it is."""
    return _PLACE.sub("", subgoal)


def says_finished(subgoal: str) -> bool:
    """Whether a model says that there is nothing more to do; policies know no such subgoal."""
    return _FINISHED.search(subgoal) is not None


def _as_pixels(found: re.Match[str]) -> str:
    row, column = (int(number) for number in found.groups())
    if max(row, column) > SCALE:
        raise UnparsableReply(f"The point {found[0]} is outside of 0 to {SCALE}.")
    return f"<{pixel(row)}, {pixel(column)}>"


def _checked(subgoal: str) -> str:
    if not subgoal:
        raise UnparsableReply("There is no subgoal.")
    if len(subgoal) > LONGEST_SUBGOAL:
        raise UnparsableReply(f"A subgoal has at most {LONGEST_SUBGOAL} characters.")
    rest = re.sub(r"<\d+, \d+>", "", subgoal)
    if any(sign in rest for sign in "<>|{}"):
        raise UnparsableReply("The subgoal holds signs that are part of no point.")
    return subgoal
