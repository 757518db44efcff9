"""Write the tables of docs/learned-policy-results.md, and all rates as CSV, from their episodes.

python scripts/write_learned_table.py
"""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from written_parts import rate_text, with_part

from roboirg.core.arms import TOLD
from roboirg.evaluation.analysis.results.frame import make_frame
from roboirg.evaluation.analysis.stats.arm_figures import (
    LANGUAGE_USE,
    ORDERS_WORTH,
    WORDS_WORTH,
    ArmFigure,
    arm_figures,
)
from roboirg.evaluation.analysis.stats.cells import Cell, cells_of
from roboirg.evaluation.analysis.stats.chance import silent_chance
from roboirg.evaluation.analysis.stats.intervals import ALPHA
from roboirg.evaluation.analysis.stats.measure import mean_rate
from roboirg.evaluation.analysis.stats.paired_tests import holm, sign_flip_test
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.records.packs import opened_run
from roboirg.evaluation.records.record import Summary
from roboirg.evaluation.records.store import read_results
from roboirg.language.settings import EXPLICIT, plain_settings
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import SIZES
from roboirg_learn.listener.study_report import TrainedRate, trained_rate

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "learned-policy-results.md"
RESULTS = ROOT / "results"
PACK = RESULTS / "learned-policy-val.roboirg.zip"
BY_TASK = RESULTS / "learned-policy-by-task.csv"
SMALLEST_P = 0.001
"""Smaller ones are not printed."""
MEMORY, FRAMES, WITHOUT = "small-recurrent", "small-framesamp", "small-none"
WORDS = {MEMORY: "explicit", "small-recurrent-all-words": "all five settings"}
"""What each row's reader was trained on; the body is the same."""
WORDLESS = "small-recurrent-no-words"
"""Its reader was trained on no words, so that it does the same in each setting."""

Cells = Mapping[tuple[str, str], Mapping[str, Mapping[int, Cell]]]
"""By row and setting, then by task, then by training seed."""
Verdicts = NDArray[np.int64]
"""1 where an episode is solved, else 0; shape (training seeds, episodes)."""


def row_of(policy: str) -> tuple[str, int]:
    """Return the row of a policy, and its training seed."""
    row, _, seed = policy.partition("-seed")
    return row, int(seed or 0)


@functools.cache
def played() -> RunData:
    """Return the episodes of the pack."""
    with opened_run(PACK, ()) as run:
        return RunData(make_frame([("val", read_results(run))]))


def told(data: RunData) -> Cells:
    """Return the episodes without control arms."""
    found: dict[tuple[str, str], dict[str, dict[int, Cell]]] = {}
    for key, cell in cells_of(data.frame.told()).items():
        row, seed = row_of(key.policy_run.policy)
        by_task = found.setdefault((row, key.options.setting), {})
        by_task.setdefault(key.task, {})[seed] = cell
    return found


def verdicts(trained: Mapping[int, Cell]) -> Verdicts:
    """Return the verdicts of each training seed on the same episodes."""
    by_seed = [
        {trial.episode: won for trial, won in cell.verdicts.items()}
        for _, cell in sorted(trained.items())
    ]
    return np.array([[one[at] for at in sorted(by_seed[0])] for one in by_seed], np.int64)


def differences(one: Verdicts, other: Verdicts) -> NDArray[np.int64]:
    """Return how much oftener each episode is solved, of as many trainings of both."""
    oftener: NDArray[np.int64] = one.sum(axis=0) * len(other) - other.sum(axis=0) * len(one)
    return oftener


def memory_table(data: RunData) -> str:
    """Return success by task with memory and without, in explicit words, and the paired test."""
    cells = told(data)
    with_memory, without = cells[MEMORY, EXPLICIT], cells[WITHOUT, EXPLICIT]
    tasks = [task for task in all_tasks() if task in with_memory]
    pairs = [(verdicts(with_memory[task]), verdicts(without[task])) for task in tasks]
    p_values = holm([sign_flip_test(differences(one, other)) for one, other in pairs])
    lines = [
        "| task | `recurrent` | each seed | `none` | each seed | p (Holm) | a blind guess |",
        "| --- | ---: | --- | ---: | --- | ---: | ---: |",
    ]
    for task, pair, p_value in zip(tasks, pairs, p_values, strict=True):
        shown = [_with_seeds(trained_rate([one.astype(float)])) for one in pair]
        p_shown = "< 0.001" if p_value < SMALLEST_P else f"{p_value:.3f}"
        lines.append(
            f"| {task} | {' | '.join(shown)} | {p_shown} | {100 * blind_guess(task):.0f} |"
        )
    means = [_with_seeds(trained_rate([one[at].astype(float) for one in pairs])) for at in (0, 1)]
    return "\n".join([*lines, f"| mean | {' | '.join(means)} | | |"])


def memories_table(data: RunData) -> str:
    """Return the success of each memory in explicit words, mean over tasks."""
    cells = told(data)
    lines = ["| memory | all eleven tasks | each seed |", "| --- | ---: | --- |"]
    for row in (MEMORY, FRAMES, WITHOUT):
        found = _with_seeds(trained_rate(list(_tasks_of(cells[row, EXPLICIT]))))
        lines.append(f"| `{row.removeprefix('small-')}` | {found} |")
    return "\n".join(lines)


