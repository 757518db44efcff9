"""Tables that the paper has no numbers for: forms, failures, cut prompts, kinds of words."""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from roboirg.core import failures
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.results.frame import Frame, suite
from roboirg.evaluation.analysis.results.option_labels import (
    has_default_options,
    options_label,
    options_sort_key,
    reference_of,
    setting_sort_key,
)
from roboirg.evaluation.analysis.stats.breakdowns import Breakdown, break_down
from roboirg.evaluation.analysis.stats.cells import NOTHING, Key, cells_of, rows_of
from roboirg.evaluation.analysis.stats.comparison_text import incomplete_note
from roboirg.evaluation.analysis.stats.failure_rates import (
    Ends,
    grounding_share,
    measure_ends,
)
from roboirg.evaluation.analysis.stats.heard_rates import (
    HeardCounts,
    count_heard,
    cut_text,
)
from roboirg.evaluation.analysis.stats.measure import (
    ALL_TASKS,
    Measured,
    ScopeKey,
    ScopeSummary,
    by_scope,
    with_holm,
)
from roboirg.evaluation.analysis.stats.rates import (
    NOT_APPLICABLE,
    gap_words,
    percent,
    percent_range,
)
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.arm_table import make_arm_table
from roboirg.evaluation.analysis.tables.facts_table import make_facts_table
from roboirg.evaluation.analysis.tables.subgoal_table import make_subgoal_table
from roboirg.evaluation.analysis.tables.table import (
    POLICY,
    Column,
    Entry,
    Row,
    Table,
    named_columns,
)
from roboirg.evaluation.records.record import Record

UNATTRIBUTED = "not attributed"
FAILURES: Mapping[str, str] = {
    **{name: one.kind for name, one in failures.FAILURES.items()},
    UNATTRIBUTED: "",
}
"""The names of failures with their kinds, in the order of the core's table."""
OF_CELLS = ("policy and setting", "task")
RowCells = Sequence[Entry | str]

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
    "known. Success in percent over all episodes with a verdict, and over those that were heard "
    "whole. Of all tasks, shares and rates are means over the tasks that have such episodes. "
    "Policies that declare no limit (prompt_tokens) are not in this table."
)


def make_forms_table(data: RunData) -> Table:
    """Make the table of implicit against resolved forms, by policy run, suite and setting.

    Of a policy run, the rows over all tasks come last, if there are several suites.

    Raises:
        InvalidValueError: no episode was played in both forms.
    """
    several = len({suite(key.task) for key in data.cells} - {None}) > 1
    found = [
        replace(one, gap=one.second_gap)
        for key, one in data.summaries.items()
        if has_default_options(key.options)
        and key.scope not in one.cells
        and (several or key.scope != ALL_TASKS)
    ]
    runs = list(data.frame.names)
    scopes = [one.key.scope for one in found]
    found.sort(
        key=lambda one: (
            runs.index(one.key.policy_run), scopes.index(one.key.scope),
            setting_sort_key(one.key.options.setting),
        )
    )  # fmt: skip
    rows = []
    for one in with_holm(found, lambda key: key.policy_run):
        if (gap := one.gap) is not None:
            of = gap.overlap
            counts = (of.trials, of.both, of.only_second, of.only_first, of.neither)
            words = (*map(str, counts), *gap_words(gap, one.p_holm))
            group = f"{data.frame.names[one.key.policy_run]}, {one.key.scope}"
            rows.append(Row(group, one.key.options.setting, words))
    if not rows:
        raise InvalidValueError(
            "The runs have no episode in both forms; play them with --forms implicit,resolved."
        )
    return Table(
        key="forms",
        title="Implicit and resolved form",
        heads=(POLICY, "setting"),
        columns=named_columns(
            "trials", "both", "only resolved", "only implicit", "neither", "implicit − resolved",
            "95 % interval", "p",
        ),
        rows=rows,
        notes=(_FORMS_NOTE,),
    )  # fmt: skip


def count_failures(frame: Frame, by: Sequence[str]) -> Mapping[Key, Counter[str]]:
    """Return, by some columns, the number of ``trials`` with a verdict and of failures by name."""
    found: defaultdict[Key, Counter[str]] = defaultdict(Counter)
    for *key, outcome, failure in rows_of(frame, *by, "outcome", "failure"):
        if outcome in ("success", "failure"):
            counts = found[tuple(key)]
            counts["trials"] += 1
            if outcome == "failure":
                counts[failure if failure in FAILURES else UNATTRIBUTED] += 1
    return found


def make_failure_table(data: RunData, *, means: bool = False) -> Table:
    """Make the table of how all episodes ended, and of what the gap to explicit consists.

    Args:
        data: of the runs.
        means: whether to leave out single tasks.

    Raises:
        InvalidValueError: no episode failed.
    """
    scopes = {ALL_TASKS} if means else {ALL_TASKS, *data.frame["task"]}
    found = measure_ends(data, scopes)
    if all(success.rate == 1 for success, *_ in found.values()):
        raise InvalidValueError("No episode of the runs failed.")
    return Table(
        key="failures",
        title="How episodes ended, and what the gap to explicit consists of",
        heads=OF_CELLS,
        columns=named_columns(
            "trials", "failures", "success", *failures.FAILURE_KINDS, "gap to explicit",
            *(f"{kind}, change" for kind in failures.FAILURE_KINDS), "grounding of failures",
            "the same in explicit",
        ),
        rows=_rows(found, data, lambda key: _ends(*found[key])),
        notes=(_RATES_NOTE, f"{_KINDS_NOTE} {_SHARES_NOTE}"),
    )  # fmt: skip


def _ends(success: ScopeSummary, *kinds: ScopeSummary) -> RowCells:
    counts = success.counts
    ends = (success, *kinds)
    gaps = (gap_words(one.gap, None) for one in ends)
    explicit = [
        {task: one.others[task] for task in success.tasks if task in one.others} for one in kinds
    ]
    return (
        str(counts.trials),
        str(counts.trials - counts.successes),
        *map(_rate, ends),
        *(gap if ends == NOT_APPLICABLE else f"{gap} ({ends})" for gap, ends, _ in gaps),
        _share_text(grounding_share([one.cells for one in kinds])),
        _share_text(grounding_share(explicit)),
    )


def _share_text(ends: Ends | None) -> str:
    return NOT_APPLICABLE if ends is None else percent_range(*ends)


def make_failure_name_table(data: RunData) -> Table:
    """Make the table of the numbers of failures by name, task and setting.

    Raises:
        InvalidValueError: no episode failed.
    """
    # Each row counts twice: for its task, and for all tasks.
    frame = data.frame.spread("scope", [(task, ALL_TASKS) for task in data.frame["task"]])
    counts = count_failures(frame, ("run", "scope", "options"))
    found = {ScopeKey(*key): own for key, own in counts.items()}
    names = [name for name in FAILURES if any(own[name] for own in found.values())]
    if not names:
        raise InvalidValueError("No episode of the runs failed.")

    def words(key: ScopeKey) -> list[str]:
        failed = [found[key][name] for name in names]
        return list(map(str, (found[key]["trials"], sum(failed), *failed)))

    return Table(
        key="failure_names",
        title="Failures by name",
        heads=OF_CELLS,
        columns=(
            *named_columns("trials", "failures"),
            *(Column(name.replace("_", " "), FAILURES[name]) for name in names),
        ),
        rows=_rows(found, data, words),
        notes=(f"Failed episodes, and how many of them failed in each way. {_KINDS_NOTE}",),
    )


