"""Telling how a run goes while it goes: a bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections import Counter
from typing import Protocol, Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.text import Text

from roboirg.records.record import Record

_MINUTE = 60


class Reporter(Protocol):
    """Hears how a run goes."""

    def begin(self, total: int, done: int) -> None:
        """So many episodes are in the plan, so many of them were there before."""

    def advance(self, record: Record, *, is_new: bool = True) -> None:
        """This record is stored; it is not new if the episode was only tried again."""

    def notice(self, text: str) -> None:
        """A sentence that a person should read now."""


class SilentReporter:
    """Says nothing."""

    def begin(self, total: int, done: int) -> None:
        """Nothing."""

    def advance(self, record: Record, *, is_new: bool = True) -> None:
        """Nothing."""

    def notice(self, text: str) -> None:
        """Nothing."""


class ProgressCounter:
    """Episodes so far: successes and valid episodes per setting, errors, pace."""

    def __init__(self) -> None:
        self.successes: Counter[str] = Counter()
        self.valid: Counter[str] = Counter()
        self.errors = 0
        self.played = 0
        self._start = time.monotonic()

    def add(self, record: Record) -> None:
        """Count one record."""
        self.played += 1
        if record.outcome == "error":
            self.errors += 1
            return
        self.valid[record.setting] += 1
        self.successes[record.setting] += record.outcome == "success"

    def pace(self) -> float:
        """Episodes per minute since the beginning."""
        return _MINUTE * self.played / max(time.monotonic() - self._start, 1e-9)

    def time_left(self, remaining: int) -> str:
        """``m:ss`` at this pace."""
        if not self.played:
            return "-:--"
        seconds = round(_MINUTE * remaining / self.pace())
        return f"{seconds // _MINUTE}:{seconds % _MINUTE:02d}"

    def line(self) -> str:
        """Successes per setting in one line."""
        parts = [f"{name} {self.successes[name]}/{count}" for name, count in self.valid.items()]
        if self.errors:
            parts.append(f"errors {self.errors}")
        return " · ".join(parts)


class ConsoleReporter:
    """A progress bar on a terminal, one line per episode elsewhere. A context manager."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._score = ProgressCounter()
        self._bar = Progress(
            TextColumn("[bold]{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.fields[left]} left · {task.fields[pace]:.1f}/min"),
            console=console,
        )
        self._task = self._bar.add_task("episodes", total=None, left="-:--", pace=0.0)
        # The score has a line of its own: on a narrow terminal the bar's line is full.
        self._live = Live(console=console, get_renderable=self._render)
        self._total = self._done = 0

    def begin(self, total: int, done: int) -> None:
        """Start counting; the pace is that of this run alone."""
        self._score = ProgressCounter()
        self._total, self._done = total, done
        self._bar.update(self._task, total=total, completed=done)
        if done:
            self._console.print(f"{done} of {total} episodes are already there.")

    def advance(self, record: Record, *, is_new: bool = True) -> None:
        """Move on by one."""
        self._done += is_new
        self._score.add(record)
        left = self._score.time_left(self._total - self._done)
        if self._console.is_terminal:
            self._bar.update(
                self._task,
                completed=self._done,
                left=left,
                pace=self._score.pace(),
            )
            return
        self._console.print(
            f"\\[{self._done}/{self._total}] {escape(_summary(record))} ({left} left)",
            soft_wrap=True,
            highlight=False,
        )

    def notice(self, text: str) -> None:
        """A line on stderr; a bar that is being drawn stays below it."""
        sys.stderr.write(f"{text}\n")

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(self, *_exception: object) -> None:
        self._live.stop()

    def _render(self) -> RenderableType:
        return Group(self._bar, Text(self._score.line(), "dim"))


def _summary(record: Record) -> str:
    where = f"{record.policy} {record.task} {record.split}/{record.episode} {record.setting}"
    if record.form != "implicit":
        where += f" ({record.form})"
    verdict = record.outcome if record.cause is None else f"{record.outcome}: {record.cause}"
    return f"{where}: {verdict}"
