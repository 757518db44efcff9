"""Show the progress of a run: a bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import math
import sys
import time
from collections import Counter
from datetime import timedelta
from typing import Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.text import Text

from roboirg.core.arms import TOLD
from roboirg.core.plain_text import counted, printable
from roboirg.records.record import Record
from roboirg.runs.plan.stopping import ComparedSides, Stopping
from roboirg.stats.rates import p_text

ESTIMATE_AFTER = 5
"""Episodes of a run after which the time left is estimated."""
_MINUTE = 60
_UNKNOWN = "-:--:--"


class Reporter:
    """Gets the progress of a run; this one shows nothing."""

    def start(self, total: int, done: int, workers: int | None = None) -> None:
        """Start a run.

        Args:
            total: episodes in the plan.
            done: episodes stored before.
            workers: episodes that are played side by side; None if that is not known.
        """

    def advance(self, record: Record, *, is_new: bool = True) -> None:
        """Report a stored record; it is not new if the episode was retried."""

    def compare(self, found: Stopping) -> None:
        """Show what a run that stops when it is decided has found so far, after every look."""

    def warn(self, text: str) -> None:
        """Show a sentence that the user should read now."""


class ConsoleReporter(Reporter):
    """Progress bar on a terminal, one line per episode elsewhere; a context manager."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._outcomes: dict[str, Counter[str]] = {}  # by setting
        self._total = 0
        self._done = 0
        self._played = 0
        self._seconds_played = 0.0
        self._workers: int | None = None
        self._compared: list[ComparedSides] = []
        self._start = time.monotonic()
        self._bar = Progress(
            TextColumn("[bold]{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.fields[left]} left · {task.fields[pace]:.1f}/min"),
            console=console,
        )
        self._task = self._bar.add_task("episodes", total=None, left=_UNKNOWN, pace=0.0)
        # The successes have their own line, because the bar fills a narrow terminal.
        self._live = Live(console=console, get_renderable=self._render)

    def start(self, total: int, done: int, workers: int | None = None) -> None:
        """Start the bar with the episodes that were stored before, which do not count as pace."""
        self._total = total
        self._done = done
        self._workers = workers
        self._start = time.monotonic()
        self._bar.update(self._task, total=total, completed=done)
        if done:
            self._console.print(f"{done} of {counted(total, 'episode')} already stored.")

    def advance(self, record: Record, *, is_new: bool = True) -> None:
        """Count a stored record, and show it on the bar, or in a line where there is no terminal.

        Args:
            record: that was stored.
            is_new: whether it is the first of its episode in this run, and not of a retry.
        """
        if is_new:
            self._done += 1
        self._played += 1
        self._seconds_played += record.duration_s
        self._outcomes.setdefault(record.setting, Counter())[record.outcome] += 1
        elapsed = max(time.monotonic() - self._start, 1e-9)  # never 0, as it divides
        pace = _MINUTE * self._played / elapsed
        left = self._time_left(elapsed)
        if self._console.is_terminal:
            self._bar.update(self._task, completed=self._done, left=left, pace=pace)
            return
        self._console.print(
            f"\\[{self._done}/{self._total}] {escape(printable(_summary(record)))} ({left} left)",
            soft_wrap=True,
            highlight=False,
        )

    def _time_left(self, elapsed: float) -> str:
        """Return the time that the rest takes, such as ``1:02:03``; unknown at first.

        The rest is played in rounds of one episode a worker, each as long as the episodes of this
        run on average. If it is not known how many workers there are, there are as many as have
        played on average.

        Args:
            elapsed: seconds since the run began.
        """
        remaining = self._total - self._done
        if remaining and self._played < ESTIMATE_AFTER:
            return _UNKNOWN
        workers = self._workers or max(1, self._seconds_played / elapsed)
        rounds = math.ceil(remaining / workers)
        return str(timedelta(seconds=round(self._seconds_played / self._played * rounds)))

    def compare(self, found: Stopping) -> None:
        """Show every comparison below the bar; print those that are newly closed."""
        earlier = [compared.contrast for compared in self._compared if not compared.is_open]
        self._compared = found.compared
        for compared in self._compared:
            if not compared.is_open and compared.contrast not in earlier:
                self._console.print(compared.sentence, soft_wrap=True, highlight=False)

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
        lines = [Text(_progress_of(compared), "dim") for compared in self._compared]
        return Group(self._bar, Text(self._score(), "dim"), *lines)

    def _score(self) -> str:
        """Return the outcomes so far in one line: ``explicit 3/4 · direct 1/2 · errors 1``.

        These are successes of the episodes of a setting that were judged, and all errors.
        """
        parts = []
        errors = 0
        for setting, outcomes in self._outcomes.items():
            successes = outcomes["success"]
            valid = successes + outcomes["failure"]
            if valid:
                parts.append(f"{setting} {successes}/{valid}")
            errors += outcomes["error"]
        if errors:
            parts.append(f"errors {errors}")
        return " · ".join(parts)


def _progress_of(compared: ComparedSides) -> str:
    """Return how far a comparison is: ``direct, mine to pi0: 84 of 550 scenes, p = 0.21 …``.

    The p-value holds however often one looks, and is corrected over all comparisons.
    """
    decision = compared.decision
    line = f"{compared.name}: {decision.scenes} of {compared.planned} scenes"
    if not compared.is_open:
        return f"{line}, closed"
    left = compared.planned - decision.scenes
    return (
        f"{line}, {p_text(decision.p_holm)} (decided at {compared.rule.alpha}); at most {left} left"
    )


def _summary(record: Record) -> str:
    """Return an episode in one line, such as ``mine StopCube test/3 direct: failure: too late``."""
    words = f"{record.policy} {record.task} {record.split}/{record.episode} {record.setting}"
    if record.form != "implicit":
        words += f" ({record.form})"
    if record.arm != TOLD:
        words += f" ({record.arm})"
    words += f": {record.outcome}"
    if record.cause is not None:
        words += f": {record.cause}"
    return words
