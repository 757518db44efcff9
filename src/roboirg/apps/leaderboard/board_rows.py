"""The rows of a leaderboard: policies of packed runs, and the published ones."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple, get_args

import numpy as np

from roboirg.apps.leaderboard.admission import with_failures
from roboirg.apps.leaderboard.pack_checks import PackCheck
from roboirg.core.arms import TOLD
from roboirg.evaluation.analysis.published import MAX_STEPS, published_rows
from roboirg.evaluation.analysis.stats.cells import (
    Cells,
    PolicyRun,
    clustered_interval,
    gather,
)
from roboirg.evaluation.analysis.stats.intervals import ALPHA, SEED
from roboirg.evaluation.analysis.stats.option_labels import (
    has_default_options,
    setting_sort_key,
    words_label,
)
from roboirg.evaluation.analysis.stats.paired_tests import Pairs, holm, measure_gap
from roboirg.evaluation.analysis.stats.run_summary import ALL as ALL_SCOPE
from roboirg.evaluation.analysis.stats.run_summary import ScopeResults, group_by_scope
from roboirg.evaluation.records.record import Job, Summary
from roboirg.language.settings import settings_of
from roboirg.tasks import ALL, find_tasks, get_task
from roboirg.tasks.splits.private_splits import is_private

Status = Literal["verified", "sampled", "unchecked", "refuted", "published"]
STATUSES: tuple[Status, ...] = get_args(Status)


class BoardRate(NamedTuple):
    """The average success over the tasks of a setting.

    Attributes:
        percent: unweighted mean over tasks.
        interval: 95 %, percent, from the bootstrap over episodes; None if it cannot be had.
        tasks: number of tasks with a verdict.
        of: number of tasks that have the setting.
        is_complete: whether every planned trial of these tasks has a verdict.
        is_top: whether no comparable row is significantly better.
    """

    percent: float
    interval: tuple[float, float] | None
    tasks: int
    of: int
    is_complete: bool
    is_top: bool = False


class PackedRun(NamedTuple):
    """A packed run as the board needs it.

    Attributes:
        name: of the file.
        results: of its records.
        planned: jobs of its plans.
        check: what `roboirg leaderboard verify` found; None if it was not asked.
        refusal: why the board does not rank its plans; empty if it does.
    """

    name: str
    results: Sequence[Summary]
    planned: Sequence[Job]
    check: PackCheck | None
    refusal: str = ""

    @property
    def why_unranked(self) -> str:
        """Why the run is not ranked; empty if it is."""
        if self.refusal or self.results:
            return self.refusal
        return (self.check.problem if self.check else "") or "no records"


@dataclass(frozen=True)
class BoardRow:
    """One policy under one set of conditions.

    Attributes:
        policy: its name.
        source: name of the packed run, or where it is published.
        status: whether the actions lead to the verdicts.
        status_text: the same in words.
        is_privileged: whether it reads the simulator's state.
        conditions: words, split, step limit and versions; only rows with equal ones are compared.
        episodes: number of trials with a verdict.
        seeds: number of policy seeds.
        heard: share of the trials whose words the policy's model read whole; None if unknown.
        rates: by setting; empty if only private episodes were played.
        results: by setting; empty for published rows.
        policy_run: whose results these are; None for published rows.
        private: the same policy's results on private episodes, if there are some.
    """

    policy: str
    source: str
    status: Status
    status_text: str
    is_privileged: bool
    conditions: str
    episodes: int
    seeds: int
    heard: float | None
    rates: Mapping[str, BoardRate]
    results: Mapping[str, ScopeResults] = field(default_factory=dict, repr=False)
    policy_run: PolicyRun | None = None
    private: BoardRow | None = None


def board_rows(runs: Iterable[PackedRun]) -> tuple[BoardRow, ...]:
    """Return the rows of packed runs, best first by their mean over settings, then published ones.

    Of each run only the default options of the settings count, and errors count as failures. A row
    is at the top of a setting if it has a verdict on every task of it and the best comparable row
    that also has is not significantly better: an exact paired test on the same episodes,
    corrected by Holm over the rows of the setting. Privileged rows are compared with none. A
    policy's private results stand in the row of its public ones if all but the split is equal.
    """
    rows = [row for run in runs if not run.refusal for row in _rows_of(run)]
    groups: dict[str, list[int]] = defaultdict(list)
    for index, row in enumerate(rows):
        if not row.is_privileged:
            groups[row.conditions].append(index)
    for members in groups.values():
        for setting in {name for index in members for name in rows[index].rates}:
            for index in _top(rows, members, setting):
                rate = rows[index].rates[setting]._replace(is_top=True)
                rows[index] = replace(rows[index], rates={**rows[index].rates, setting: rate})
    return (*sorted(_with_private(rows), key=_rank), *_published())


def _rank(row: BoardRow) -> tuple[object, ...]:
    shown = row.rates or (row.private.rates if row.private else {})
    rates = [rate.percent for rate in shown.values()]
    return (row.is_privileged, -sum(rates) / len(rates) if rates else 0.0, row.policy, row.source)


def _with_private(rows: Sequence[BoardRow]) -> list[BoardRow]:
    """Return one row for the public and the private results of each policy run."""
    found: dict[object, list[BoardRow]] = defaultdict(list)
    for row in sorted(rows, key=_is_private):  # public ones first
        kin = found[_without_split(row.policy_run)]
        if not _is_private(row):
            kin.append(row)
            continue
        alone = [index for index, one in enumerate(kin) if one.private is None]
        if alone:
            kin[alone[0]] = _joined(kin[alone[0]], row)
        else:
            kin.append(replace(row, rates={}, private=row))
    return [row for kin in found.values() for row in kin]


def _joined(public: BoardRow, private: BoardRow) -> BoardRow:
    """Return a public row with private results; it is worth what the worse of the two is."""
    if public.source == private.source:
        return replace(public, private=private)
    status = max(public.status, private.status, key=STATUSES.index)
    text = f"{public.status_text}; {private.source}: {private.status_text}"
    source = f"{public.source}, {private.source}"
    return replace(public, status=status, status_text=text, source=source, private=private)


def _is_private(row: BoardRow) -> bool:
    return row.policy_run is not None and is_private(row.policy_run.conditions.split)


def _without_split(policy_run: PolicyRun | None) -> PolicyRun | None:
    if policy_run is None:
        return None
    conditions = policy_run.conditions._replace(split="")
    return policy_run._replace(conditions=conditions, run="")


def _rows_of(run: PackedRun) -> Iterable[BoardRow]:
    results = [one for one in with_failures(run.results) if one.arm == TOLD]
    cells = gather([(run.name, results)], [job for job in run.planned if job.arm == TOLD])
    rng = np.random.default_rng(SEED)
    by_policy_run = _by_policy_run(cells)
    for policy_run in sorted(by_policy_run, key=repr):
        by_setting = by_policy_run[policy_run]
        status, text = _status(run.check, needs_salt=is_private(policy_run.conditions.split))
        played = [one for one in results if PolicyRun.of(one) == policy_run]
        yield BoardRow(
            policy=policy_run.policy,
            source=run.name,
            status=status,
            status_text=text,
            is_privileged=policy_run.is_privileged,
            conditions=_conditions(policy_run),
            episodes=sum(one.trials for one in by_setting.values()),
            seeds=len({one.policy_seed for one in played}),
            heard=_heard(played),
            rates={
                setting: rate
                for setting, results in by_setting.items()
                if (rate := _rate(results, rng)) is not None
            },
            results=by_setting,
            policy_run=policy_run,
        )


def _by_policy_run(cells: Cells) -> dict[PolicyRun, dict[str, ScopeResults]]:
    """Return the results over all tasks of each policy run, by setting with default options."""
    found: dict[PolicyRun, dict[str, ScopeResults]] = {key.policy_run: {} for key in cells}
    groups = [one for one in group_by_scope(cells) if one.scope == ALL_SCOPE]
    for one in sorted(groups, key=lambda one: setting_sort_key(one.options.setting)):
        if has_default_options(one.options):
            found[one.policy_run][one.options.setting] = one
    return found


def _status(check: PackCheck | None, *, needs_salt: bool) -> tuple[Status, str]:
    if check is None:
        return "unchecked", "not played again yet" + ("; its salt is needed" if needs_salt else "")
    if check.problem:
        return "refuted", f"does not hold: {check.problem}"
    if not check.played:
        return (
            "unchecked",
            f"{check.records:,} records have the right words and files; none was played",
        )
    status: Status = "verified" if check.played == check.records else "sampled"
    return status, f"{check.played:,} of {check.records:,} episodes played again; all hold"


def _conditions(policy_run: PolicyRun) -> str:
    conditions, versions = policy_run.conditions, policy_run.versions
    parts = [
        f"{conditions.split} split",
        words_label(conditions.wordings),
        f"{conditions.max_steps} steps",
    ]
    if versions is not None:
        parts.append(f"language {versions.language}, environment {versions.environment}")
    return "; ".join(parts)


def _heard(results: Sequence[Summary]) -> float | None:
    known = [one.prompt_verdict for one in results if one.prompt_verdict != "unknown"]
    return known.count("heard") / len(known) if known else None


def _rate(results: ScopeResults, rng: np.random.Generator) -> BoardRate | None:
    if results.rate is None:
        return None
    drawn = clustered_interval([results.cells[task] for task in results.tasks], rng)
    setting = results.options.setting
    return BoardRate(
        percent=100 * float(results.rate),
        interval=None if drawn is None else (100 * drawn.low, 100 * drawn.high),
        tasks=len(results.tasks),
        of=sum(setting in settings_of(get_task(name)) for name in find_tasks([ALL])),
        is_complete=results.is_complete,
    )


def _top(rows: Sequence[BoardRow], members: Sequence[int], setting: str) -> list[int]:
    """Return the rows than which no other is significantly better in a setting."""
    whole = [
        index
        for index in members
        if (rate := rows[index].rates.get(setting)) is not None and rate.tasks == rate.of
    ]
    if len(whole) < 2:  # noqa: PLR2004 - one row has no rival
        return []
    best = max(whole, key=lambda index: rows[index].rates[setting].percent)
    others = [index for index in whole if index != best]
    p_values = holm([_p_value(rows[best], rows[index], setting) for index in others])
    tied = [index for index, p in zip(others, p_values, strict=True) if p >= ALPHA]
    return [best, *tied]


def _p_value(best: BoardRow, other: BoardRow, setting: str) -> float:
    ours, theirs = best.results[setting].cells, other.results[setting].cells
    pairs = [Pairs.of(cell, theirs[task]) for task, cell in ours.items() if task in theirs]
    gap = measure_gap(pairs, np.random.default_rng(SEED))
    return 1.0 if gap is None else gap.p_value


def _published() -> Iterable[BoardRow]:
    by_model: dict[str, dict[str, BoardRate]] = defaultdict(dict)
    for row in published_rows("main"):
        applying = sum(rate is not None for rate in row.rates.values())
        rate = BoardRate(float(row.average), None, applying, applying, is_complete=True)
        by_model[row.model][row.options.setting] = rate
    for model, rates in by_model.items():
        yield BoardRow(
            policy=model,
            source="the paper",
            status="published",
            status_text="published without its actions, so it cannot be checked",
            is_privileged=False,
            conditions=f"the paper's episodes and words; {MAX_STEPS} steps",
            episodes=0,
            seeds=3,
            heard=None,
            rates=rates,
        )
