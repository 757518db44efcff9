"""Progress of long commands: bars on a terminal, else a line at times."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

# Rich is imported where it is used, so that --help is fast.

LINE_EVERY_S = 10.0
"""Seconds between two lines of progress where stderr is no terminal."""
_MINUTE_S = 60.0


class _Work(NamedTuple):
    """A kind of work under way.

    Attributes:
        bar: its bar.
        start: time of its first report, s.
        first: how much was done then.
    """

    bar: TaskID
    start: float
    first: int


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
    bars = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[remark]}"),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )
    with bars:
        yield _Reporter(bars, has_lines=has_lines and not console.is_terminal).report


class _Reporter:
    """Shows the progress of several kinds of work.

    Args:
        bars: for each a bar.
        has_lines: whether to print lines, too.
    """

    def __init__(self, bars: Progress, *, has_lines: bool) -> None:
        self._bars = bars
        self._has_lines = has_lines
        self._works: dict[str, _Work] = {}
        self._last_line = 0.0

    def report(self, name: str, done: int, total: int, remark: str) -> None:
        """Show how much of a kind of work is done: on the bar, or at times in a printed line.

        Args:
            name: of the kind of work; a new name gets a new bar.
            done: how much is done.
            total: how much there is.
            remark: stands at the end.
        """
        if name not in self._works:
            bar = self._bars.add_task(name, total=total, remark="")
            self._works[name] = _Work(bar, time.monotonic(), done)
        work = self._works[name]
        self._bars.update(work.bar, completed=done, total=total, remark=remark)
        now = time.monotonic()
        is_line_due = now - self._last_line > LINE_EVERY_S or done == total
        if self._has_lines and is_line_due:
            self._last_line = now
            line = f"{name} {done}/{total} {_time_left(work, now, done, total)} {remark}"
            self._bars.console.print(line.rstrip(), highlight=False)


def _time_left(work: _Work, now: float, done: int, total: int) -> str:
    """Return the time left at the rate so far, such as ``5 min left``; empty if it is not known.

    What was done before the first report, `work.first`, does not count, as it took no time here.

    Args:
        work: when it began, and how much was done then.
        now: time on the same clock, s.
        done: how much is done.
        total: how much there is.
    """
    if done in (total, work.first):
        return ""
    seconds_each = (now - work.start) / (done - work.first)
    seconds = seconds_each * (total - done)
    if seconds >= _MINUTE_S:
        return f"{seconds / _MINUTE_S:.0f} min left"
    return f"{seconds:.0f} s left"
