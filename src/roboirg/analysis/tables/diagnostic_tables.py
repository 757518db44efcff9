"""Tables that the paper has no numbers for: forms, failures, cut prompts, kinds of words."""

from __future__ import annotations

import functools
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, cast

from roboirg.analysis.measures.breakdowns import Breakdown, LabelKey, break_down
from roboirg.analysis.measures.comparison_text import incomplete_notes
from roboirg.analysis.measures.failure_rates import (
    EndRates,
    ShareBounds,
    grounding_share,
    measure_ends,
)
from roboirg.analysis.measures.heard_rates import (
    HeardCounts,
    count_heard,
    cut_text,
)
from roboirg.analysis.measures.measure import (
    ALL_TASKS,
    Measured,
    ScopeKey,
    ScopeSummary,
    by_scope,
    with_holm,
)
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.results.frame import Frame, suite
from roboirg.analysis.results.option_labels import (
    REFERENCE_OPTIONS,
    SortKey,
    has_default_options,
    options_sort_key,
    setting_sort_key,
)
from roboirg.analysis.results.run_cells import cells_of
from roboirg.analysis.tables.arm_table import make_arm_table
from roboirg.analysis.tables.facts_table import make_facts_table
from roboirg.analysis.tables.rewriter_table import make_rewriter_table
from roboirg.analysis.tables.subgoal_table import make_subgoal_table
from roboirg.analysis.tables.table import (
    PARTIAL_MARK,
    POLICY,
    Column,
    Entry,
    Row,
    Table,
    named_columns,
)
from roboirg.analysis.tables.table_notes import PARTIAL_NOTE
from roboirg.core import failures
from roboirg.core.errors import InvalidValueError
from roboirg.language.settings import settings_of
from roboirg.stats.cells import NOTHING, Key, rows_of
from roboirg.stats.paired_tests import Gap
from roboirg.stats.rates import (
    NOT_APPLICABLE,
    gap_words,
    percent,
    percent_range,
)
from roboirg.tasks import all_tasks
from roboirg.util.discovery import with_entries

UNATTRIBUTED = "not attributed"
FAILURE_KINDS: Mapping[str, str] = {
    **{name: failure.kind for name, failure in failures.FAILURES.items()},
    UNATTRIBUTED: "",
}
"""The names of failures in the order of the core's table, each with its kind, such as grounding.

A failure that was not attributed has no kind.
"""
OF_CELLS = ("policy and setting", "task")
"""Headings of tables with a row for each task in each setting of a policy."""
RowCells = Sequence[Entry | str]
"""The cells of a row, as entries or as texts."""

_A_TASK = 2
"""Scopes of a group with a single task: that, and all tasks."""

_WITH_VERDICT = ("success", "failure")
"""Outcomes of episodes that a rate counts; an error, for example, is none."""

_FORMS_NOTE = (
    "The same episodes in the implicit form and in the resolved one, which names the goal: trials "
    "solved in both, in one alone, in neither. The difference, the mean over tasks, and its "
    "interval are in points; p-values are after Holm's correction over all rows of the policy."
)
_KINDS_NOTE = " ".join(
    f"{kind.capitalize()}: {means}." for kind, means in failures.FAILURE_KINDS.items()
)
_RATES_NOTE = (
    "Rates of all episodes with a verdict in percent, means over the tasks: success and the three "
    "kinds of failure add up to 100. Next to explicit on the same episodes, success changes by the "
    "gap, in points, and the kinds of failure by what makes up for it: for example "
    "grounding +6.9 and execution +1.8 make a gap of −8.7. Brackets have 95 % intervals. A "
    "failure that was not attributed is undecided."
)
_SHARES_NOTE = (
    "Grounding of failures: its share in percent, first as if all that is undecided were "
    "execution, then as if it were grounding. Such a share conditions on failing; compare it with "
    "the same in explicit words, on the same tasks."
)
_BREAKDOWN_NOTE = (
    "Success in percent, the gap to explicit on the same episodes in points, its interval, and "
    "its p-value after Holm's correction over all rows of the policy. Rates are means over the "
    "tasks that have such instructions, so two rows may differ in their tasks, too."
)
_HEARD_NOTE = (
    "Cut: the policy's model reads fewer tokens than the prompt needs, so the end of the prompt, "
    "where the command stands, does not arrive; between two bounds if the tokenizer is not "
    "known. Prompts: of all trials that were played, errors too. Heard: trials with a verdict "
    "whose prompt was read whole. Success in percent over all trials with a verdict, and over "
    "those heard. Of all tasks, shares and rates are means over the tasks that have such trials. "
    "Policies that declare no limit (prompt_tokens) are not in this table."
)


