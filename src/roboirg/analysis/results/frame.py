"""Results as one long table: a row for each episode, its columns declared once.

Planned episodes that were not played are rows, too: their outcome is ``missing``, or ``spared`` if
they need not be played.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.analysis.results.option_labels import SortKey, options_sort_key, place_in
from roboirg.analysis.results.policy_run import EvalConditions, PolicyRun, labels
from roboirg.core.arms import TOLD
from roboirg.core.instruction_options import InstructionOptions, options_label
from roboirg.core.versions import Versions
from roboirg.records.record import Job, Summary
from roboirg.records.record_codec import RecordKey, identity_key
from roboirg.tasks import all_tasks

MISSING = "missing"
"""Outcome of planned episodes that were not played."""
SPARED = "spared"
"""Outcome of those that need not be, because what the run compares was decided before; also of
those that were played after that, as these count nowhere."""
UNPLAYED = (MISSING, SPARED)

Values = NDArray[np.object_]
Runs = Sequence[tuple[str, Sequence[Summary]]]
"""Results of runs, each with its name."""


RunNames = Mapping[PolicyRun, str]
"""Labels of policy runs, in order."""


class _FrameRow(NamedTuple):
    """An episode before it is sorted into a frame.

    Attributes:
        policy_run: that played it, or should have.
        job: its result; if it was not played, the planned job.
        outcome: that of the result, or one of `UNPLAYED`.
    """

    policy_run: PolicyRun
    job: Job
    outcome: str


class Spared(NamedTuple):
    """What a run needs no more that stops when what it compares is decided.

    Attributes:
        findings: what it compares, and what was found, in sentences.
        jobs: of the plan that need no result.
    """

    findings: tuple[str, ...]
    jobs: Sequence[Job]


class FrameColumn(NamedTuple):
    """A column of the table.

    Attributes:
        name: of the column.
        kind: text, texts (several), number (whole), decimal, or flag (true or false).
        meaning: of its values, with their unit.
        missing: what a missing value means; empty if there is none.
        read: returns the value of a result.
    """

    name: str
    kind: str
    meaning: str
    missing: str
    read: Callable[[Any], object]


def _field(name: str, kind: str, meaning: str, missing: str = "", path: str = "") -> FrameColumn:
    """Return a column that is a field of results, the one at a path if it has another name."""
    return FrameColumn(name, kind, meaning, missing, operator.attrgetter(path or name))


def _attributed(name: str) -> Callable[[Summary], str | None]:
    """Return a function that reads one field of why an episode failed; None if it did not fail."""

    def read(result: Summary) -> str | None:
        if result.attribution is None:
            return None
        return str(getattr(result.attribution, name))

    return read


def _used(name: str, kind: str, meaning: str, key: str = "") -> FrameColumn:
    """Return a column of what the policy's models cost, by a key of the result's usage."""

    def read(result: Summary) -> float | None:
        amount = result.usage.get(key or name)
        if amount is None or kind == "decimal":
            return amount
        return int(amount)

    return FrameColumn(name, kind, meaning, "unknown, or no model", read)


COLUMNS: Mapping[str, FrameColumn] = {
    column.name: column
    for column in (
        _field("policy", "text", "name of the policy"),
        _field("policy_version", "text", "version of the policy"),
        _field(
            "policy_label",
            "text",
            "the policy as tables name it, with what distinguishes its runs",
            path="policy",
        ),
        _field("privileged", "flag", "whether the policy reads the simulator's state"),
        _field("task", "text", "task"),
        FrameColumn(
            "suite", "text", "suite of the task", "not installed", lambda result: suite(result.task)
        ),
        _field("split", "text", "split of the episode"),
        _field("setting", "text", "setting of the instruction"),
        _field("form", "text", "implicit, or resolved: references replaced by names"),
        FrameColumn(
            "instruction_options",
            "text",
            "the setting and the options that differ from its defaults",
            "",
            lambda result: options_label(result.column),
        ),
        _field("delivery", "text", "how the utterances reach the policy", path="options.delivery"),
        _field("arm", "text", "control arm; told for the episode's own words"),
        _field("episode", "number", "position of the episode in its split, from 0"),
        _field("policy_seed", "number", "seed of the policy"),
        _field("difficulty", "text", "easy, medium or hard"),
        _field("outcome", "text", "success, failure, or error (in no rate)"),
        FrameColumn(
            "success",
            "flag",
            "whether the episode succeeded",
            "error",
            lambda result: {"success": True, "failure": False}.get(result.outcome),
        ),
        FrameColumn("failure", "text", "how it failed", "no failure", _attributed("failure")),
        FrameColumn(
            "failure_kind",
            "text",
            "grounding, execution or undecided",
            "no failure",
            _attributed("kind"),
        ),
        _field("error", "text", "kind of error", "no error"),
        _field("cause", "text", "why it failed, in words", "success"),
        _field(
            "prompt", "text", "whether the prompt was heard whole, or cut", path="prompt_verdict"
        ),
        _field("guessed", "flag", "whether the words had no meaning for the policy, so it guessed"),
        _used("model_calls", "number", "calls of models by the policy", "calls"),
        _used("input_tokens", "number", "tokens that these models read"),
        _used("output_tokens", "number", "tokens that they wrote"),
        _used("cost_usd", "decimal", "price of these calls, US$"),
        _field("steps", "number", "control steps that the policy played"),
        _field("demonstration_steps", "number", "frames of the video before its turn"),
        _field("wordings", "text", "pool or file of other words", "own words", "options.wordings"),
        _field("max_steps", "number", "limit of control steps", path="environment.max_steps"),
        _field("meshes", "text", "kind of meshes", path="environment.meshes"),
        _field(
            "observe_every",
            "number",
            "control steps between pictures",
            "as the policy asks",
            "environment.observe_every",
        ),
        _field(
            "demonstration_frames",
            "text",
            "frames of the video",
            "as the policy asks",
            "environment.demonstration_frames",
        ),
        _field("duration_s", "decimal", "wall-clock time, seconds"),
        _field("started_at", "text", "ISO 8601, UTC"),
        _field("language_version", "text", "version of the words"),
        _field("words_version", "text", "which words of the task and pool were said", path="words"),
        _field("environment_version", "number", "version of scenes, rules and physics"),
        _field("package_version", "text", "version of roboirg"),
        _field("render_device", "text", "what drew the pictures", "nothing was drawn"),
        _field("robot", "text", "the real robot", "in simulation"),
        _field("video", "text", "path of the video below the run", "no video"),
    )
}
"""Columns of results, in the order of the documentation."""
_OF_JOB = frozenset({"policy", "task", "split", "arm", "setting", "form", "episode", "policy_seed"})
"""The columns that an episode has before it is played."""


def suite(task: str) -> str | None:
    """Return the suite of a task; None if the task is not installed."""
    known = all_tasks().get(task)
    if known is None:
        return None
    return known.suite


class Frame(Mapping[str, Any]):
    """Columns of equal length, a row for each episode; read when they are asked for.

    Besides `COLUMNS` it has ``run`` (a `PolicyRun`), ``options`` (of the instruction, without
    wordings), ``result`` (a `Summary`, or the `Job` of an episode that was not played) and
    ``place`` (of the result among all that were given).
    """

    def __init__(self, columns: Mapping[str, Values]) -> None:
        self.columns = dict(columns)  # those that were read so far

    def __getitem__(self, name: str) -> Values:
        if name not in self.columns:
            self.columns[name] = self._read(name)
        return self.columns[name]

    def _read(self, name: str) -> Values:
        """Return the column of one of `COLUMNS`, read from each episode's result.

        An episode that was not played has only what its job says, and else None.
        """
        if name == "policy_label":
            return as_column([self.names[policy_run] for policy_run in self["run"]])
        read = COLUMNS[name].read
        if name in _OF_JOB:
            return as_column([read(job) for job in self["result"]])
        values = []
        for result, outcome in zip(self["result"], self["outcome"], strict=True):
            value = None
            if outcome not in UNPLAYED:
                value = read(result)
            values.append(value)
        return as_column(values)

    def __iter__(self) -> Iterator[str]:
        return iter({**self.columns, **COLUMNS})

    def __len__(self) -> int:
        """Return the number of columns."""
        return len({**self.columns, **COLUMNS})

    def take(self, rows: Sequence[int] | NDArray[Any]) -> Frame:
        """Return some rows: by their numbers, or those for which an array holds true."""
        return Frame({name: column[rows] for name, column in self.columns.items()})

    def where(self, **values: object) -> Frame:
        """Return the rows that have certain values in some columns."""
        chosen = np.ones(len(self["outcome"]), dtype=bool)
        for name, wanted in values.items():
            chosen &= [value == wanted for value in self[name]]
        return self.take(chosen)

    def spread(self, name: str, values: Iterable[Sequence[object]]) -> Frame:
        """Repeat each row once for each of its values, which go into a new column.

        The values ``[["a", "b"], [], ["c"]]`` of three rows make three rows: the first one twice,
        with ``a`` and ``b``, and the last one with ``c``.

        Args:
            name: of the new column.
            values: for each row none, one or several; rows without a value are left out.
        """
        rows = []
        column = []
        for row, values_of_row in enumerate(values):
            for value in values_of_row:
                rows.append(row)
                column.append(value)
        return self.take(rows).extended({name: as_column(column)})

    def extended(self, columns: Mapping[str, Values]) -> Frame:
        """Return the frame with further columns."""
        return Frame({**self.columns, **columns})

    def without_control_arms(self) -> Frame:
        """Return only the episodes with their own words; if there are none, the frame as it is.

        The others are control arms: the same scenes with other words, or with none.
        """
        has_own_words = self["arm"] == TOLD
        has_both = has_own_words.any() and not has_own_words.all()
        return self.take(has_own_words) if has_both else self

    @property
    def played(self) -> list[Summary]:
        """The results, without episodes that were not played; none of frames without results."""
        if "result" not in self.columns:
            return []
        return list(self["result"][self.is_played])

    @property
    def is_played(self) -> NDArray[np.bool_]:
        """Of each row, whether its episode has a result that counts."""
        return np.array([outcome not in UNPLAYED for outcome in self["outcome"]], dtype=bool)

    @cached_property
    def names(self) -> RunNames:
        """Labels of the policy runs, in order."""
        return labels(self["run"])

    def group_label(self, policy_run: PolicyRun, options: InstructionOptions) -> str:
        """Return the label of a policy run with options: ``listener, relational``."""
        return f"{self.names[policy_run]}, {options_label(options)}"

    @cached_property
    def names_as_played(self) -> RunNames:
        """Labels of the policy runs, in the order of their first records."""
        policy_runs = self["run"][np.argsort(self["place"])]
        return {policy_run: self.names[policy_run] for policy_run in dict.fromkeys(policy_runs)}


def as_column(values: Sequence[object]) -> Values:
    """Return values as a column; tuples stay tuples."""
    column = np.empty(len(values), dtype=object)
    column[:] = values
    return column


def join(frames: Iterable[Frame]) -> Frame:
    """Join tables of results: the rows of one frame after those of the other, column by column."""
    parts = list(frames)
    columns = {}
    for name in parts[0].columns:
        columns[name] = np.concatenate([part[name] for part in parts])
    return Frame(columns)


def make_frame(
    runs: Runs,
    planned: Sequence[Job] = (),
    *,
    run_name: str = "",
    spared: Mapping[str, Spared] | None = None,
) -> Frame:
    """Return the results of one or several runs as a table, a row for each episode.

    Rows are sorted by policy run, task, options and episode. A policy run is a policy under one set
    of conditions and versions. Policies stay in the order of the planned jobs; others follow by
    name.

    Args:
        runs: the results of a run have different identities. Runs that hold the same episodes of a
            policy stay apart; others complete each other.
        planned: jobs that should have a result; those without one are missing.
        run_name: the name of a run that all its policy runs bear; without it, only those bear one
            that have to stay apart.
        spared: of each run that stops when it is decided, by name.
    """
    stopped = spared or {}
    policies_apart = _played_twice(runs)
    missing = {identity_key(job): job for job in planned}
    rows = []
    for name, results in runs:
        for result in results:
            policy_run = PolicyRun.of(result, run_name)
            if result.policy in policies_apart and not run_name:
                policy_run = policy_run._replace(run=name)
            if name in stopped:
                policy_run = policy_run._replace(findings=stopped[name].findings)
            rows.append(_FrameRow(policy_run, result, result.outcome))
            if missing:
                missing.pop(identity_key(result), None)
    if missing:
        rows += _unplayed_rows(missing.values(), MISSING, rows, run_name)
    for of_run in stopped.values():
        rows += _unplayed_rows(of_run.jobs, SPARED, rows, run_name)
    policies = list(dict.fromkeys(job.policy for job in planned))
    return _sorted(rows, policies)


def _unplayed_rows(
    jobs: Iterable[Job], outcome: str, played: Sequence[_FrameRow], run_name: str
) -> list[_FrameRow]:
    """Return a row for each planned job without a result that counts.

    Its versions are unknown, so it counts to the first policy run that has played with its policy
    and conditions, or to a policy run without versions if none has.

    Args:
        jobs: without a result.
        outcome: of these, one of `UNPLAYED`.
        played: the rows with one.
        run_name: the name of the run, for policy runs that have not played anything.
    """
    first_runs: dict[tuple[str, EvalConditions], PolicyRun] = {}
    for row in played:
        policy_run = row.policy_run
        first_runs.setdefault((policy_run.policy, policy_run.conditions), policy_run)
    rows = []
    for job in jobs:
        conditions = EvalConditions.of(job)
        unplayed = PolicyRun(job.policy, conditions, Versions(), run_name)
        policy_run = first_runs.get((job.policy, conditions), unplayed)
        rows.append(_FrameRow(policy_run, job, outcome))
    return rows


class _Groups(NamedTuple):
    """What rows are grouped by, such as their tasks.

    Attributes:
        values: the distinct values, in the order of the frame.
        numbers: of each row's value among these.
    """

    values: Values
    numbers: list[int]

    @classmethod
    def of(cls, values: Sequence[Any], key: Callable[[Any], SortKey]) -> _Groups:
        """Return the groups of rows with some values, which are sorted by a key."""
        distinct = sorted(dict.fromkeys(values), key=key)
        numbers = {value: number for number, value in enumerate(distinct)}
        return cls(as_column(distinct), [numbers[value] for value in values])

    def column(self, rows: Iterable[int]) -> Values:
        """Return the values of some rows; equal ones are the same object, found faster later."""
        return self.values[[self.numbers[row] for row in rows]]


def _sorted(rows: Sequence[_FrameRow], policies: Sequence[str]) -> Frame:
    """Sort rows by policy run, task, options, episode and policy seed; return them as a frame.

    The order must not depend on which episode ended first, as tables and groups follow it.

    Args:
        rows: in any order.
        policies: those that come first, in this order.
    """
    jobs = [row.job for row in rows]
    runs = _Groups.of([row.policy_run for row in rows], lambda run: _run_key(run, policies))
    tasks = _Groups.of([job.task for job in jobs], _task_key)
    options = _Groups.of([job.column for job in jobs], options_sort_key)
    groups = zip(runs.numbers, tasks.numbers, options.numbers, strict=True)
    order = _order(groups, jobs)
    columns: dict[str, Any] = {
        "result": as_column([jobs[number] for number in order]),
        "outcome": as_column([rows[number].outcome for number in order]),
        "place": np.array(order, dtype=np.int64),
        "run": runs.column(order),
        "options": options.column(order),
    }
    return Frame(columns)


def _order(groups: Iterable[tuple[int, ...]], jobs: Sequence[Job]) -> list[int]:
    """Return the numbers of the rows, sorted by group and within it by episode and policy seed."""
    keys = []
    for group, job in zip(groups, jobs, strict=True):
        keys.append((group, job.episode, job.policy_seed))
    return sorted(range(len(keys)), key=keys.__getitem__)


def _run_key(run: PolicyRun, policies: Sequence[str]) -> SortKey:
    """Return a key that sorts policy runs: some policies first, in their order, others by name."""
    place = place_in(policies, run.policy)
    return (place, run.policy, run.run, repr(run.conditions), repr(run.versions), run.robot or "")


def task_order(names: Iterable[str]) -> list[str]:
    """Sort tasks in the order of the benchmark; unknown tasks come last."""
    return sorted(names, key=_task_key)


def _task_key(name: str) -> tuple[int, str]:
    return place_in(list(all_tasks()), name), name


def _played_twice(runs: Runs) -> set[str]:
    """Return the names of policies that played the same episode in several of the runs.

    The same means equal in all that identifies an episode: task, words, policy seed, conditions.
    """
    twice: set[str] = set()
    if len(runs) == 1:
        return twice
    seen: set[RecordKey] = set()
    for _, results in runs:
        policies = {identity_key(result): result.policy for result in results}  # of this run
        for key in seen & policies.keys():
            twice.add(policies[key])
        seen |= policies.keys()
    return twice
