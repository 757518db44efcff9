"""Draw the rooms of the package and who imports whom, from the imports: docs/images/layout.svg.

A room stands above all that it imports. An arrow that a longer way implies is left out, as are
those to `core` and `util`, which all rooms may import.
"""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from html import escape
from pathlib import Path

import layout

FILE = layout.ROOT / "docs" / "images" / "layout.svg"
GROUND = ("core", "util")
FACE = ("roboirg", "__main__")
"""What only hands on: the package's own file, and ``python -m roboirg``."""
WIDTH, MARGIN, GAP = 1000, 20, 24
HEADER, LINE, PADDING, BETWEEN = 24, 15, 8, 34
CHARACTER = 6.1
"""Width of a character of the small text, in pixels."""


def arrows_above_ground() -> dict[str, set[str]]:
    """Return the rooms that each room imports, without the ground and what only hands on."""
    return {
        room: set(others) - set(GROUND)
        for room, others in layout.arrows().items()
        if room not in (*GROUND, *FACE)
    }


def rooms_by_floor() -> list[list[str]]:
    """Return the rooms of each floor, the ground first; all of the ground stand on one floor."""
    floors: dict[int, list[str]] = defaultdict(list)
    for room, floor in layout.floors(arrows_above_ground()).items():
        floors[floor + 1].append(room)
    return [list(GROUND), *(sorted(floors[number]) for number in sorted(floors))]


def in_order(rooms: list[str], above: dict[str, float]) -> list[str]:
    """Return the rooms of a floor, each below the middle of those that import it.

    Args:
        rooms: of the floor.
        above: the middle of each room on the floors above, in pixels.
    """

    def middle(room: str) -> float:
        places = [above[one] for one, other in drawn_arrows() if other == room and one in above]
        return sum(places) / len(places) if places else WIDTH / 2

    return sorted(rooms, key=middle)


def drawn_arrows() -> Iterator[tuple[str, str]]:
    """Yield the arrows to draw: without those that a longer way implies."""
    graph = arrows_above_ground()

    def reached(room: str) -> set[str]:
        return graph[room] | {far for other in graph[room] for far in reached(other)}

    for room, others in graph.items():
        implied = {far for other in others for far in reached(other)}
        yield from ((room, other) for other in sorted(others - implied))


def folders_of(room: str) -> list[str]:
    """Return the folders in a room, or its files if it has no folder."""
    place = layout.PACKAGE / room
    if not place.is_dir():
        return []
    inside = sorted(path for path in place.iterdir() if not path.name.startswith("_"))
    folders = [f"{path.name}/" for path in inside if (path / "__init__.py").exists()]
    return folders or [path.stem for path in inside if path.suffix == ".py"]


def summary_of(room: str) -> str:
    """Return the first sentence of a room's docstring."""
    name = f"{layout.PACKAGE.name}.{room}"
    words = ast.get_docstring(layout.tree(layout.modules()[name])) or ""
    return " ".join(words.split("\n\n")[0].split()).rstrip(".").replace("`", "")


def wrapped(text: str, width: float) -> list[str]:
    """Return a text in lines of at most a width in pixels."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if len(longer) * CHARACTER > width and lines[-1]:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


class Box:
    """A room in the picture; positions in pixels from the upper left corner."""

    def __init__(self, room: str, left: float, width: float) -> None:
        self.room, self.left, self.width = room, left, width
        self.top = self.height = 0.0
        inner = width - 2 * PADDING
        self.summary = wrapped(summary_of(room), inner)
        self.folders = wrapped("  ".join(folders_of(room)), inner) if folders_of(room) else []

    @property
    def needed(self) -> float:
        """The height that its lines need."""
        return HEADER + LINE * (len(self.summary) + len(self.folders)) + PADDING

    def draw(self) -> Iterator[str]:
        """Yield the lines of its picture."""
        left, top = self.left, self.top
        yield (
            f'<rect x="{left:.0f}" y="{top:.0f}" width="{self.width:.0f}" '
            f'height="{self.height:.0f}" rx="4" class="room"/>'
        )
        suffix = "/" if (layout.PACKAGE / self.room).is_dir() else ".py"
        yield _text(left + PADDING, top + 17, f"{self.room}{suffix}", "name")
        for number, line in enumerate((*self.summary, *self.folders)):
            kind = "summary" if number < len(self.summary) else "folders"
            yield _text(left + PADDING, top + HEADER + LINE * number + 10, line, kind)


def _text(left: float, top: float, words: str, kind: str) -> str:
    return f'<text x="{left:.0f}" y="{top:.0f}" class="{kind}">{escape(words)}</text>'


STYLE = """
text { font-family: sans-serif; fill: #1f2328 }
.name { font-size: 14px; font-weight: bold }
.summary { font-size: 11px }
.folders { font-size: 11px; fill: #57606a }
.room { fill: #eef3fa; stroke: #57606a }
.arrow { fill: none; stroke: #57606a; marker-end: url(#head) }
"""


HEAD = (
    '<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" '
    'markerHeight="7" orient="auto"><path d="M0 0 8 4 0 8z" fill="#57606a"/></marker></defs>'
)


def place_boxes() -> tuple[list[Box], float]:
    """Return the boxes in their places, and the height of the picture."""
    boxes: list[Box] = []
    top = float(MARGIN)
    for rooms in reversed(rooms_by_floor()):
        width = (WIDTH - 2 * MARGIN - GAP * (len(rooms) - 1)) / len(rooms)
        above = {box.room: box.left + box.width / 2 for box in boxes}
        floor = [
            Box(room, MARGIN + number * (width + GAP), width)
            for number, room in enumerate(in_order(rooms, above))
        ]
        for box in floor:
            box.top, box.height = top, max(one.needed for one in floor)
        top += floor[0].height + BETWEEN
        boxes += floor
    return boxes, top - BETWEEN + MARGIN


def picture() -> str:
    """Return the picture as SVG."""
    boxes, height = place_boxes()
    place = {box.room: box for box in boxes}
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height:.0f}">',
        f"<style>{STYLE}</style>",
        HEAD,
        f'<rect width="{WIDTH}" height="{height:.0f}" fill="#ffffff"/>',
    ]
    for source, target in drawn_arrows():
        above, below = place[source], place[target]
        start, end = above.left + above.width / 2, below.left + below.width / 2
        start += (end - start) * min(0.35, above.width / 4 / max(1.0, abs(end - start)))
        foot = above.top + above.height
        lines.append(
            f'<path class="arrow" d="M{start:.0f} {foot:.0f} C{start:.0f} {foot + 30:.0f} '
            f'{end:.0f} {below.top - 40:.0f} {end:.0f} {below.top:.0f}"/>'
        )
    for box in boxes:
        lines += box.draw()
    return "\n".join([*lines, "</svg>", ""])


def main(file: Path = FILE) -> None:
    """Write the picture."""
    file.write_text(picture(), encoding="utf-8")


if __name__ == "__main__":
    main()