def make_forms_table(data: RunData) -> Table:
    """Make the table that compares implicit instructions with the same in resolved words.

    The resolved form names what the implicit one only refers to. There is a row for each policy
    run, suite of tasks and setting; those over all tasks come last, if there are several suites.

    Raises:
        InvalidValueError: no episode was played in both forms.
    """
    averages = _implicit_averages(data)
    rows = []
    for average in averages:
        group = f"{data.frame.names[average.key.policy_run]}, {average.key.scope}"
        if _is_partial(average):
            group += f" {PARTIAL_MARK}"
        rows.append(Row(group, average.key.options.setting, _form_cells(average)))
    if not rows:
        raise InvalidValueError(
            "The runs have no episode in both forms; play them with --forms implicit,resolved."
        )
    notes = [_FORMS_NOTE]
    if any(map(_is_partial, averages)):
        notes.append(PARTIAL_NOTE)
    return Table(
        key="forms",
        title="Implicit and resolved form",
        heads=(POLICY, "setting"),
        columns=named_columns(
            "trials", "both", "only resolved", "only implicit", "neither", "implicit − resolved",
            "95 % interval", "p",
        ),
        rows=rows,
        notes=notes,
    )  # fmt: skip


def _form_cells(average: ScopeSummary) -> RowCells:
    """Return the cells of a row of the table of forms: numbers of trials, and the gap.

    Trials are compared in pairs: the implicit form is the first, the resolved one the second.
    """
    gap = cast("Gap", average.gap)
    both, only_implicit, only_resolved, neither = gap.overlap
    counts = (gap.overlap.trials, both, only_resolved, only_implicit, neither)
    return (*map(str, counts), *gap_words(gap, average.p_holm))


def _is_partial(average: ScopeSummary) -> bool:
    """Return whether an average lacks a task that has the setting, or trials of a task."""
    key = average.key
    tasks = 0
    for task in all_tasks().values():
        if key.scope in (task.suite, ALL_TASKS) and key.options.setting in settings_of(task):
            tasks += 1
    compared = cast("Gap", average.gap).tasks
    return compared < tasks or not average.counts.is_complete


def _implicit_averages(data: RunData) -> Sequence[ScopeSummary]:
    """Return success in implicit instructions, with its gap to their resolved form.

    The resolved form names what the implicit one only refers to. All are averages over a suite or
    over all tasks, sorted by policy run, suite and setting. Those of which no episode was played in
    both forms are left out.
    """
    suites = {suite(key.task) for key in data.cells} - {None}  # of tasks that are in no suite
    averages = []
    for key, summary in data.summaries.items():
        is_task = key.scope in summary.cells
        is_repeated = key.scope == ALL_TASKS and len(suites) <= 1  # it would only repeat the suite
        is_shown = has_default_options(key.options) and not is_task and not is_repeated
        if is_shown and summary.second_gap is not None:
            # The first gap is to explicit, the second one to the resolved form.
            averages.append(replace(summary, gap=summary.second_gap))

    in_order = _in_row_order(averages, data)
    return with_holm(in_order, lambda key: key.policy_run)


def _in_row_order(averages: Iterable[ScopeSummary], data: RunData) -> list[ScopeSummary]:
    """Sort averages by policy run, suite and setting, each in its usual order."""
    runs = list(data.frame.names)
    scopes = list(dict.fromkeys(key.scope for key in data.summaries))

    def place(average: ScopeSummary) -> SortKey:
        key = average.key
        setting = setting_sort_key(key.options.setting)
        return runs.index(key.policy_run), scopes.index(key.scope), setting

    return sorted(averages, key=place)


def count_failures(frame: Frame, by: Sequence[str]) -> Mapping[Key, Counter[str]]:
    """Count trials with a verdict, and failures by name, for each combination of some columns.

    By ``("run", "task")``, for example, the counts of a policy run's 10 trials of a task are
    ``{"trials": 10, "wrong_object": 3}`` if 7 succeeded and 3 took hold of the wrong object.
    """
    counts_by_key: defaultdict[Key, Counter[str]] = defaultdict(Counter)
    for *values, outcome, failure in rows_of(frame, *by, "outcome", "failure"):
        if outcome not in _WITH_VERDICT:
            continue
        counts = counts_by_key[tuple(values)]
        counts["trials"] += 1
        if outcome == "failure":
            name = failure if failure in FAILURE_KINDS else UNATTRIBUTED
            counts[name] += 1
    return counts_by_key


def occurring_failures(counts: Iterable[Counter[str]]) -> list[str]:
    """Return names of failures that occur in some counts, in the order of `FAILURE_KINDS`."""
    total: Counter[str] = Counter()
    for counts_of_key in counts:
        total += counts_of_key
    return [name for name in FAILURE_KINDS if name in total]


def make_failure_table(data: RunData, *, means: bool = False) -> Table:
    """Make the table of the rates of success and of each kind of failure, by task and setting.

    Next to these are their changes from explicit instructions, which name the goal.

    Args:
        data: of the runs.
        means: whether to have only the means over all tasks, and no rows of single tasks.

    Raises:
        InvalidValueError: no episode failed.
    """
    scopes = {ALL_TASKS}
    if not means:
        scopes.update(data.frame["task"])
    ends = measure_ends(data, scopes)  # of each row
    if all(rates.success.rate == 1 for rates in ends.values()):
        raise InvalidValueError("No episode of the runs failed.")
    changes = [f"{kind}, change" for kind in failures.FAILURE_KINDS]
    return Table(
        key="failures",
        title="How episodes ended, and what the gap to explicit consists of",
        heads=OF_CELLS,
        columns=named_columns(
            "trials",
            "failures",
            "success",
            *failures.FAILURE_KINDS,
            "gap to explicit",
            *changes,
            "grounding of failures",
            "the same in explicit",
        ),
        rows=_rows({key: _end_cells(rates) for key, rates in ends.items()}, data.frame),
        notes=(_RATES_NOTE, f"{_KINDS_NOTE} {_SHARES_NOTE}"),
    )


def _end_cells(rates: EndRates) -> RowCells:
    """Return the cells of a row of the table of failures.

    They are the numbers of trials and failures, the rates of success and of each kind of failure,
    their gaps to explicit, and the share of grounding among the failures, here and in explicit.

    Args:
        rates: success, and the failures of grounding, of execution, and undecided ones.
    """
    success, *kinds = rates
    own_results = []
    explicit_results = []  # of the same tasks
    for kind in kinds:
        own_results.append(kind.cells)
        explicit = kind.others
        explicit_results.append(
            {task: explicit[task] for task in success.tasks if task in explicit}
        )
    counts = success.counts
    return (
        str(counts.trials),
        str(counts.trials - counts.successes),
        *map(_rate, rates),
        *map(_change_text, rates),
        _share_text(grounding_share(*own_results)),
        _share_text(grounding_share(*explicit_results)),
    )


def _change_text(rate: ScopeSummary) -> str:
    """Return the gap to explicit with its interval in brackets, such as ``+3.1 (+1.0 to +5.2)``."""
    gap, interval, _ = gap_words(rate.gap, None)
    if interval == NOT_APPLICABLE:
        return gap
    return f"{gap} ({interval})"


def _share_text(share: ShareBounds | None) -> str:
    """Return a share in percent: one number, or the two between which it is."""
    if share is None:
        return NOT_APPLICABLE
    return percent_range(share.least, share.most)


def make_failure_name_table(data: RunData) -> Table:
    """Make the table of how often episodes failed in which way, such as by the wrong object.

    It has a row for each task in each setting of a policy, and a column for each failure.

    Raises:
        InvalidValueError: no episode failed.
    """
    counts_by_scope = _failures_by_scope(data)
    names = occurring_failures(counts_by_scope.values())
    if not names:
        raise InvalidValueError("No episode of the runs failed.")

    cells = {}
    for key, counts in counts_by_scope.items():
        failed = [counts[name] for name in names]
        numbers = (counts["trials"], sum(failed), *failed)
        cells[key] = list(map(str, numbers))
    columns = list(named_columns("trials", "failures"))
    for name in names:
        columns.append(Column(name.replace("_", " "), FAILURE_KINDS[name]))
    return Table(
        key="failure_names",
        title="Failures by name",
        heads=OF_CELLS,
        columns=columns,
        rows=_rows(cells, data.frame),
        notes=(f"Failed episodes, and how many of them failed in each way. {_KINDS_NOTE}",),
    )


def _failures_by_scope(data: RunData) -> dict[ScopeKey, Counter[str]]:
    """Count failures by name, for each policy run and options: in each task and in all tasks."""
    # Each episode counts twice: for its task, and for all tasks.
    frame = data.frame.spread("scope", [(task, ALL_TASKS) for task in data.frame["task"]])
    counts = count_failures(frame, ("run", "scope", "options"))
    return {ScopeKey(*values): in_scope for values, in_scope in counts.items()}


def make_heard_table(data: RunData) -> Table:
    """Make the table of prompts that were longer than the policy's model reads.

    Its end, with the command, is then cut off. Success is given over all episodes and over those
    that were heard, that is, whose prompt was read whole.

    Raises:
        InvalidValueError: no policy declares how many tokens it reads.
    """
    counts_by_scope = _prompts_by_scope(data.frame)
    if not counts_by_scope:
        raise InvalidValueError(
            "No policy of the runs declares how many tokens it reads; prompt_tokens=N does."
        )
    played = by_scope(data.cells)
    heard = by_scope(cells_of(data.frame.where(prompt="heard")))
    cells = {}
    for key, counts_of_tasks in counts_by_scope.items():
        of_all = Measured(key, played[key])
        of_heard = Measured(key, heard.get(key, NOTHING))
        cells[key] = _heard_cells(counts_of_tasks, of_all, of_heard)
    return Table(
        key="heard",
        title="Instructions that the policies' models read to the end",
        heads=OF_CELLS,
        columns=named_columns("prompts", "cut, %", "success, all", "heard", "success, heard"),
        rows=_rows(cells, data.frame),
        notes=(_HEARD_NOTE,),
    )


def _prompts_by_scope(frame: Frame) -> dict[ScopeKey, list[HeardCounts]]:
    """Return the numbers of prompts of each task in a scope: a single task, or all tasks."""
    counts_by_scope: defaultdict[ScopeKey, list[HeardCounts]] = defaultdict(list)
    for (run, options, task), counts in count_heard(frame, ("options", "task")).items():
        for scope in (task, ALL_TASKS):
            counts_by_scope[ScopeKey(run, scope, options)].append(counts)
    return counts_by_scope


def _heard_cells(
    counts_of_tasks: Sequence[HeardCounts], of_all: ScopeSummary, of_heard: ScopeSummary
) -> RowCells:
    """Return the cells of a row of the table of cut prompts.

    They are the number of prompts, the share of cut ones, success over all trials, the number of
    trials whose prompt was read whole (heard), and success over these.

    Args:
        counts_of_tasks: numbers of episodes and of cut prompts of each task.
        of_all: success over all episodes.
        of_heard: success over those with a whole prompt.
    """
    episodes = sum(counts["episodes"] for counts in counts_of_tasks)
    return (
        str(episodes),
        cut_text(counts_of_tasks),
        _rate(of_all),
        str(of_heard.counts.trials),
        _rate(of_heard),
    )


