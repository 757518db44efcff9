"""Count what a msgpack message holds before it is unpacked.

A byte of a message may become an object of a hundred, and five bytes announce four thousand
million elements. So the bytes are walked through once, without making anything of them.
"""

from __future__ import annotations

MAX_ELEMENTS = 1_000_000
"""Elements of a message: values and keys. The longest video with all sensors has 120,000."""
MAX_DEPTH = 64
"""Containers within each other."""

_FIXMAP, _FIXARRAY, _FIXSTR, _NIL, _NEGATIVE = 0x80, 0x90, 0xA0, 0xC0, 0xE0
_NEVER_USED = 0xC1
_SIZES = {
    0xC0: 0, 0xC2: 0, 0xC3: 0, 0xCA: 4, 0xCB: 8,
    0xCC: 1, 0xCD: 2, 0xCE: 4, 0xCF: 8, 0xD0: 1, 0xD1: 2, 0xD2: 4, 0xD3: 8,
    0xD4: 2, 0xD5: 3, 0xD6: 5, 0xD7: 9, 0xD8: 17,
}  # fmt: skip
"""Bytes after the first one, by the first one: nil, booleans, numbers, small extensions."""
_LENGTHS = {
    0xC4: (1, 0), 0xC5: (2, 0), 0xC6: (4, 0), 0xC7: (1, 1), 0xC8: (2, 1), 0xC9: (4, 1),
    0xD9: (1, 0), 0xDA: (2, 0), 0xDB: (4, 0),
}  # fmt: skip
"""Bytes of the length, and further ones that it does not count: bytes, extensions, texts."""
_CONTAINERS = {0xDC: (2, 1), 0xDD: (4, 1), 0xDE: (2, 2), 0xDF: (4, 2)}
"""Bytes of the count, and elements that one of it stands for: arrays, maps."""


class MessageSizeError(ValueError):
    """A message is cut short, or holds too much."""


def check_size(data: bytes) -> None:
    """Check that a message is complete, and that what it holds can be unpacked.

    Raises:
        MessageSizeError: it is not, or cannot.
    """
    at, total, open_containers = 0, 1, [1]
    while open_containers:
        if not open_containers[-1]:
            open_containers.pop()
            continue
        open_containers[-1] -= 1
        if at >= len(data):
            raise MessageSizeError("the bytes are not a msgpack message (they end too early)")
        at, elements = _step(data, at)
        if elements:
            total += elements
            open_containers.append(elements)
            if total > MAX_ELEMENTS:
                raise MessageSizeError(
                    f"the message holds more than {MAX_ELEMENTS:,} elements, so it is not unpacked"
                )
            if len(open_containers) > MAX_DEPTH:
                raise MessageSizeError(
                    f"the message nests more than {MAX_DEPTH} containers, so it is not unpacked"
                )


def _step(data: bytes, at: int) -> tuple[int, int]:
    """Return where the next element begins, and how many the one at `at` holds."""
    first, elements = data[at], 0
    at += 1
    if first < _FIXMAP or first >= _NEGATIVE:
        pass  # a small number
    elif first < _FIXARRAY:
        elements = 2 * (first - _FIXMAP)
    elif first < _FIXSTR:
        elements = first - _FIXARRAY
    elif first < _NIL:
        at += first - _FIXSTR
    elif first in _SIZES:
        at += _SIZES[first]
    elif first in _LENGTHS:
        width, more = _LENGTHS[first]
        at += width + more + int.from_bytes(data[at : at + width], "big")
    elif first == _NEVER_USED:
        raise MessageSizeError("the bytes are not a msgpack message (0xc1 is in no message)")
    else:
        width, each = _CONTAINERS[first]
        elements = each * int.from_bytes(data[at : at + width], "big")
        at += width
    return at, elements
