"""Text in pictures, with the fonts that OpenCV always has."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Frame = NDArray[np.uint8]
Color = tuple[int, int, int]
"""RGB, 0 to 255."""

_FONT = 0  # cv2.FONT_HERSHEY_SIMPLEX; importing OpenCV takes a while


def draw_text(
    image: Frame, text: str, x: int, y: int, scale: float, color: Color, thickness: int = 1
) -> None:
    """Put a line of text into a picture, with its base line at y; what is not ASCII becomes "?".

    Args:
        image: uint8 (height, width, 3), changed in place.
        text: one line.
        x: of the left end, pixels.
        y: of the base line, pixels.
        scale: 1 is about 22 pixels high.
        color: RGB.
        thickness: of the strokes, pixels.
    """
    import cv2

    ascii_text = text.encode("ascii", "replace").decode()
    cv2.putText(image, ascii_text, (x, y), _FONT, scale, color, thickness, cv2.LINE_AA)


def wrap_text(text: str, width: int, scale: float) -> list[str]:
    """The text in lines of at most so many pixels; a word that is longer has its own line."""
    import cv2

    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and cv2.getTextSize(longer, _FONT, scale, 1)[0][0] <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines
