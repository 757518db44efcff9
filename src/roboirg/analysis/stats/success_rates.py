"""Success rates and their gaps to the explicit setting. Functions of records alone."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from roboirg.analysis.stats.intervals import Interval, wilson_interval
from roboirg.core.instruction_options import (
    ALL_STAGES,
    DEFAULT_DISTRACTOR,
    DEFAULT_DISTRACTORS,
    DEFAULT_FRAME,
)
from roboirg.core.observations import DemonstrationFrames
from roboirg.records.record import DEFAULT_MESHES, Job, Result

SETTING_ORDER = ("explicit", "direct", "reasoning", "contextual", "spatial")


class SettingColumn(NamedTuple):
    """A way of telling: a setting, its form, and what was not said in the usual way."""

    setting: str
    form: str = "implicit"
    stages: tuple[int, ...] = ALL_STAGES
    distractor: str = DEFAULT_DISTRACTOR
    frame: str = DEFAULT_FRAME
    distractors: int = DEFAULT_DISTRACTORS

    @classmethod
    def of(cls, job: Job) -> SettingColumn:
        """How a job was told."""
        return cls(**{name: getattr(job, name) for name in cls._fields})

    @property
    def label(self) -> str:
        """The setting, and in brackets what is unusual."""
        unusual = []
        if self.form != "implicit":
            unusual.append(self.form)
        if self.stages != ALL_STAGES:
            unusual.append("stages " + ",".join(map(str, self.stages)))
        if self.distractor != DEFAULT_DISTRACTOR:
            unusual.append(f"{self.distractor} distractor")
        if self.distractors != DEFAULT_DISTRACTORS:
            unusual.append(f"{self.distractors} distractors")
        if self.frame != DEFAULT_FRAME:
            unusual.append(f"{self.frame} frame")
        return f"{self.setting} ({', '.join(unusual)})" if unusual else self.setting

    def sort_key(self) -> tuple[object, ...]:
        """Settings from explicit to spatial; in each the implicit form first, then the usual."""
        known = self.setting in SETTING_ORDER
        place = SETTING_ORDER.index(self.setting) if known else len(SETTING_ORDER)
        return (place, self.setting, self.form != "implicit", self.label)


EXPLICIT = SettingColumn("explicit")


class Condition(NamedTuple):
    """Who played under which rules: what one table is about."""

    policy: str
    split: str
    max_steps: int
    actions: str | None = None
    demonstration_frames: DemonstrationFrames | None = None
    observe_every: int | None = None
    meshes: str = DEFAULT_MESHES

    @classmethod
    def of(cls, job: Job) -> Condition:
        """The condition of a job."""
        return cls(**{name: getattr(job, name) for name in cls._fields})


@dataclass(frozen=True, slots=True)
class Cell:
    """What came of one task (or all of them) told in one way.

    Attributes:
        successes: episodes.
        failures: episodes.
        errors: episodes that say nothing about the policy; in no rate.
        missing: episodes of the plan that have no record yet.
        pairs: episodes that have a verdict both here and in the explicit setting.
        gap: mean over those pairs of success here less success there, -1 to 1; None without
            pairs.
        explicit: success rate of those pairs in the explicit setting; None without pairs.
    """

    successes: int = 0
    failures: int = 0
    errors: int = 0
    missing: int = 0
    pairs: int = 0
    gap: float | None = None
    explicit: float | None = None

    @property
    def trials(self) -> int:
        """Episodes with a verdict."""
        return self.successes + self.failures

    @property
    def rate(self) -> float | None:
        """Success rate, 0 to 1; None without a verdict."""
        return self.successes / self.trials if self.trials else None

    @property
    def interval(self) -> Interval | None:
        """Wilson's 95 % interval of the rate; None without a verdict."""
        return wilson_interval(self.successes, self.trials) if self.trials else None

    @property
    def is_at_floor(self) -> bool:
        """Whether nothing succeeded in the explicit setting, so that no words can cost anything."""
        return self.explicit == 0

    @property
    def is_complete(self) -> bool:
        """Whether every episode of the plan has a verdict."""
        return not self.errors and not self.missing


