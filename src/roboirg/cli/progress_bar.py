"""Progress of long commands: bars on a terminal, else a line at times."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

# Rich is imported where it is used, so that --help is fast.

LINE_EVERY_S = 10.0
"""Seconds between two lines of progress where stderr is no terminal."""


@contextmanager
def progress_bar(words: str) -> Iterator[Callable[[int, int], None]]:
    """Show a bar while the block runs, if stderr is a terminal.

    Yields:
        A function that takes how many are done, and how many there are.
    """
    with progress_bars(has_lines=False) as report:
        yield lambda done, total: report(words, done, total, "")


@contextmanager
def progress_bars(*, has_lines: bool = True) -> Iterator[Callable[[str, int, int, str], None]]:
    """Show a bar for each kind of work while the block runs.

    Args:
        has_lines: whether to print the progress and the time left where stderr is no terminal.

    Yields:
        A function that takes a kind of work, how much of it is done, how much there is, and a
        remark.
    """
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    from roboirg.util.console_width import progress_console

    console = progress_console(stderr=True)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[remark]}"),
    )
    started: dict[str, tuple[float, int]] = {}
    last_line = 0.0
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        bars = {}

        def report(work: str, done: int, total: int, remark: str) -> None:
            nonlocal last_line
            if work not in bars:
                bars[work] = bar.add_task(work, total=total, remark="")
                started[work] = time.monotonic(), done
            bar.update(bars[work], completed=done, total=total, remark=remark)
            now = time.monotonic()
            if console.is_terminal or not has_lines:
                return
            if now - last_line > LINE_EVERY_S or done == total:
                last_line = now
                left = _time_left(now, *started[work], done, total)
                console.print(f"{work} {done}/{total} {left} {remark}".rstrip(), highlight=False)

        yield report


def _time_left(now: float, start: float, first: int, done: int, total: int) -> str:
    """Return the time left at the rate so far, in words."""
    if done in (total, first):
        return ""
    seconds = (now - start) / (done - first) * (total - done)
    return f"{seconds / 60:.0f} min left" if seconds >= 60 else f"{seconds:.0f} s left"  # noqa: PLR2004
