"""Results as one long table: a row for each episode, its columns declared once.

Planned episodes that were not played are rows, too: their outcome is ``missing``.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.core.arms import TOLD
from roboirg.core.versions import Versions
from roboirg.evaluation.analysis.results.option_labels import options_label, options_sort_key
from roboirg.evaluation.analysis.results.policy_run import EvalConditions, PolicyRun, labels
from roboirg.evaluation.records.record import Job, Summary
from roboirg.evaluation.records.record_codec import RecordKey, identity_key
from roboirg.tasks import all_tasks

MISSING = "missing"
"""Outcome of planned episodes that were not played."""

Values = NDArray[np.object_]
Runs = Sequence[tuple[str, Sequence[Summary]]]
"""Results of runs, each with its name."""


RunNames = Mapping[PolicyRun, str]
"""Labels of policy runs, in order."""
_Row = tuple[PolicyRun, Job, str]
"""Who plays; the result, or the job of an episode that was not played; and the outcome."""


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
    return FrameColumn(name, kind, meaning, missing, operator.attrgetter(path or name))


def _of_failure(name: str) -> Callable[[Summary], str | None]:
    return lambda one: None if one.attribution is None else str(getattr(one.attribution, name))


COLUMNS: Mapping[str, FrameColumn] = {
    one.name: one
    for one in (
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
            "suite", "text", "suite of the task", "not installed", lambda one: suite(one.task)
        ),
        _field("split", "text", "split of the episode"),
        _field("setting", "text", "setting of the instruction"),
        _field("form", "text", "implicit, or resolved: references replaced by names"),
        FrameColumn(
            "instruction_options",
            "text",
            "the setting and the options that differ from its defaults",
            "",
            lambda one: options_label(one.column),
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
            lambda one: {"success": True, "failure": False}.get(one.outcome),
        ),
        FrameColumn("failure", "text", "how it failed", "no failure", _of_failure("failure")),
        FrameColumn(
            "failure_kind",
            "text",
            "grounding, execution or undecided",
            "no failure",
            _of_failure("kind"),
        ),
        _field("error", "text", "kind of error", "no error"),
        _field("cause", "text", "why it failed, in words", "success"),
        _field(
            "prompt", "text", "whether the prompt was heard whole, or cut", path="prompt_verdict"
        ),
        _field("guessed", "flag", "whether the words had no meaning for the policy, so it guessed"),
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
        FrameColumn(
            "words_version",
            "text",
            "which words of the task and pool were said",
            "a language whose words are code",
            lambda one: one.words or None,
        ),
        _field("environment_version", "number", "version of scenes, rules and physics"),
        _field("package_version", "text", "version of roboirg"),
        _field("render_device", "text", "what drew the pictures", "nothing was drawn"),
        _field("robot", "text", "the real robot", "in simulation"),
        _field("video", "text", "path of the video below the run", "no video"),
    )
}
"""Columns of results, in the order of the documentation."""


def suite(task: str) -> str | None:
    known = all_tasks().get(task)
    return None if known is None else known.suite


class Frame(Mapping[str, Any]):
    """Columns of equal length, a row for each episode; read when they are asked for.

    Besides `COLUMNS` it has ``run`` (a `PolicyRun`), ``options`` (of the instruction, without
    wordings), ``result`` (a `Summary`, or the `Job` of an episode that was not played) and
    ``place`` (of the result among all that were given).
    """

    def __init__(self, columns: Mapping[str, Values]) -> None:
        self.columns = dict(columns)  # those that were read so far

    def __getitem__(self, name: str) -> Values:
        if name == "policy_label" and name not in self.columns:
            self.columns[name] = as_column([self.names[run] for run in self["run"]])
        elif name not in self.columns:
            read = COLUMNS[name].read
            rows = zip(self["result"], self["outcome"], strict=True)
            found = [None if outcome == MISSING else read(one) for one, outcome in rows]
            self.columns[name] = as_column(found)
        return self.columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter({**self.columns, **COLUMNS})

    def __len__(self) -> int:
        """Return the number of columns."""
        return len(list(iter(self)))

    def take(self, rows: Sequence[int] | NDArray[Any]) -> Frame:
        """Return some rows: by their numbers, or those for which an array holds true."""
        return Frame({name: column[rows] for name, column in self.columns.items()})

    def where(self, **values: object) -> Frame:
        """Return the rows that have certain values in some columns."""
        chosen = np.ones(len(self["outcome"]), dtype=bool)
        for name, value in values.items():
            chosen &= [one == value for one in self[name]]
        return self.take(chosen)

    def spread(self, name: str, values: Iterable[Sequence[object]]) -> Frame:
        """Return the frame with a new column and each row once for each of its values."""
        pairs = [(row, one) for row, own in enumerate(values) for one in own]
        found = self.take([row for row, _ in pairs])
        return found.extended({name: as_column([one for _, one in pairs])})

    def extended(self, columns: Mapping[str, Values]) -> Frame:
        """Return the frame with further columns."""
        return Frame({**self.columns, **columns})

    def told(self) -> Frame:
        """Return the frame without control arms, if there is anything else."""
        is_told = self["arm"] == TOLD
        return self.take(is_told) if is_told.any() and not is_told.all() else self

    @property
    def played(self) -> list[Summary]:
        """The results, without episodes that were not played; none of frames without results."""
        if "result" not in self.columns:
            return []
        return list(self["result"][self["outcome"] != MISSING])

    @cached_property
    def names(self) -> RunNames:
        """Labels of the policy runs, in order."""
        return labels(self["run"])

    @property
    def names_as_played(self) -> RunNames:
        """Labels of the policy runs, in the order of their first records."""
        return {run: self.names[run] for run in self["run"][np.argsort(self["place"])]}


def as_column(values: Sequence[object]) -> Values:
    """Return values as a column; tuples stay tuples."""
    column = np.empty(len(values), dtype=object)
    column[:] = values
    return column


def join(frames: Iterable[Frame]) -> Frame:
    """Return the rows of one frame after the other."""
    found = list(frames)
    return Frame({name: np.concatenate([one[name] for one in found]) for name in found[0].columns})


def make_frame(runs: Runs, planned: Sequence[Job] = (), *, named: str = "") -> Frame:
    """Return the results of one or several runs, sorted by policy run, task, options and episode.

    Policies are in the order of the planned jobs; others follow by name.

    Args:
        runs: the results of a run have different identities. Runs that hold the same episodes of a
            policy stay apart; others complete each other.
        planned: jobs that should have a result; those without one are missing.
        named: name of a run that its policy runs bear in any case.
    """
    missing = {identity_key(job): job for job in planned}
    apart = _played_twice(runs) if len(runs) > 1 else set()
    rows: list[_Row] = []
    first_runs: dict[tuple[str, EvalConditions], PolicyRun] = {}
    for name, results in runs:
        for result in results:
            run = name if result.policy in apart else ""
            policy_run = PolicyRun.of(result, named or run)
            first_runs.setdefault((policy_run.policy, policy_run.conditions), policy_run)
            rows.append((policy_run, result, result.outcome))
            if missing:
                missing.pop(identity_key(result), None)
    for job in missing.values():
        conditions = EvalConditions.of(job)
        unplayed = PolicyRun(job.policy, conditions, Versions(), named)
        rows.append((first_runs.get((job.policy, conditions), unplayed), job, MISSING))
    return _sorted(rows, list(dict.fromkeys(job.policy for job in planned)))


def _sorted(rows: Sequence[_Row], policies: Sequence[str]) -> Frame:
    """Return rows as a frame.

    Episodes end in any order, but the bootstrap draws for one group after the other.
    """

    def place(one: PolicyRun) -> tuple[object, ...]:
        rank = policies.index(one.policy) if one.policy in policies else len(policies)
        versions = repr(one.versions)
        return (rank, one.policy, one.run, repr(one.conditions), versions, one.robot or "")

    columns = zip(*rows, strict=True) if rows else ((), (), ())
    policy_runs, jobs, outcomes = map(as_column, columns)
    runs, run_at = _distinct(policy_runs, place)
    options, options_at = _distinct([job.column for job in jobs], options_sort_key)
    tasks = task_order({job.task for job in jobs})
    task_at = [tasks.index(job.task) for job in jobs]
    episodes = [job.episode for job in jobs]
    seeds = [job.policy_seed for job in jobs]
    order = np.lexsort(np.array([seeds, episodes, options_at, task_at, run_at]))
    frame = Frame(
        {
            "place": order,
            "run": runs[run_at[order]],
            "result": jobs[order],
            "outcome": outcomes[order],
            "options": options[options_at[order]],
        }
    )
    # What a job knows stands in the rows of missing episodes, too.
    known = ("policy", "task", "split", "arm", "setting", "form", "episode", "policy_seed")
    return frame.extended(
        {name: as_column([getattr(one, name) for one in frame["result"]]) for name in known}
    )


def _distinct(values: Iterable[Any], key: Callable[[Any], Any]) -> tuple[Values, NDArray[np.int64]]:
    """Return the distinct values in the order of a key, and for each value its place there."""
    ordered = sorted(dict.fromkeys(values), key=key)
    places = {value: place for place, value in enumerate(ordered)}
    return as_column(ordered), np.array([places[value] for value in values], dtype=np.int64)


def task_order(names: Iterable[str]) -> list[str]:
    """Sort tasks in the order of the benchmark; unknown tasks come last."""
    known = list(all_tasks())
    return sorted(
        names, key=lambda name: (known.index(name) if name in known else len(known), name)
    )


def _played_twice(runs: Runs) -> set[str]:
    """Return the policies of which several runs hold the same episode."""
    seen: set[RecordKey] = set()
    twice: set[str] = set()
    for _, results in runs:
        own = {identity_key(result): result.policy for result in results}
        twice |= {policy for key, policy in own.items() if key in seen}
        seen |= own.keys()
    return twice
