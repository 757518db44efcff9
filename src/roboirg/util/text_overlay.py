"""Draw text into pictures, with the built-in fonts of OpenCV."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Frame = NDArray[np.uint8]
Color = tuple[int, int, int]
"""RGB, 0 to 255."""

_FONT = 0  # cv2.FONT_HERSHEY_SIMPLEX; importing OpenCV is slow


def draw_text(
    image: Frame, text: str, x: int, y: int, scale: float, color: Color, thickness: int = 1
) -> None:
    """Draw a line of text into a picture; characters outside ASCII become ``?``.

    Args:
        image: uint8 (height, width, 3), changed in place.
        text: one line.
        x: left end of the text, pixels.
        y: base line of the text, pixels.
        scale: size of the font; 1 is about 22 pixels high.
        color: RGB.
        thickness: width of the strokes, pixels.
    """
    import cv2

    ascii_text = text.encode("ascii", "replace").decode()
    cv2.putText(image, ascii_text, (x, y), _FONT, scale, color, thickness, cv2.LINE_AA)


def wrap_text(text: str, width: int, scale: float) -> list[str]:
    """Split a text into lines of at most `width` pixels; a longer word gets a line of its own."""
    import cv2

    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and cv2.getTextSize(longer, _FONT, scale, 1)[0][0] <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines
