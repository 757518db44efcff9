"""Rates over the episodes in which the policy's model read the whole instruction."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.stats.cells import CellKey, PolicyRun, task_order
from roboirg.evaluation.analysis.stats.option_labels import options_label, options_sort_key
from roboirg.evaluation.analysis.stats.rates import whole_percent
from roboirg.evaluation.records.record import Summary


@dataclass
class HeardCounts:
    """Episodes of one or several cells, by whether their prompt was cut.

    Attributes:
        episodes: all results, those that ended in an error too.
        cut: of them, those whose prompt was certainly cut.
        unknown: of them, those whose prompt may have been cut.
        trials: those with a verdict of the judge.
        successes: of the trials.
        heard: trials in which the whole prompt was read.
        heard_successes: of these.
    """

    episodes: int = 0
    cut: int = 0
    unknown: int = 0
    trials: int = 0
    successes: int = 0
    heard: int = 0
    heard_successes: int = 0

    def add(self, result: Summary) -> None:
        is_heard, won = result.prompt_verdict == "heard", result.outcome == "success"
        self.episodes += 1
        self.cut += result.prompt_verdict == "cut"
        self.unknown += result.prompt_verdict == "unknown"
        if result.outcome != "error":
            self.trials += 1
            self.successes += won
            self.heard += is_heard
            self.heard_successes += is_heard and won

    @property
    def rate(self) -> Fraction | None:
        """Success rate over all trials; None without one."""
        return Fraction(self.successes, self.trials) if self.trials else None

    @property
    def heard_rate(self) -> Fraction | None:
        """Success rate over the trials whose prompt was read whole; None without one."""
        return Fraction(self.heard_successes, self.heard) if self.heard else None


HeardCells = Mapping[CellKey, HeardCounts]


def count_heard(results: Iterable[tuple[PolicyRun, Summary]]) -> HeardCells:
    """Count results by cell; policies that declare no limit are left out."""
    found: defaultdict[CellKey, HeardCounts] = defaultdict(HeardCounts)
    for policy_run, result in results:
        found[CellKey(policy_run, result.task, result.column)].add(result)
    declared = {key.policy_run for key, one in found.items() if one.unknown < one.episodes}
    return {key: one for key, one in found.items() if key.policy_run in declared}


def add_up(cells: HeardCells) -> Mapping[tuple[PolicyRun, InstructionOptions], HeardCounts]:
    """Return the counts over all tasks, settings in order."""
    found: defaultdict[tuple[PolicyRun, InstructionOptions], HeardCounts]
    found = defaultdict(HeardCounts)
    for key in sorted(cells, key=lambda key: options_sort_key(key.options)):
        total, one = found[key.policy_run, key.options], cells[key]
        for name in vars(total):
            setattr(total, name, getattr(total, name) + getattr(one, name))
    return found


def heard_notes(cells: HeardCells, names: Mapping[PolicyRun, str]) -> list[str]:
    """Return a sentence for each policy of which some prompts were cut, or may have been."""
    notes = []
    totals = add_up(cells)
    for policy_run, name in names.items():
        parts = [
            _part(options, one)
            for (owner, options), one in totals.items()
            if owner == policy_run and (one.cut or one.unknown)
        ]
        if parts:
            notes.append(
                f"{name} did not read every instruction to its end (its prompt is limited): "
                f"{'; '.join(parts)}."
            )
    return notes


def cut_text(one: HeardCounts) -> str:
    """Return the share of episodes with a cut prompt in percent, between bounds if need be."""
    low, high = (
        whole_percent(Fraction(count, one.episodes)) for count in (one.cut, one.cut + one.unknown)
    )
    return low if low == high else f"{low}–{high}"


def sorted_keys(cells: HeardCells, policy_runs: Sequence[PolicyRun]) -> list[CellKey]:
    """Return the cells' keys by policy run, options and task."""
    tasks = task_order({key.task for key in cells})
    return sorted(
        cells,
        key=lambda key: (
            policy_runs.index(key.policy_run),
            options_sort_key(key.options),
            tasks.index(key.task),
        ),
    )


def _part(options: InstructionOptions, one: HeardCounts) -> str:
    text = f"{options_label(options)} {cut_text(one)} % cut"
    if one.rate is None:
        return text
    heard = "none heard whole"
    if one.heard_rate is not None:
        heard = f"{whole_percent(one.heard_rate)} % of the {one.heard:,} heard whole"
    return f"{text}, success {whole_percent(one.rate)} % of {one.trials:,}, {heard}"