def make_heard_table(data: RunData) -> Table:
    """Make the table of cut prompts and of success over the episodes that were heard whole.

    Raises:
        InvalidValueError: no policy declares how many tokens it reads.
    """
    counts = count_heard(data.frame, ("options", "task"))
    if not counts:
        raise InvalidValueError(
            "No policy of the runs declares how many tokens it reads; prompt_tokens=N does."
        )
    scopes: defaultdict[ScopeKey, list[HeardCounts]] = defaultdict(list)
    for (run, options, task), own in counts.items():
        for scope in (task, ALL_TASKS):
            scopes[ScopeKey(run, scope, options)].append(own)
    played = by_scope(data.cells)
    heard = by_scope(cells_of(data.frame.where(prompt="heard")))

    def cells(key: ScopeKey) -> RowCells:
        whole = Measured(key, played[key])
        read = Measured(key, heard.get(key, NOTHING))
        episodes = sum(own["episodes"] for own in scopes[key])
        cut = cut_text(scopes[key])
        return (str(episodes), cut, _rate(whole), str(read.counts.trials), _rate(read))

    return Table(
        key="heard",
        title="Instructions that the policies' models read to the end",
        heads=OF_CELLS,
        columns=named_columns("episodes", "cut, %", "success, all", "heard", "success, heard"),
        rows=_rows(scopes, data, cells),
        notes=(_HEARD_NOTE,),
    )


def _rows(
    found: Iterable[ScopeKey], data: RunData, cells: Callable[[ScopeKey], RowCells]
) -> list[Row]:
    """Return rows by policy run, options and scope, those of all tasks last.

    These are left out if there is only one task.
    """
    names = data.frame.names
    runs = list(names)
    keys = sorted(
        found,
        key=lambda key: (
            runs.index(key.policy_run), options_sort_key(key.options), key.scope == ALL_TASKS,
        ),
    )  # fmt: skip
    rows = []
    for (run, options), own in itertools.groupby(keys, lambda key: (key.policy_run, key.options)):
        scopes = list(own)
        shown = scopes if len(scopes) > 2 else scopes[:1]  # noqa: PLR2004 - a task and all
        group = f"{names[run]}, {options_label(options)}"
        rows += [Row(group, key.scope, cells(key)) for key in shown]
    return rows


def make_breakdown_table(breakdown: Breakdown, frame: Frame) -> Table:
    """Make the table of gaps to explicit, broken down by a column that the frame has."""
    found = break_down(frame, breakdown)
    left_out = sum(one not in ("success", "failure") for one in frame["outcome"])
    notes = [f"{_BREAKDOWN_NOTE} {breakdown.note}"]
    if any(one.gap is None and one.key.options != reference_of(one.key.options) for one in found):
        notes.append(f"{NOT_APPLICABLE} without explicit on the same episodes.")
    if left_out:
        notes.append(incomplete_note(left_out))
    return Table(
        key=f"by_{breakdown.name}",
        title=f"Gap to explicit by {breakdown.title}",
        heads=(OF_CELLS[0], breakdown.title),
        columns=named_columns("episodes", "success", "gap", "95 % interval", "p"),
        rows=[
            Row(
                f"{frame.names[one.key.run]}, {options_label(one.key.options)}",
                one.key.label,
                (str(one.counts.episodes), _rate(one), *gap_words(one.gap, one.p_holm)),
            )
            for one in found
        ],
        notes=notes,
    )


def _rate(one: Measured[Any]) -> Entry:
    if one.rate is None:
        return Entry(word=NOT_APPLICABLE)
    return Entry(percent=percent(one.rate), counts=one.counts, interval=one.interval)


DIAGNOSTIC_TABLES: Mapping[str, Callable[[RunData, Iterable[Record]], Table]] = {
    "forms": lambda data, _records: make_forms_table(data),
    "failures": lambda data, _records: make_failure_table(data),
    "failure-names": lambda data, _records: make_failure_name_table(data),
    "heard": lambda data, _records: make_heard_table(data),
    "arms": lambda data, _records: make_arm_table(data),
    "subgoals": make_subgoal_table,
    "facts": make_facts_table,
}
"""By name, as in the command line; the last two read whole records, too."""
