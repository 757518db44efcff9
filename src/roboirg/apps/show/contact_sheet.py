"""Contact sheets: captioned pictures of several moments on one page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from roboirg.core.errors import InvalidValueError
from roboirg.util.text_overlay import Color, Frame, draw_text, wrap_text

PER_ROW = 6
"""Moments per row."""

_MARGIN, _GAP, _PAD = 24, 8, 6
_PICTURE = 256
_BAR = 6
"""Height of the colored bar above a moment, pixels."""
_CAPTION_LINES = 5

_TITLE_SCALE, _TITLE_LINE = 0.8, 34
_TEXT_SCALE, _TEXT_LINE = 0.45, 18

_PAPER: Color = (255, 255, 255)
_INK: Color = (31, 35, 40)
_PALE: Color = (101, 109, 118)
_VIDEO: Color = (255, 176, 32)
_TURN: Color = (9, 105, 218)


@dataclass(frozen=True, eq=False)
class SheetPanel:
    """One moment on a sheet.

    Attributes:
        step: control steps since reset.
        caption: what has just happened.
        pictures: RGB, uint8 (256, 256, 3), one per camera, stacked from top to bottom.
        is_demonstration: whether it belongs to the video, which has its own bar color.
    """

    step: int
    caption: str
    pictures: tuple[Frame, ...]
    is_demonstration: bool = False


def compose_sheet(title: str, subtitle: str, moments: Sequence[SheetPanel]) -> Frame:
    """Draw all moments in order under a title.

    Args:
        title: one line.
        subtitle: wrapped text.
        moments: at least one, all with the same number of pictures.

    Returns:
        RGB, uint8 (height, width, 3).
    """
    # Rows of equal length: eight moments become four and four.
    columns = math.ceil(len(moments) / math.ceil(len(moments) / PER_ROW))
    # A single narrow column would cut off the title.
    width = 2 * _MARGIN + max(columns, 3) * (_PICTURE + _GAP) - _GAP
    lines = wrap_text(subtitle, width - 2 * _MARGIN, _TEXT_SCALE)
    head = _strip(width, _MARGIN + _TITLE_LINE + (len(lines) + 1) * _TEXT_LINE)
    y = _MARGIN + _TITLE_LINE // 2
    draw_text(head, title, _MARGIN, y, _TITLE_SCALE, _INK, thickness=2)
    for number, line in enumerate(lines):
        draw_text(head, line, _MARGIN, y + _TITLE_LINE + number * _TEXT_LINE, _TEXT_SCALE, _PALE)
    rows = [
        _draw_row(moments[start : start + columns], width)
        for start in range(0, len(moments), columns)
    ]
    sheet: Frame = np.concatenate([head, *rows], axis=0)
    return sheet


def write_png(image: Frame, path: Path) -> None:
    """Write an RGB picture as a PNG file.

    Raises:
        InvalidValueError: the file cannot be written.
    """
    import cv2

    _, data = cv2.imencode(".png", cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data.tobytes())
    except OSError as error:
        raise InvalidValueError(f"The picture {path} cannot be written: {error}.") from error


def evenly_spaced(count: int, limit: int) -> tuple[int, ...]:
    """Return at most `limit` of `count` positions, evenly spaced, both ends included."""
    if count <= limit:
        return tuple(range(count))
    if limit < 2:  # noqa: PLR2004 - there are two ends
        return (count - 1,) * limit
    return tuple(round(number * (count - 1) / (limit - 1)) for number in range(limit))


def _draw_row(moments: Sequence[SheetPanel], width: int) -> Frame:
    """Draw moments side by side: bar, caption, pictures."""
    captions = [wrap_text(moment.caption, _PICTURE, _TEXT_SCALE) for moment in moments]
    longest = min(_CAPTION_LINES, max(map(len, captions)))
    caption_height = _BAR + _PAD + (1 + longest) * _TEXT_LINE + _PAD
    heights = max(len(moment.pictures) for moment in moments)
    canvas = _strip(width, caption_height + heights * (_PICTURE + _GAP) + _MARGIN - _GAP)
    for column, moment in enumerate(moments):
        x = _MARGIN + column * (_PICTURE + _GAP)
        color = _VIDEO if moment.is_demonstration else _TURN
        canvas[:_BAR, x : x + _PICTURE] = np.array(color, np.uint8)
        y = _BAR + _PAD + _TEXT_LINE - 4
        when = f"step {moment.step}" + (" (video)" if moment.is_demonstration else "")
        draw_text(canvas, when, x, y, _TEXT_SCALE, _PALE)
        for number, line in enumerate(captions[column][:longest], start=1):
            draw_text(canvas, line, x, y + number * _TEXT_LINE, _TEXT_SCALE, _INK)
        for row, picture in enumerate(moment.pictures):
            top = caption_height + row * (_PICTURE + _GAP)
            canvas[top : top + _PICTURE, x : x + _PICTURE] = picture
    return canvas


def _strip(width: int, height: int) -> Frame:
    return np.full((height, width, 3), _PAPER, np.uint8)
