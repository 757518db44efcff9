"""Show the progress of a run: a bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections import Counter
from typing import Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.text import Text

from roboirg.core.arms import TOLD
from roboirg.core.plain_text import counted, printable
from roboirg.evaluation.records.record import Record

_MINUTE = 60


class Reporter:
    """Gets the progress of a run; this one shows nothing."""

    def start(self, total: int, done: int) -> None:
        """Start a run.

        Args:
            total: episodes in the plan.
            done: episodes stored before.
        """

    def advance(self, record: Record, *, is_new: bool = True) -> None:
        """Report a stored record; it is not new if the episode was retried."""

    def warn(self, text: str) -> None:
        """Show a sentence that the user should read now."""


class ProgressCounter:
    """Counts successes and valid episodes per setting and errors, and measures the pace."""

    def __init__(self) -> None:
        self.successes: Counter[str] = Counter()
        self.valid: Counter[str] = Counter()
        self.errors = 0
        self.played = 0
        self._start = time.monotonic()

    def add(self, record: Record) -> None:
        self.played += 1
        if record.outcome == "error":
            self.errors += 1
            return
        self.valid[record.setting] += 1
        self.successes[record.setting] += record.outcome == "success"

    def pace(self) -> float:
        """Return the episodes per minute since the start."""
        return _MINUTE * self.played / max(time.monotonic() - self._start, 1e-9)

    def time_left(self, remaining: int) -> str:
        """Return the remaining time at this pace as ``m:ss``."""
        if not self.played:
            return "-:--"
        seconds = round(_MINUTE * remaining / self.pace())
        return f"{seconds // _MINUTE}:{seconds % _MINUTE:02d}"

    def summary(self) -> str:
        """Return the successes per setting in one line."""
        parts = [f"{name} {self.successes[name]}/{count}" for name, count in self.valid.items()]
        if self.errors:
            parts.append(f"errors {self.errors}")
        return " · ".join(parts)


class ConsoleReporter(Reporter):
    """Progress bar on a terminal, one line per episode elsewhere; a context manager."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._counter = ProgressCounter()
        self._bar = Progress(
            TextColumn("[bold]{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.fields[left]} left · {task.fields[pace]:.1f}/min"),
            console=console,
        )
        self._task = self._bar.add_task("episodes", total=None, left="-:--", pace=0.0)
        # The successes have their own line, because the bar fills a narrow terminal.
        self._live = Live(console=console, get_renderable=self._render)
        self._total = self._done = 0

    def start(self, total: int, done: int) -> None:
        """Start counting; the pace is that of this run only."""
        self._counter = ProgressCounter()
        self._total, self._done = total, done
        self._bar.update(self._task, total=total, completed=done)
        if done:
            self._console.print(f"{done} of {counted(total, 'episode')} already stored.")

    def advance(self, record: Record, *, is_new: bool = True) -> None:
        """Advance the bar, or print a line."""
        self._done += is_new
        self._counter.add(record)
        left = self._counter.time_left(self._total - self._done)
        if self._console.is_terminal:
            self._bar.update(
                self._task,
                completed=self._done,
                left=left,
                pace=self._counter.pace(),
            )
            return
        self._console.print(
            f"\\[{self._done}/{self._total}] {escape(printable(_summary(record)))} ({left} left)",
            soft_wrap=True,
            highlight=False,
        )

    def warn(self, text: str) -> None:
        """Print a line on stderr, above the bar."""
        sys.stderr.write(f"{printable(text)}\n")

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(self, *_exception: object) -> None:
        self._live.stop()

    def _render(self) -> RenderableType:
        return Group(self._bar, Text(self._counter.summary(), "dim"))


def _summary(record: Record) -> str:
    where = f"{record.policy} {record.task} {record.split}/{record.episode} {record.setting}"
    if record.form != "implicit":
        where += f" ({record.form})"
    if record.arm != TOLD:
        where += f" ({record.arm})"
    verdict = record.outcome if record.cause is None else f"{record.outcome}: {record.cause}"
    return f"{where}: {verdict}"