def _rows(cells: Mapping[ScopeKey, RowCells], frame: Frame) -> list[Row]:
    """Return the rows of a table: for each policy run and options, its tasks and then all tasks.

    The row of all tasks is left out if there is only one task, which it would repeat.

    Args:
        cells: of each row.
        frame: with the labels of the policy runs, in order.
    """
    runs = list(frame.names)

    def row_order(key: ScopeKey) -> SortKey:
        return runs.index(key.policy_run), options_sort_key(key.options), key.scope == ALL_TASKS

    scopes = Counter((key.policy_run, key.options) for key in cells)  # how many each group has
    rows = []
    for key in sorted(cells, key=row_order):
        is_repetition = key.scope == ALL_TASKS and scopes[key.policy_run, key.options] == _A_TASK
        if not is_repetition:
            label = frame.group_label(key.policy_run, key.options)
            rows.append(Row(label, key.scope, cells[key]))
    return rows


def make_breakdown_table(breakdown: Breakdown, frame: Frame) -> Table:
    """Make the table of success by kinds of instructions, for example by difficulty.

    Each kind has its gap to explicit instructions, which name the goal, on the same episodes.

    Args:
        breakdown: the column of the frame with the kinds, and its headings.
        frame: the results.
    """
    found = break_down(frame, breakdown)
    rows = []
    for measured in found:
        key = measured.key
        gap = gap_words(measured.gap, measured.p_holm)
        cells = (str(measured.counts.episodes), _rate(measured), *gap)
        rows.append(Row(frame.group_label(key.run, key.options), key.label, cells))
    return Table(
        key=f"by_{breakdown.name}",
        title=f"Gap to explicit by {breakdown.title}",
        heads=(OF_CELLS[0], breakdown.title),
        columns=named_columns("episodes", "success", "gap", "95 % interval", "p"),
        rows=rows,
        notes=[f"{_BREAKDOWN_NOTE} {breakdown.note}", *_gap_notes(found, frame)],
    )


def _gap_notes(found: Iterable[Measured[LabelKey]], frame: Frame) -> Iterator[str]:
    """Yield sentences on what a breakdown lacks: gaps of some rows, or verdicts of trials."""
    if any(row.gap is None and row.key.options != REFERENCE_OPTIONS for row in found):
        yield f"{NOT_APPLICABLE} without explicit on the same episodes."
    outcomes = Counter(frame["outcome"])
    yield from incomplete_notes(outcomes["error"] + outcomes["missing"], outcomes["spared"])


def _rate(measured: Measured[Any]) -> Entry:
    """Return a success rate with its interval, or a dash if no episode has a verdict."""
    if measured.rate is None:
        return Entry(word=NOT_APPLICABLE)
    return Entry(percent=percent(measured.rate), counts=measured.counts, interval=measured.interval)


class RunTable(NamedTuple):
    """A table of runs alone, without values of the paper.

    Attributes:
        name: as in the command line.
        make: returns the table of the runs' data.
        about: what the help has behind the name, such as `` (of planners)``.
    """

    name: str
    make: Callable[[RunData], Table]
    about: str = ""


_OURS = (
    RunTable("forms", make_forms_table),
    RunTable(
        "failures",
        make_failure_table,
        " (of all episodes, and in the gap to explicit)",
    ),
    RunTable("failure-names", make_failure_name_table),
    RunTable("heard", make_heard_table, " (how many prompts were cut)"),
    RunTable("arms", make_arm_table, " (what control arms show)"),
    RunTable("subgoals", make_subgoal_table, " (of planners, and what models cost)"),
    RunTable("rewriters", make_rewriter_table, " (the share of the gap that each closes)"),
    RunTable("facts", make_facts_table, " (what a methods section needs)"),
)


@functools.cache
def diagnostic_tables() -> Mapping[str, RunTable]:
    """Return ours and those of installed packages, by name."""
    return with_entries(_OURS, "TABLE", RunTable, "roboirg.tables")


def described_tables() -> list[str]:
    """Return the names with what the tables show, for the help."""
    return [table.name + table.about for table in diagnostic_tables().values()]