@dataclass(frozen=True, slots=True)
class Panel:
    """All that one policy did under the same rules.

    Attributes:
        label: the policy, whether it is privileged, and the rules where there are several.
        condition: policy and rules.
        tasks: the rows.
        variants: the columns.
        cells: by task (None: all tasks together) and variant; tasks in order, all together last.
        privileged: whether the policy looks behind the scenes.
    """

    label: str
    condition: Condition
    tasks: tuple[str, ...]
    variants: tuple[SettingColumn, ...]
    cells: Mapping[tuple[str | None, SettingColumn], Cell]
    privileged: bool = False

    @property
    def is_complete(self) -> bool:
        """Whether every episode of the plan has a verdict."""
        return all(cell.is_complete for cell in self.cells.values())

    def trials(self, tasks: Iterable[str | None]) -> tuple[int, int]:
        """Fewest and most episodes with a verdict in the cells of these rows."""
        rows = set(tasks)
        counts = [cell.trials for (task, _), cell in self.cells.items() if task in rows]
        return min(counts, default=0), max(counts, default=0)


def make_panels(records: Sequence[Result], planned: Sequence[Job] = ()) -> tuple[Panel, ...]:
    """One panel for each policy (and split and limit), in the order in which they appear.

    Args:
        records: one for each identity.
        planned: jobs that should have a record; those without one are counted as missing.
    """
    have = {record.identity for record in records}
    missing = [job for job in planned if job not in have]
    everything: list[Job] = [*records, *missing]
    conditions = list(dict.fromkeys(Condition.of(job) for job in [*planned, *everything]))
    tasks = tuple(dict.fromkeys(job.task for job in [*planned, *everything]))
    variants = tuple(
        sorted({SettingColumn.of(job) for job in everything}, key=SettingColumn.sort_key)
    )
    privileged = {record.policy for record in records if record.privileged}
    return tuple(
        _make_panel(
            condition,
            [record for record in records if Condition.of(record) == condition],
            [job for job in missing if Condition.of(job) == condition],
            label=_label(condition, conditions, privileged=condition.policy in privileged),
            privileged=condition.policy in privileged,
            tasks=tasks,
            variants=variants,
        )
        for condition in conditions
    )


def _make_panel(
    condition: Condition,
    records: Sequence[Result],
    missing: Sequence[Job],
    *,
    label: str,
    privileged: bool,
    tasks: tuple[str, ...],
    variants: tuple[SettingColumn, ...],
) -> Panel:
    explicit = {
        _pair_key(record): record.outcome == "success"
        for record in records
        if record.setting == "explicit" and record.outcome != "error"
    }
    groups: dict[tuple[str | None, SettingColumn], list[Result]] = defaultdict(list)
    lacking: dict[tuple[str | None, SettingColumn], int] = defaultdict(int)
    for record in records:
        for row in (record.task, None):
            groups[row, SettingColumn.of(record)].append(record)
    for job in missing:
        for row in (job.task, None):
            lacking[row, SettingColumn.of(job)] += 1
    cells = {
        (row, variant): _make_cell(groups[row, variant], lacking[row, variant], explicit)
        for row in (*tasks, None)
        for variant in variants
        if (row, variant) in groups or (row, variant) in lacking
    }
    own_tasks = tuple(task for task in tasks if any(row == task for row, _ in cells))
    own_variants = tuple(variant for variant in variants if (None, variant) in cells)
    return Panel(label, condition, own_tasks, own_variants, cells, privileged)


def _make_cell(
    records: Sequence[Result], missing: int, explicit: Mapping[tuple[object, ...], bool]
) -> Cell:
    outcomes = [record.outcome for record in records]
    pairs = [
        (record.outcome == "success", explicit[_pair_key(record)])
        for record in records
        if record.outcome != "error" and _pair_key(record) in explicit
    ]
    count = len(pairs)
    return Cell(
        successes=outcomes.count("success"),
        failures=outcomes.count("failure"),
        errors=outcomes.count("error"),
        missing=missing,
        pairs=count,
        gap=sum(here - there for here, there in pairs) / count if pairs else None,
        explicit=sum(there for _, there in pairs) / count if pairs else None,
    )


def _pair_key(record: Result) -> tuple[object, ...]:
    """Same world, same policy, same luck: only the words differ."""
    return (record.task, record.episode, record.policy_seed)


def _label(condition: Condition, conditions: Sequence[Condition], *, privileged: bool) -> str:
    label = f"{condition.policy} (privileged)" if privileged else condition.policy
    if len({other.split for other in conditions}) > 1:
        label += f" · {condition.split}"
    if len({other.max_steps for other in conditions}) > 1:
        label += f" · at most {condition.max_steps} steps"
    for name in ("actions", "demonstration_frames", "observe_every", "meshes"):
        if len({getattr(other, name) for other in conditions}) > 1:
            label += f" · {name.replace('_', ' ')} {getattr(condition, name)}"
    return label
