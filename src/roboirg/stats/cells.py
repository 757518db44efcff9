"""Trials of one task that are counted together, and groups of them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from roboirg.core.errors import InvalidValueError
from roboirg.stats.intervals import Interval, Rows, TaskRates, mean_interval


class Trial(NamedTuple):
    """One play of one episode."""

    episode: int
    policy_seed: int


class Counts(NamedTuple):
    """Numbers of trials.

    Attributes:
        successes: trials that succeeded.
        trials: trials with a verdict.
        episodes: episodes with a verdict.
        errors: trials that ended in an error and are in no rate.
        missing: planned trials without a result.
        spared: planned trials that need no result, as what the run compares was decided before.
    """

    successes: int = 0
    trials: int = 0
    episodes: int = 0
    errors: int = 0
    missing: int = 0
    spared: int = 0

    @property
    def is_complete(self) -> bool:
        """Whether every planned trial has a verdict."""
        return self.trials > 0 and not (self.errors or self.missing or self.spared)


@dataclass(slots=True, eq=False)
class Cell:
    """Trials of one task, which grow with `add`; two cells are never equal.

    Attributes:
        verdicts: for each trial with a verdict, whether it succeeded.
        errors: number of trials that ended in an error.
        missing: number of planned trials without a result.
        spared: number of those that need none.
    """

    verdicts: dict[Trial, bool] = field(default_factory=dict)
    errors: int = 0
    missing: int = 0
    spared: int = 0

    def add(self, trial: Trial, outcome: str) -> None:
        """Count a trial by its outcome; success and failure are verdicts, of which rates are made.

        Args:
            trial: the episode and the policy seed.
            outcome: ``success``, ``failure``, ``error``, ``missing`` if it was not played, or
                ``spared`` if it need not be.

        Raises:
            InvalidValueError: the outcome is none of these.
        """
        if outcome in ("success", "failure"):
            self.verdicts[trial] = outcome == "success"
        elif outcome == "error":
            self.errors += 1
        elif outcome == "missing":
            self.missing += 1
        elif outcome == "spared":
            self.spared += 1
        else:
            raise InvalidValueError(
                f"The column 'outcome' has {outcome!r}; it must be success, failure, error, "
                "missing or spared."
            )

    @property
    def counts(self) -> Counts:
        """The numbers of trials."""
        return Counts(
            successes=sum(self.verdicts.values()),
            trials=len(self.verdicts),
            episodes=len({trial.episode for trial in self.verdicts}),
            errors=self.errors,
            missing=self.missing,
            spared=self.spared,
        )

    @property
    def rate(self) -> Fraction | None:
        """Success rate, the mean over policy seeds; None without a verdict."""
        if not self.verdicts:
            return None
        return Fraction(sum(self.verdicts.values()), len(self.verdicts))

    def by_episode(self) -> dict[int, dict[int, bool]]:
        """Return for each episode whether it succeeded, by policy seed."""
        episodes: dict[int, dict[int, bool]] = defaultdict(dict)
        for (episode, policy_seed), has_succeeded in self.verdicts.items():
            episodes[episode][policy_seed] = has_succeeded
        return episodes

    def rows(self) -> Rows:
        """Return successes and trials of each episode, sorted by its number, shape (episodes, 2).

        An episode that succeeded with one of three policy seeds has the row ``(1, 3)``.
        """
        rows = []
        for _, verdicts in sorted(self.by_episode().items()):
            row = (sum(verdicts.values()), len(verdicts))
            rows.append(row)
        return np.array(rows, dtype=np.int64).reshape(-1, 2)


Columns = Mapping[str, Any]
"""A frame, or the data frame that `roboirg.results` returns."""
Key = tuple[Any, ...]
"""What a group is about: the values of the columns that it is grouped by."""
TRIAL = ("task", "episode", "policy_seed", "outcome")
"""Columns that tell a trial and its end."""
ByTask = Mapping[str, Cell]
NOTHING: ByTask = {}


def gather(frame: Columns, by: Sequence[str]) -> Mapping[Key, ByTask]:
    """Collect trials in cells, one for each task, by the values of some columns of a frame.

    By policy and setting, for example, ``{("oracle", "direct"): {"StopCube": Cell(…)}}``, in the
    order in which the values occur. A row of the frame is a trial and has the columns of `TRIAL`
    (task, episode, policy seed, outcome), too.
    """
    groups: dict[Key, dict[str, Cell]] = {}
    last_key = None
    cells: dict[str, Cell] = {}
    for row in rows_of(frame, *by, *TRIAL):
        *key, task, episode, policy_seed, outcome = row
        if key != last_key:  # rows of a group mostly follow each other, and its hash takes long
            cells = groups.setdefault(tuple(key), {})
            last_key = key
        cell = cells.setdefault(task, Cell())
        cell.add(Trial(episode, policy_seed), outcome)
    return groups


def rows_of(frame: Columns, *names: str) -> Iterator[Key]:
    """Return the values of each row in some columns."""
    columns = [frame[name] for name in names]
    return zip(*columns, strict=True)


def rate_interval(tasks: Collection[Cell]) -> Interval | None:
    """Return the 95 % interval of a success rate, the mean over tasks with a verdict.

    None with too few episodes: it takes more of them than tasks.
    """
    judged = [cell for cell in tasks if cell.verdicts]
    if not judged:
        return None
    strata = []
    for cell in judged:
        strata.append(TaskRates.of(cell.rows()).combined(1 / len(judged)))
    return mean_interval(strata)
