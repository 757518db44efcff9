"""The page of the paper's experiment: published and own tables, and the same questions to both."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from typing import TYPE_CHECKING, Any, NamedTuple

import roboirg
from roboirg.extension.episodes import plain_settings
from roboirg.extension.pages import (
    ALPHA,
    holm,
    markdown_table,
    published_gap_interval,
    published_rows,
)
from roboirg_learn.policy.paper_experiment import CONTEXT, MAIN, SYSTEMS, row_name

if TYPE_CHECKING:
    import pandas as pd

EXPLICIT = "explicit"
WITHOUT_MEMORY_ROW = row_name("none")
"""The row that the others are compared with."""
WITHOUT_MEMORY_SYSTEM, *OTHER_SYSTEMS = SYSTEMS.values()
"""The paper's system that the others are compared with, and these."""
LESS_WITHOUT_MEMORY = "less that of the row without memory, in points"
TRIALS = 150
"""Rollouts behind a published rate."""
_POINTS = "* p ≤ 0.05 with Holm's correction over the row. In parentheses: 95 % intervals."
INTRODUCTION = """\
# The paper's experiment with small policies

Rows called *small-…* have a mechanism of the paper on the small body of the learned policy. \
They are not the paper's systems; the page *The paper's mechanisms on a small body* of the \
documentation lists what differs. Published rates have 150 rollouts in each cell. Intervals are \
over scenes.
"""

Rates = Mapping[str, Decimal | None]
"""Published success by task, percent; None where the setting is not defined."""


class Difference(NamedTuple):
    """A difference of two success rates; gaps that were measured have these fields, too.

    Attributes:
        value: the first less the second, from -1 to 1.
        interval: 95 %; None with too few episodes.
        p_value: two-sided, not corrected.
    """

    value: float
    interval: tuple[float, float] | None
    p_value: float


Differences = Mapping[str, Mapping[str, Any]]
"""`Difference`, or a gap that was measured, by row of a table, then by column."""


def answers_text(frames: Mapping[str, pd.DataFrame]) -> str:
    """Return the page's sections: each a question of the paper with a table of answers.

    A table has rows of our small policies, and rows computed from the paper's published rates.

    Args:
        frames: episodes of the parts that were played, by part, as `roboirg.results` returns them.
    """
    sections: list[str] = []
    if MAIN in frames:
        sections += _main_questions(_with_words(frames[MAIN]))
    if CONTEXT in frames:
        sections.append(_stage_question(_with_words(frames[CONTEXT])))
    return "\n\n".join(sections)