def failures_table(data: RunData) -> str:
    """Return how the policy with memory fails in explicit words, over its training seeds."""
    found = [(one.task, one.attribution.failure) for one in failures(data) if one.attribution]
    lines = ["| task | failures | of which |", "| --- | ---: | --- |"]
    for task in all_tasks():
        names = Counter(name for own, name in found if own == task)
        kinds = ", ".join(f"`{name}` {count}" for name, count in names.most_common())
        lines += [f"| {task} | {names.total()} | {kinds} |"] * bool(names)
    return "\n".join(lines)


def failures(data: RunData) -> list[Summary]:
    """Return the failures of the policy with memory in explicit words, of all training seeds."""
    return [
        one
        for one in data.frame["result"]
        if row_of(one.policy)[0] == MEMORY
        and (one.arm, one.setting, one.outcome) == (TOLD, EXPLICIT, "failure")
    ]


def by_task(data: RunData) -> str:
    """Return all rates as CSV: a line for each row, setting, task and training seed."""
    lines = ["row,setting,task,seed,solved,episodes"]
    for (row, setting), tasks in sorted(told(data).items()):
        for task, trained in sorted(tasks.items()):
            for seed, cell in sorted(trained.items()):
                solved = sum(cell.verdicts.values())
                lines.append(f"{row},{setting},{task},{seed},{solved},{len(cell.verdicts)}")
    return "\n".join(lines) + "\n"


def words_table(data: RunData) -> str:
    """Return success by setting for each kind of words that were learned, mean over tasks."""
    cells = told(data)
    settings = plain_settings()
    lines = [
        f"| trained on | {' | '.join(f'`{one}`' for one in settings)} |",
        "| --- " + "| ---: " * len(settings) + "|",
    ]
    for row, words in WORDS.items():
        rates = [trained_rate(list(_tasks_of(cells[row, one]))) for one in settings]
        lines.append(f"| {words} | {' | '.join(map(_rate, rates))} |")
    every = cells[WORDLESS, EXPLICIT]
    unheard = [
        trained_rate(list(_tasks_of({task: every[task] for task in cells[MEMORY, one]})))
        for one in settings
    ]
    lines.append(f"| no words | {' | '.join(map(_rate, unheard))} |")
    guesses = [
        100 * np.mean([blind_guess(task) for task in cells[MEMORY, one]]) for one in settings
    ]
    return "\n".join([*lines, f"| a blind guess | {' | '.join(f'{one:.0f}' for one in guesses)} |"])


def arms_table(data: RunData) -> str:
    """Return what control arms show: both rates of each figure, by kind of words and setting."""
    found = {
        (one.key.run.policy, one.key.contrast.name, one.key.options.setting): one
        for one in arm_figures(data.frame)
    }
    settings = plain_settings()
    lines = [
        f"| trained on | figure | {' | '.join(f'`{one}`' for one in settings)} |",
        "| --- | --- " + "| ---: " * len(settings) + "|",
    ]
    for row, words in WORDS.items():
        for figure in (LANGUAGE_USE, WORDS_WORTH, ORDERS_WORTH):
            rates = [_both_rates(found[row, figure, one]) for one in settings]
            lines.append(f"| {words} | {figure} | {' | '.join(rates)} |")
    return "\n".join(lines)


def blind_guess(task: str) -> float:
    """Return how often a random goal of the scene would be right."""
    return float(np.mean([silent_chance(task, "val", episode) for episode in range(SIZES["val"])]))


def _both_rates(one: ArmFigure) -> str:
    first, second = (100 * float(mean_rate(own) or 0) for own in (one.cells, one.others))
    star = "\\*" if one.p_holm is not None and one.p_holm <= ALPHA else ""
    return f"{first:.0f} / {second:.0f}{star}"


def _tasks_of(by_task: Mapping[str, Mapping[int, Cell]]) -> Iterator[NDArray[np.float64]]:
    """Yield the verdicts of each training seed, by task."""
    for trained in by_task.values():
        yield verdicts(trained).astype(float)


def _rate(one: TrainedRate) -> str:
    return rate_text(one.rate, one.interval)


def _with_seeds(one: TrainedRate) -> str:
    return f"{_rate(one)} | {', '.join(f'{100 * rate:.0f}' for rate in one.by_seed)}"


TABLES = {
    "memory": memory_table,
    "memories": memories_table,
    "words": words_table,
    "arms": arms_table,
    "failures": failures_table,
}


def page_text() -> str:
    """Return the page with the tables of the pack."""
    page, data = PAGE.read_text(encoding="utf-8"), played()
    for name, table in TABLES.items():
        page = with_part(page, f"learned {name}", table(data))
    return page


if __name__ == "__main__":
    PAGE.write_text(page_text(), encoding="utf-8")
    BY_TASK.write_text(by_task(played()), encoding="utf-8")
