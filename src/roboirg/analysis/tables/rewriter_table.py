"""Table of rewriters: the share of the gap to explicit that each closes for its policy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.results.frame import Frame
from roboirg.analysis.results.option_labels import REFERENCE_OPTIONS, options_sort_key
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.analysis.tables.table import Row, Table, named_columns
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions, options_label
from roboirg.core.policy_ref import BEHIND, RESOLVE
from roboirg.core.versions import POLICY, makeup_text
from roboirg.stats.cells import ByTask, Cell, Key, gather
from roboirg.stats.intervals import Rows, TaskRates, mean_rates, share_interval
from roboirg.stats.rates import NOT_APPLICABLE, whole_percent

NO_SHARE = "no clear gap"
"""Printed in place of a share where the gap's interval has 0."""
_NOTE = (
    "Rates in percent, means over tasks, on the episodes that all three have: the policy alone "
    "with what was said, behind the rewriter, and alone with explicit words. Share: how much of "
    "the way from the first to the third the rewriter goes; below 0 it harms. "
    f"There is none ({NO_SHARE}) where the interval of the gap does not lie above 0."
)


class _Rewritten(NamedTuple):
    """A policy run behind a rewriter, and that of the same policy alone."""

    behind: PolicyRun
    alone: PolicyRun


def make_rewriter_table(data: RunData) -> Table:
    """Make the table of rewriters, with a row for each setting that both policies played.

    Raises:
        InvalidValueError: no policy was played both alone and behind a rewriter.
    """
    rows = list(_rows(data.without_control_arms.frame))
    if not rows:
        raise InvalidValueError(
            "No policy was played alone and behind a rewriter, in the same settings and in "
            f"explicit words; play SPEC and {RESOLVE}:NAMER?policy=SPEC in one run."
        )
    return Table(
        key="rewriters",
        title="Share of the gap that rewriters close",
        heads=("setting", "policy"),
        columns=named_columns(
            "episodes", "as said, %", "rewritten, %", "explicit, %", "share, %", "95 % interval"
        ),
        rows=rows,
        notes=(_NOTE,),
    )


def _rows(frame: Frame) -> Iterator[Row]:
    """Yield a row for each rewriter, policy and setting that is not explicit.

    A rewriter is a model that states an instruction in explicit words before the policy gets it.
    The policy must have been played alone and behind the rewriter in the setting, and alone in the
    explicit one: with *direct* and *explicit* alone and *direct* behind it, there is one row,
    *direct*.
    """
    cells_of = gather(frame, ("run", "options"))
    for behind, alone in _pairs(list(frame.names)):
        explicit = cells_of.get((alone, REFERENCE_OPTIONS))
        if explicit is None:
            continue
        for options in _shared_options(cells_of, behind, alone):
            if options == REFERENCE_OPTIONS:
                continue
            rewritten = cells_of[behind, options]
            said = cells_of[alone, options]
            rates = _rates_of_tasks([rewritten, said, explicit])  # `_words` needs this order
            yield Row(options_label(options), frame.names[behind], _words(rates))


def _pairs(policy_runs: Sequence[PolicyRun]) -> Iterator[_Rewritten]:
    """Yield each policy run behind a rewriter with that of the same policy alone."""
    for behind in policy_runs:
        makeup = dict(behind.versions.makeup)
        if not makeup.get(POLICY, "").startswith(f"{RESOLVE}:"):
            continue
        for alone in policy_runs:
            is_same_policy = makeup_text(alone.versions.makeup) == makeup[BEHIND]
            if is_same_policy and alone.conditions == behind.conditions:
                yield _Rewritten(behind, alone)


def _shared_options(
    cells: Mapping[Key, ByTask], behind: PolicyRun, alone: PolicyRun
) -> list[InstructionOptions]:
    """Return the instruction options that both policy runs played, in the order of tables."""
    shared = []
    for policy_run, options in cells:
        if policy_run == behind and (alone, options) in cells:
            shared.append(options)
    return sorted(shared, key=options_sort_key)


def _words(tasks: Sequence[TaskRates]) -> list[str]:
    """Return the cells of a row: episodes, the three rates, the share and its interval.

    For example ``["50", "40", "60", "80", "50", "35 to 70"]``.

    Args:
        tasks: of each task the rates rewritten, as said, and in explicit words.
    """
    if not tasks:
        return ["0", *[NOT_APPLICABLE] * 5]
    cells = [str(sum(len(task.weights) for task in tasks))]
    rewritten, said, explicit = mean_rates(tasks)
    for rate in (said, rewritten, explicit):
        cells.append(whole_percent(rate))
    interval = share_interval(tasks)
    if interval is None:
        return [*cells, NO_SHARE, NOT_APPLICABLE]
    share = (rewritten - said) / (explicit - said)
    cells.append(whole_percent(share))
    cells.append(f"{whole_percent(interval.low)} to {whole_percent(interval.high)}")
    return cells


def _rates_of_tasks(groups: Sequence[ByTask]) -> list[TaskRates]:
    """Return the success rates of three groups in each task, on the episodes that all have.

    Tasks without such an episode are left out.
    """
    found = []
    for task in groups[0]:
        cells = [by_task[task] for by_task in groups if task in by_task]
        if len(cells) == len(groups):
            rows = _joint_rows(cells)
            if len(rows):
                found.append(TaskRates.of(rows))
    return found


def _joint_rows(cells: Sequence[Cell]) -> Rows:
    """Return successes and trials in each of three cells, side by side, of the shared episodes.

    With one seed, an episode that only the second cell solved has the row ``(0, 1, 1, 1, 0, 1)``.

    Returns:
        Shape (episodes, 6).
    """
    by_episode = [cell.by_episode() for cell in cells]
    shared = set(by_episode[0])
    for episodes in by_episode:
        shared &= set(episodes)
    rows = []
    for episode in sorted(shared):
        row = []
        for episodes in by_episode:
            verdicts = episodes[episode]
            row += [sum(verdicts.values()), len(verdicts)]
        rows.append(row)
    return np.array(rows, dtype=np.int64).reshape(-1, 6)
