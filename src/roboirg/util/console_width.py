"""What is printed into files and pipes: its width, and no moving cursor."""

from __future__ import annotations

import sys

from rich.console import Console, RenderableType
from rich.measure import Measurement

LINE_WIDTH = 120
"""Characters of a line where the output is no terminal, unless a name needs more."""
_ANY_WIDTH = 10_000


def line_width(console: Console) -> int:
    """Return the characters of a line: the terminal's; in a file at least `LINE_WIDTH`."""
    if console.is_terminal:
        return console.width
    return max(console.width, LINE_WIDTH)


def widen(console: Console, *tables: RenderableType) -> None:
    """Widen a console that writes to a file, so that tables in it are neither cut nor folded.

    Changes ``console.width``, to `LINE_WIDTH` at least.

    Args:
        console: left as it is if it is a terminal.
        *tables: that have to fit.
    """
    if console.is_terminal:
        return
    unlimited = console.options.update(max_width=_ANY_WIDTH)
    needed = [Measurement.get(console, unlimited, table).maximum for table in tables]
    console.width = max([line_width(console), *needed])


def progress_console(*, stderr: bool = False) -> Console:
    """Return a console that moves its cursor on a terminal only, whatever FORCE_COLOR says."""
    stream = sys.stderr if stderr else sys.stdout
    if stream.isatty():
        return Console(stderr=stderr)
    return Console(stderr=stderr, force_terminal=False)