def _with_words(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the episodes in which the policy was given the instruction; in others it gets none."""
    return frame[frame["arm"] == "told"]


class _Published:
    """The paper's rates of the main experiment, by system and setting."""

    def __init__(self) -> None:
        self._rates = {
            (row.model, row.options.setting): row.rates for row in published_rows("main")
        }

    def rates(self, system: str, setting: str) -> Rates:
        """Return the published success of a system in a setting by task, percent."""
        return self._rates[system, setting]

    def changes(self, settings: Sequence[str]) -> Differences:
        """Return how each published system's success differs from its own explicit success.

        By system, then by setting.
        """
        found: dict[str, dict[str, Difference]] = {}
        for system in SYSTEMS.values():
            explicit = self.rates(system, EXPLICIT)
            found[system] = {
                name: _published_difference(self.rates(system, name), explicit) for name in settings
            }
        return found

    def gains(self, settings: Sequence[str]) -> Differences:
        """Return how each system's success differs from that of the system without memory.

        By system, then by setting; both are published.
        """
        found: dict[str, dict[str, Difference]] = {system: {} for system in OTHER_SYSTEMS}
        for name in settings:
            first = self.rates(WITHOUT_MEMORY_SYSTEM, name)
            for system, gains in found.items():
                gains[name] = _published_difference(self.rates(system, name), first)
        return found


def _main_questions(with_words: pd.DataFrame) -> Iterator[str]:
    """Yield the sections that the main experiment answers, each a question with a table.

    Args:
        with_words: played episodes of the main part. In the form *implicit* words refer to objects;
            in *resolved* the references are replaced by names.
    """
    settings = [name for name in plain_settings() if name != EXPLICIT]
    published = _Published()
    played = with_words[with_words["form"] == "implicit"]
    changes = _gaps(played, "setting", {"setting": EXPLICIT})
    yield _table(
        "Does explicit success carry over, and which setting costs most?",
        "Success in each setting less explicit success on the same scenes, in points.",
        settings,
        {**changes, **published.changes(settings)},
    )
    if WITHOUT_MEMORY_ROW in set(played["policy"]):
        yield _memory_question(played, [EXPLICIT, *settings], published)
        yield _group_question(played[played["setting"] == EXPLICIT], published)
    yield _retention(settings, changes, published)
    resolved = _gaps(with_words, "setting", {"form": "implicit"}, form="resolved")
    if resolved:
        yield _table(
            "Do resolved forms recover it?",
            "Success with references replaced by names less success with references, in points.",
            settings,
            resolved,
        )


def _memory_question(played: pd.DataFrame, settings: Sequence[str], published: _Published) -> str:
    """Return the table of what memory adds in each setting: ours, then the paper's systems."""
    gaps = _gaps(played, "setting", {"policy": WITHOUT_MEMORY_ROW})
    return _table(
        "Do memory and referring come apart?",
        f"Success {LESS_WITHOUT_MEMORY}.",
        settings,
        {**gaps, **published.gains(settings)},
    )


def _group_question(explicit: pd.DataFrame, published: _Published) -> str:
    """Return the table of what memory adds in each group of tasks, with explicit words.

    Groups are the suites of tasks; all tasks with a video are one more group.
    """
    is_filmed = explicit["demonstration_steps"] > 0
    filmed = explicit[is_filmed].assign(suite="with a video")
    tasks_of: dict[str, set[str]] = {}
    found: dict[str, dict[str, Any]] = {}
    for frame in (explicit, filmed):
        if WITHOUT_MEMORY_ROW not in set(frame["policy"]):
            continue
        for group, tasks in frame.groupby("suite", sort=False)["task"]:
            tasks_of[str(group)] = set(tasks)
        for row, gaps in _gaps(frame, "suite", {"policy": WITHOUT_MEMORY_ROW}).items():
            found.setdefault(row, {}).update(gaps)
    for system in OTHER_SYSTEMS:
        found[system] = _published_gains(system, tasks_of, published)
    return _table(
        "Where does memory help?",
        f"Explicit success {LESS_WITHOUT_MEMORY}, by group of tasks.",
        list(tasks_of),
        found,
    )


def _published_gains(
    system: str, tasks_of: Mapping[str, set[str]], published: _Published
) -> dict[str, Difference]:
    """Return for each group of tasks what memory adds to a system: a difference of success.

    Args:
        system: of the paper.
        tasks_of: the tasks of each group.
        published: the paper's rates; those with explicit words are compared.
    """
    rates = published.rates(system, EXPLICIT)
    without_memory = published.rates(WITHOUT_MEMORY_SYSTEM, EXPLICIT)
    gains = {}
    for group, tasks in tasks_of.items():
        rates_of_group = {task: rate for task, rate in rates.items() if task in tasks}
        gains[group] = _published_difference(rates_of_group, without_memory)
    return gains


def _stage_question(with_words: pd.DataFrame) -> str:
    """Return the table of what each further stage of the context costs.

    A context is told in stages before the instruction; all are compared with the shortest one.
    """
    rows = published_rows("context")
    shortest = min(rows, key=lambda row: len(row.options.stages)).label
    longer = [label for label in dict.fromkeys(row.label for row in rows) if label != shortest]
    rates = {(row.model, row.label): row.rates for row in rows}
    published_gaps: dict[str, dict[str, Difference]] = {}
    for row in rows:
        if row.label != shortest:
            difference = _published_difference(row.rates, rates[row.model, shortest])
            published_gaps.setdefault(row.model, {})[row.label] = difference
    gaps = _gaps(with_words, "instruction_options", {"instruction_options": shortest})
    return _table(
        "Does success fall with each stage of the context?",
        f"Success less that in {shortest}, in points.",
        longer,
        {**gaps, **published_gaps},
    )


def _gaps(
    frame: pd.DataFrame, column: str, against: Mapping[str, str], form: str = "implicit"
) -> dict[str, dict[str, Any]]:
    """Return differences of success, by policy and then by the value of a column.

    Our rows come first, in the paper's order; policies without any difference are left out.

    Args:
        frame: played episodes.
        column: such as ``setting``; each of its values is a column of the table.
        against: what each group is compared with, such as ``{"setting": "explicit"}``.
        form: of the instructions that are compared.
    """
    gaps_of: dict[str, dict[str, Any]] = {row_name(memory): {} for memory in SYSTEMS}
    for measured in roboirg.measure(frame, ("policy", column, "form"), against):
        policy, name, measured_form = measured.key
        if measured.gap is not None and measured_form == form:
            gaps_of.setdefault(policy, {})[name] = measured.gap
    return {policy: gaps for policy, gaps in gaps_of.items() if gaps}


def _published_difference(first: Rates, second: Rates) -> Difference:
    """Return the mean difference of two published rates over the tasks that the first has.

    They have `TRIALS` rollouts for each rate, and those of the two are taken as independent,
    because only their rates are known. The p-value is of a normal approximation.
    """
    total = 0.0
    variance = 0.0  # of one rollout of each, summed over tasks
    count = 0
    for task, rate in first.items():
        if rate is not None:
            share = float(rate) / 100
            other = float(second[task] or 0) / 100
            total += share - other
            variance += share * (1 - share)
            variance += other * (1 - other)
            count += 1
    value = total / count
    standard_error = math.sqrt(variance / TRIALS / count**2)
    tasks = [task for task, rate in first.items() if rate is not None]
    interval = published_gap_interval(first, second, tasks, TRIALS)
    if not standard_error:
        return Difference(value, interval, 1.0)
    p_value = math.erfc(abs(value) / standard_error / math.sqrt(2))  # two-sided
    return Difference(value, interval, p_value)


def _retention(settings: Sequence[str], changes: Differences, published: _Published) -> str:
    """Return the table of the share of explicit success that is kept in each setting, percent.

    Args:
        settings: the columns.
        changes: our measured differences to explicit success, by policy and setting; they have the
            share in their field `retention`, None where there is none.
        published: the paper's rates.
    """
    cells: dict[str, dict[str, str]] = {}
    for row, gaps in changes.items():
        for setting, gap in gaps.items():
            if gap.retention is not None:
                text = _with_interval(100 * gap.retention, gap.retention_interval, "{:.0f}")
                cells.setdefault(row, {})[setting] = text
    for system in SYSTEMS.values():
        explicit = published.rates(system, EXPLICIT)
        of_system = cells.setdefault(system, {})
        for setting in settings:
            percent = _percent_kept(published.rates(system, setting), explicit)
            of_system[setting] = f"{percent:.0f}"
    rows = [("", row, _cells_of_row(texts, settings)) for row, texts in cells.items()]
    note = "Success in each setting by explicit success, in percent."
    return markdown_table("Do planners keep more?", settings, rows, (note,))


def _percent_kept(rates: Rates, explicit: Rates) -> float:
    """Return what percentage of explicit success is kept: of the sums over the same tasks.

    Tasks in which the setting is not defined count in neither sum.
    """
    kept = 0.0
    explicit_sum = 0.0
    for task, rate in rates.items():
        if rate is not None:
            kept += float(rate)
            explicit_sum += float(explicit[task] or 0)
    return 100 * kept / explicit_sum


def _table(title: str, note: str, columns: Sequence[str], found: Differences) -> str:
    """Return a Markdown table of differences in points, with their 95 % intervals.

    A star marks p ≤ 0.05 after Holm's correction for the several columns of a row.

    Args:
        title: the question.
        note: under the table.
        columns: such as settings.
        found: by row, then by column.
    """
    rows = []
    for row, differences in found.items():
        shown = [name for name in columns if name in differences]
        p_values = holm([differences[name].p_value for name in shown])
        texts = {}
        for name, p_value in zip(shown, p_values, strict=True):
            difference = differences[name]
            form = "{:+.1f}*" if p_value <= ALPHA else "{:+.1f}"
            texts[name] = _with_interval(
                100 * difference.value, difference.interval, form, "{:+.0f}"
            )
        rows.append(("", row, _cells_of_row(texts, columns)))
    return markdown_table(title, columns, rows, (note, _POINTS))


def _cells_of_row(texts: Mapping[str, str], columns: Sequence[str]) -> list[str]:
    """Return the text of each column of a row; a dash where it has none."""
    return [texts.get(name, "–") for name in columns]


def _with_interval(
    value: float,
    interval: tuple[float, float] | None,
    form: str,
    form_of_ends: str = "{:.0f}",
) -> str:
    """Return a value with its interval as text, such as ``-12.0* (-20 to -4)``.

    Args:
        value: in percent or points.
        interval: from 0 to 1, or -1 to 1 for a difference; None for *no interval*.
        form: format of the value.
        form_of_ends: format of the ends, which are turned into percent.
    """
    shown = form.format(value)
    if interval is None:
        return f"{shown} (no interval)"
    low, high = (form_of_ends.format(100 * end) for end in interval)
    return f"{shown} ({low} to {high})"
