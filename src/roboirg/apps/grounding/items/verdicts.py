"""What a reply to a question means, and whether it is right."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from typing import Annotated, NamedTuple

import msgspec

from roboirg.apps.grounding.items.grounding_item import (
    LETTERS,
    GroundingItem,
    PointTarget,
    QuestionKind,
)
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.util.reply_reading import (
    UnparsableReplyError,
    check_whole,
    chosen_letter,
    last_json,
)

Coordinate = Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]
"""Columns or rows of a picture. No bound holds for NaN."""


class Pixel(msgspec.Struct, frozen=True):
    """A place in a picture: `x` columns from the left, `y` rows from the top."""

    x: Coordinate
    y: Coordinate


class ReplyVerdict(NamedTuple):
    """The verdict on one reply.

    Attributes:
        right: whether all of it is right.
        understood: the reply in its usual form: slots as canonical JSON, a letter, or points as
            JSON; None if it is unreadable: it names no answer to the question, or several letters.
        parts: for slots, whether each field is right, by name; for points, whether each thing that
            is meant is hit, by number from 1.
    """

    right: bool
    understood: str | None
    parts: Mapping[str, bool]


def judge_reply(item: GroundingItem, kind: QuestionKind, reply: str) -> ReplyVerdict:
    """Return the verdict on a model's reply to one of an item's questions.

    It is read as by the language-model listener (`roboirg.util.reply_reading`): thoughts are left
    out, words and code fences around a JSON object do no harm, but a value that the task does not
    have makes the reply unreadable, and so does its end at the limit of tokens, as what looks like
    an answer may be a draft.

    Raises:
        UnknownNameError: the item's task is not installed.
    """
    try:
        check_whole(reply)
    except UnparsableReplyError:
        reply = ""  # names no answer
    return _JUDGES[kind](item, reply)


def guess_chance(item: GroundingItem, kind: QuestionKind) -> float:
    """Return the probability, 0 to 1, that a random answer to a question is right.

    For slots the answer is a random goal of the scene, for a choice a random letter, for points
    random pixels, as many as there are things to point at. So for two things without an order that
    cover 1 % of the picture each, it is 0.01 * 0.01 * 2.
    """
    if kind == "slots":
        return len(item.answers) / len(item.goals)
    if kind == "choice":
        return 1 / len(item.choices)
    shares = [float(point.mask.mean()) for point in item.points]  # of the picture, for each thing
    # Without an order, the same pixels are right in every order.
    orders = 1 if item.points_in_order else math.factorial(len(shares))
    return math.prod(shares) * orders


def right_reply(item: GroundingItem, kind: QuestionKind) -> str:
    """Return a right reply to a question: the goal's values as JSON, a letter, or pixels as JSON.

    There is a pixel for each thing to point at.
    """
    if kind == "slots":
        return item.answer
    if kind == "choice":
        return item.choice
    points = [{"x": point.x, "y": point.y} for point in item.points]
    return json.dumps({"points": points})


def _judge_slots(item: GroundingItem, reply: str) -> ReplyVerdict:
    """Judge a reply that gives a goal's values as JSON: as a whole, and value by value.

    Several goals may be right as a whole; single values are compared with those of the goal that is
    meant. Where cubes are counted, the values are the counts of colors.
    """
    schema = goal_schema(item.task)
    wanted = json.loads(item.answer)
    try:
        answer = schema.answers[schema.read(reply)]
    except UnparsableReplyError:
        return ReplyVerdict(False, None, dict.fromkeys(wanted, False))
    found = json.loads(answer)
    parts = {name: found[name] == value for name, value in wanted.items()}
    return ReplyVerdict(answer in item.answers, answer, parts)


def _judge_choice(item: GroundingItem, reply: str) -> ReplyVerdict:
    """Judge a reply that names a letter; it has no parts."""
    try:
        letter = chosen_letter(reply, LETTERS[: len(item.choices)])
    except UnparsableReplyError:
        return ReplyVerdict(False, None, {})
    return ReplyVerdict(letter == item.choice, letter, {})


def _judge_points(item: GroundingItem, reply: str) -> ReplyVerdict:
    """Judge a reply of pixels: right if each thing that is meant is hit, and there are no others.

    If the things have an order, the first pixel must hit the first of them, and so on; else any
    pixel may hit any thing. A reply without readable pixels is not understood.
    """
    points = _read_points(reply)
    parts = {}
    for number, target in enumerate(item.points):
        candidates = points
        if item.points_in_order:
            candidates = points[number : number + 1]
        parts[str(number + 1)] = any(_hits(target, point) for point in candidates)
    if not points:
        return ReplyVerdict(False, None, parts)
    is_right = len(points) == len(item.points) and all(parts.values())
    return ReplyVerdict(is_right, msgspec.json.encode(points).decode(), parts)


def _read_points(reply: str) -> list[Pixel]:
    """Return the pixels of a reply in JSON; empty if it has none or is unreadable.

    Read are ``{"points": [{"x": 1, "y": 2}]}``, the list alone, and a single ``{"x": 1, "y": 2}``.
    """
    try:
        found = last_json(reply)
        if isinstance(found, dict):
            found = found.get("points", [found])
        # Not strict: a number may be a text.
        return msgspec.convert(found, list[Pixel], strict=False)
    except (UnparsableReplyError, msgspec.ValidationError):
        return []


def _hits(target: PointTarget, point: Pixel) -> bool:
    """Return whether a point lies in the pixels of a mask; a pixel begins at its number."""
    height, width = target.size
    is_inside = 0 <= point.x < width and 0 <= point.y < height
    return is_inside and bool(target.mask[int(point.y), int(point.x)])


_JUDGES: Mapping[QuestionKind, Callable[[GroundingItem, str], ReplyVerdict]] = {
    "slots": _judge_slots,
    "choice": _judge_choice,
    "points": _judge_points,
}
