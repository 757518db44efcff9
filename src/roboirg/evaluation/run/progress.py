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


class ConsoleReporter(Reporter):
    """Progress bar on a terminal, one line per episode elsewhere; a context manager."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._counts: Counter[tuple[str, str]] = Counter()  # by setting and outcome
        self._total, self._done, self._start = 0, 0, time.monotonic()
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

    def start(self, total: int, done: int) -> None:
        """Start counting; the pace is that of this run only."""
        self._total, self._done, self._start = total, done, time.monotonic()
        self._bar.update(self._task, total=total, completed=done)
        if done:
            self._console.print(f"{done} of {counted(total, 'episode')} already stored.")

    def advance(self, record: Record, *, is_new: bool = True) -> None:
        """Advance the bar, or print a line."""
        self._done += is_new
        self._counts[record.setting, record.outcome] += 1
        pace = _MINUTE * self._counts.total() / max(time.monotonic() - self._start, 1e-9)
        seconds = round(_MINUTE * (self._total - self._done) / pace)
        left = f"{seconds // _MINUTE}:{seconds % _MINUTE:02d}"
        if self._console.is_terminal:
            self._bar.update(self._task, completed=self._done, left=left, pace=pace)
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
        return Group(self._bar, Text(self._score(), "dim"))

    def _score(self) -> str:
        """Return the successes per setting, of the valid episodes, and the errors in one line."""
        counts = self._counts
        valid = {name: counts[name, "success"] + counts[name, "failure"] for name, _ in counts}
        parts = [f"{name} {counts[name, 'success']}/{valid[name]}" for name in valid if valid[name]]
        if errors := sum(counts[one] for one in counts if one[1] == "error"):
            parts.append(f"errors {errors}")
        return " · ".join(parts)


def _summary(record: Record) -> str:
    where = f"{record.policy} {record.task} {record.split}/{record.episode} {record.setting}"
    form = "" if record.form == "implicit" else f" ({record.form})"
    arm = "" if record.arm == TOLD else f" ({record.arm})"
    cause = "" if record.cause is None else f": {record.cause}"
    return f"{where}{form}{arm}: {record.outcome}{cause}"
