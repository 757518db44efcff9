"""Draw the rooms of the package and who imports whom, from the imports: docs/images/layout.svg.

A room stands above all that it imports. An arrow that a longer way implies is left out, as are
those to `core` and `util`, which all rooms may import.
"""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterable, Iterator
from html import escape

import layout

FILE = layout.ROOT / "docs" / "images" / "layout.svg"
GROUND = ("core", "util")
FACE = ("roboirg", "__main__")
"""What only hands on: the package's own file, and ``python -m roboirg``."""
WIDTH = 1000
MARGIN = 20
GAP = 24
HEADER = 24
LINE = 15
PADDING = 8
BETWEEN = 34
CHARACTER = 6.1
"""Width of a character of the small text, in pixels."""


def arrows_above_ground() -> dict[str, set[str]]:
    """Return the rooms that each room imports, without the ground and what only hands on."""
    graph = {}
    for room, others in layout.arrows().items():
        if room not in (*GROUND, *FACE):
            graph[room] = set(others) - set(GROUND)
    return graph


def rooms_by_floor() -> list[list[str]]:
    """Return the rooms of each floor, the ground first; all of the ground stand on one floor."""
    floors: dict[int, list[str]] = defaultdict(list)
    for room, floor in layout.floors(arrows_above_ground()).items():
        floors[floor].append(room)
    above = [sorted(floors[number]) for number in sorted(floors)]
    return [list(GROUND), *above]


def in_order(rooms: list[str], above: dict[str, float]) -> list[str]:
    """Return the rooms of a floor, each below the middle of those that import it.

    Args:
        rooms: of the floor.
        above: the middle of each room on the floors above, in pixels.
    """

    def middle(room: str) -> float:
        importers = [source for source, target in drawn_arrows() if target == room]
        places = [above[source] for source in importers if source in above]
        if not places:
            return WIDTH / 2
        return sum(places) / len(places)

    return sorted(rooms, key=middle)


def drawn_arrows() -> Iterator[tuple[str, str]]:
    """Yield the arrows to draw: without those that a longer way implies."""
    graph = arrows_above_ground()

    def reached(rooms: Iterable[str]) -> set[str]:
        found = set(rooms)
        for room in rooms:
            found |= reached(graph[room])
        return found

    for room, others in graph.items():
        implied = set()
        for other in others:
            implied |= reached(graph[other])
        for other in sorted(others - implied):
            yield room, other


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
        self.room = room
        self.left = left
        self.width = width
        self.top = 0.0
        self.height = 0.0
        inner = width - 2 * PADDING
        self.summary = wrapped(summary_of(room), inner)
        self.folders: list[str] = []
        if folders_of(room):
            self.folders = wrapped("  ".join(folders_of(room)), inner)

    @property
    def middle(self) -> float:
        """Where arrows meet it, from the left."""
        return self.left + self.width / 2

    @property
    def needed(self) -> float:
        """The height that its lines need."""
        return HEADER + LINE * (len(self.summary) + len(self.folders)) + PADDING

    def draw(self) -> Iterator[str]:
        """Yield the lines of its picture."""
        yield (
            f'<rect x="{self.left:.0f}" y="{self.top:.0f}" width="{self.width:.0f}" '
            f'height="{self.height:.0f}" rx="4" class="room"/>'
        )
        suffix = ".py"
        if (layout.PACKAGE / self.room).is_dir():
            suffix = "/"
        left = self.left + PADDING
        yield _text(left, self.top + 17, f"{self.room}{suffix}", "name")
        top = self.top + HEADER + 10
        for line in self.summary:
            yield _text(left, top, line, "summary")
            top += LINE
        for line in self.folders:
            yield _text(left, top, line, "folders")
            top += LINE


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
        above = {box.room: box.middle for box in boxes}
        floor = []
        left = float(MARGIN)
        for room in in_order(rooms, above):
            floor.append(Box(room, left, width))
            left += width + GAP
        height = max(box.needed for box in floor)
        for box in floor:
            box.top = top
            box.height = height
        top += height + BETWEEN
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
        above = place[source]
        below = place[target]
        start = above.middle
        end = below.middle
        start += (end - start) * min(0.35, above.width / 4 / max(1.0, abs(end - start)))
        foot = above.top + above.height
        lines.append(
            f'<path class="arrow" d="M{start:.0f} {foot:.0f} C{start:.0f} {foot + 30:.0f} '
            f'{end:.0f} {below.top - 40:.0f} {end:.0f} {below.top:.0f}"/>'
        )
    for box in boxes:
        lines += box.draw()
    return "\n".join([*lines, "</svg>", ""])


if __name__ == "__main__":
    FILE.write_text(picture(), encoding="utf-8")
