"""The terminal's table of a run: tasks × settings, one for each policy run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from fractions import Fraction

from rich.console import Console
from rich.text import Text

from roboirg.core.arms import TOLD
from roboirg.core.plain_text import counted, printable
from roboirg.evaluation.analysis.comparability import (
    AllDifferences,
    comparison_notes,
    differences_of,
)
from roboirg.evaluation.analysis.results.frame import Frame
from roboirg.evaluation.analysis.results.option_labels import (
    options_label,
    options_sort_key,
    reference_of,
)
from roboirg.evaluation.analysis.stats.cells import NOTHING, ByTask, CellKey, cells_of
from roboirg.evaluation.analysis.stats.headline import headline_notes
from roboirg.evaluation.analysis.stats.heard_rates import heard_notes
from roboirg.evaluation.analysis.stats.measure import (
    ALL_TASKS,
    Measured,
    ScopeKey,
    ScopeSummary,
    Summaries,
    by_scope,
    pair,
)
from roboirg.evaluation.analysis.stats.paired_tests import paired_rates
from roboirg.evaluation.analysis.stats.rates import NOT_APPLICABLE, points, whole_percent
from roboirg.evaluation.analysis.tables.table import (
    ERROR_MARK,
    MISSING_MARK,
    Column,
    Entry,
    Row,
    Table,
)
from roboirg.evaluation.analysis.tables.table_notes import range_text, where_played
from roboirg.evaluation.records.record import Summary

MAX_FAILURES = 10
"""Episodes of a policy that are listed below the tables."""

_GOOD, _FAIR = Fraction(3, 4), Fraction(2, 5)


def make_run_tables(frame: Frame) -> list[Table]:
    """Make a table for each policy run, in their order.

    What the signs mean is the last note of the last table.
    """
    cells = cells_of(frame)
    scopes = by_scope(cells)
    found = {
        key: Measured(key, own)
        for key, own in scopes.items()
        if key.scope == ALL_TASKS or key.scope in own
    }
    gaps = {key: gap_text(key, scopes) for key in found}
    legend = "; ".join(_legend(found, set(gaps.values())))
    last = list(frame.names)[-1:]
    tables = []
    for policy_run, label in frame.names.items():
        names = {policy_run: label}
        # No other settings can be compared.
        differences = {
            key: differences_of(key, cell)
            for key, cell in cells.items()
            if key.policy_run == policy_run and key.options == reference_of(key.options)
        }
        own = {key: one for key, one in found.items() if key.policy_run == policy_run}
        notes = [
            f"{where_played([policy_run.conditions])} {_sizes(own)}",
            *comparison_notes(differences, names),
            *heard_notes(frame.where(run=policy_run), names),
            *headline_notes(cells, names),
        ]
        if policy_run in last:
            notes.append(legend)
        tables.append(_make_run_table(label, own, gaps, differences, notes))
    return tables


def print_failures(frame: Frame, console: Console) -> None:
    """List the episodes of each policy run without success and the cause; count the rest."""
    for run, label in frame.names.items():
        failures = [one for one in frame.where(run=run).played if one.outcome != "success"]
        # The same order for any number of worker processes.
        failures.sort(
            key=lambda one: (one.task, one.split, one.episode, options_sort_key(one.options))
        )
        if failures:
            title = f"{counted(len(failures), 'episode')} without success"
            console.print(Text.assemble((label, "bold"), f": {title}"), soft_wrap=True)
        for record in failures[:MAX_FAILURES]:
            console.print(Text(f"  {failure_text(record)}"), highlight=False, soft_wrap=True)
        if len(failures) > MAX_FAILURES:
            console.print(f"  and {len(failures) - MAX_FAILURES} more", highlight=False)


def failure_text(record: Summary) -> str:
    """Return the episode, its instruction options and the cause of its failure."""
    mark = f" {ERROR_MARK}" if record.outcome == "error" else ""
    where = f"{record.task} {record.split}/{record.episode} {options_label(record.options)}"
    seed = f" (policy seed {record.policy_seed})" if record.policy_seed else ""
    arm = "" if record.arm == TOLD else f" ({record.arm})"
    return f"{where}{seed}{arm}: {printable(record.cause or record.outcome)}{mark}"


def gap_text(key: ScopeKey, scopes: Mapping[ScopeKey, ByTask]) -> str:
    """Return the gap to explicit on the same episodes, the mean over tasks.

    A dash if neither has a success, which says nothing; empty without pairs.
    """
    reference = key._replace(options=reference_of(key.options))
    if key == reference:
        return ""
    rates = paired_rates(pair(scopes[key], scopes.get(reference, NOTHING)))
    if rates is None:
        return ""
    if not any(rates):
        return NOT_APPLICABLE
    return points(rates.first - rates.second)


def _make_run_table(
    label: str,
    found: Summaries,
    gaps: Mapping[ScopeKey, str],
    differences: AllDifferences,
    notes: Sequence[str],
) -> Table:
    """Return tasks × settings: the success rate and, in brackets, the gap to explicit."""
    policy_run = next(iter(found)).policy_run
    scopes = dict.fromkeys(key.scope for key in found)
    options = sorted({key.options for key in found}, key=options_sort_key)
    rows = []
    for scope in scopes if len(scopes) > 2 else list(scopes)[:1]:  # noqa: PLR2004 - a task and all
        keys = [ScopeKey(policy_run, scope, one) for one in options]
        entries = [_entry(found.get(key), gaps.get(key, ""), differences) for key in keys]
        rows.append(Row(ALL_TASKS if scope == ALL_TASKS else "", scope, entries))
    return Table(
        key="run",
        title=label,
        heads=("task",),
        columns=[Column(options_label(one), one.setting) for one in options],
        rows=rows,
        notes=notes,
    )


def _entry(one: ScopeSummary | None, gap: str, differences: AllDifferences) -> Entry:
    if one is None:
        return Entry(applies=False)
    counts = one.counts
    shown = ((counts.errors, ERROR_MARK), (counts.missing, MISSING_MARK))
    marks = " ".join(f"{count}{mark}" for count, mark in shown if count)
    rate = one.rate
    if rate is None:
        return Entry(word=NOT_APPLICABLE, marks=marks)
    return Entry(
        word=whole_percent(rate) + (f" ({gap})" if gap else ""),
        marks=marks,
        differences=differences.get(CellKey(*one.key)),
        style="green" if rate >= _GOOD else "yellow" if rate >= _FAIR else "red",
    )


def _legend(found: Summaries, gaps: Set[str]) -> Iterator[str]:
    """Yield what the signs mean that occur."""
    compared = ", in brackets the gap to explicit on the same episodes in points"
    yield f"success rate in %{compared if any(gaps) else ''}"
    if NOT_APPLICABLE in gaps:
        yield f"({NOT_APPLICABLE}) explicit has no success either, so the gap says nothing"
    if any(one.counts.errors for one in found.values()):
        yield f"{ERROR_MARK} episodes ended in an error and are left out of the rates"
    if any(one.counts.missing for one in found.values()):
        yield f"{MISSING_MARK} episodes are still to be played"
    if any(key.policy_run.is_privileged for key in found):
        yield "privileged policies and scripted hands use the simulator's state"


def _sizes(found: Summaries) -> str:
    single = [one.counts.trials for key, one in found.items() if key.scope != ALL_TASKS]
    text = f"n = {range_text(single, 'episode')} per cell"
    if len({key.scope for key in found}) > 2:  # noqa: PLR2004 - a task and all of them
        every = [one.counts.trials for key, one in found.items() if key.scope == ALL_TASKS]
        text += f", {range_text(every, 'episode')} for {ALL_TASKS}, the mean over tasks"
    return text
