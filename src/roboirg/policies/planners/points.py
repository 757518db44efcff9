"""Convert the points in a model's subgoals to pixels of the front picture.

Policies that follow grounded subgoals read ``at <y, x>``: row and column of the front picture of
256 x 256 pixels. Models use 0 to 1000 in both directions, also with the row first.
"""

from __future__ import annotations

import re

from roboirg.core.observations import PICTURE_SIZE
from roboirg.core.subgoal_text import MOST_SUBGOAL_LETTERS
from roboirg.util.reply_reading import UnparsableReplyError, answer_of

SCALE = 1000
"""The whole height or width in a model's coordinates."""

# Such as (120, 87), <|box_start|>(120,87)<|box_end|>, or <120, 87>.
_POINT = re.compile(
    r"(?:<\|box_start\|>)?\(\s*(\d+)\s*,\s*(\d+)\s*\)(?:<\|box_end\|>)?|<\s*(\d+)\s*,\s*(\d+)\s*>"
)
_NO_WORDS = re.compile(r"[<>|{}\ud800-\udfff]")
"""Signs of points and of JSON, and halves of surrogate pairs: no subgoal in words has them."""
_FINISHED = re.compile(r"\b(?:complete|completed|finished|done)\b")


def to_pixel(value: int) -> int:
    """Return a model's coordinate, 0 to `SCALE`, as a row or column of the picture, 0 to 255.

    500 becomes 128; 1000 is the far edge; MME-VLA converts it to 256, which is outside the picture.
    """
    return min(PICTURE_SIZE * value // SCALE, PICTURE_SIZE - 1)


def parse_points(text: str) -> str:
    """Return the subgoal in a model's text, with its points in pixels, ``<row, column>``.

    ``"Pick up the cube at <500, 250>."`` becomes ``pick up the cube at <128, 64>``. A model writes
    points as ``<y, x>``, or as box tokens ``<|box_start|>(y,x)<|box_end|>``, from which servers may
    strip the tokens. All are replaced at once, so that none is replaced twice.

    Raises:
        UnparsableReplyError: there is no subgoal, or its points are malformed.
    """
    subgoal = _POINT.sub(_as_pixels, normalize_subgoal(text))
    if not subgoal:
        raise UnparsableReplyError("There is no subgoal.")
    if len(subgoal) > MOST_SUBGOAL_LETTERS:
        raise UnparsableReplyError(f"A subgoal has at most {MOST_SUBGOAL_LETTERS} characters.")
    rest = re.sub(r"<\d+, \d+>", "", subgoal)
    if _NO_WORDS.search(rest):
        raise UnparsableReplyError("The subgoal holds signs that are part of no point.")
    return subgoal


def normalize_subgoal(text: str) -> str:
    """Return a model's subgoal in one line, without thoughts, quotes, full stop and end token.

    ``'"Press the button."'`` becomes ``press the button``: in lower case, like all text that the
    policies were trained on.
    """
    return " ".join(answer_of(text).split()).lower().strip("\"'`. ")


def says_finished(subgoal: str) -> bool:
    """Return whether a subgoal says that the task is complete: *done*, *task completed*.

    Policies that follow subgoals do not know such words.
    """
    return _FINISHED.search(subgoal) is not None


def _as_pixels(found: re.Match[str]) -> str:
    """Return a model's point as a pixel: ``(500, 250)`` becomes ``<128, 64>``."""
    # Either the first two groups hold the numbers, or the last two.
    row, column = (int(number) for number in found.groups() if number is not None)
    if max(row, column) > SCALE:
        raise UnparsableReplyError(f"The point {found[0]} is outside of 0 to {SCALE}.")
    return f"<{to_pixel(row)}, {to_pixel(column)}>"
