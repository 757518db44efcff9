"""The page of the paper's experiment: published and own tables, and the same questions to both."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from typing import TYPE_CHECKING, Any, NamedTuple

import roboirg
from roboirg.extension.episodes import plain_settings
from roboirg.extension.pages import holm, markdown_table, published_rows
from roboirg_learn.policy.paper_experiment import CONTEXT, MAIN, SYSTEMS, row_name

if TYPE_CHECKING:
    import pandas as pd

EXPLICIT = "explicit"
FIRST = row_name("none")
"""The row that the others are compared with."""
TRIALS = 150
"""Rollouts behind a published rate."""
Z_95 = 1.96
ALPHA = 0.05
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
    """A difference of two rates, 0 to 1; gaps that were measured have these, too.

    Attributes:
        value: the first less the second.
        interval: 95 %; None with too few episodes, or if all published rates are 0 or 100.
        p_value: not corrected.
    """

    value: float
    interval: tuple[float, float] | None
    p_value: float


Differences = Mapping[str, Mapping[str, Any]]
"""By row, then by column."""


def answers_text(frames: Mapping[str, pd.DataFrame]) -> str:
    """Return the paper's questions with the answers of the parts and of its rates.

    Args:
        frames: results of the parts that were played, as `roboirg.results` returns them.
    """
    told = {part: frame[frame["arm"] == "told"] for part, frame in frames.items()}
    main = _main_questions(told[MAIN]) if MAIN in told else ()
    context = (_stage_question(told[CONTEXT]),) if CONTEXT in told else ()
    return "\n\n".join([*main, *context])


def _main_questions(told: pd.DataFrame) -> Iterator[str]:
    settings = [name for name in plain_settings() if name != EXPLICIT]
    published = {(one.model, one.options.setting): one.rates for one in published_rows("main")}
    played = told[told["form"] == "implicit"]
    carried = _gaps(played, "setting", {"setting": EXPLICIT})
    theirs = {
        system: {
            name: _independent(published[system, name], published[system, EXPLICIT])
            for name in settings
        }
        for system in SYSTEMS.values()
    }
    yield _table(
        "Does explicit success carry over, and which setting costs most?",
        "Success in each setting less explicit success on the same scenes, in points.",
        settings,
        carried | theirs,
    )
    if FIRST in set(played["policy"]):
        yield from _memory_questions(played, [EXPLICIT, *settings], published)
    yield _retention(settings, carried, published)
    resolved = _gaps(told, "setting", {"form": "implicit"}, form="resolved")
    if resolved:
        yield _table(
            "Do resolved forms recover it?",
            "Success with references replaced by names less success with references, in points.",
            settings,
            resolved,
        )


def _memory_questions(
    played: pd.DataFrame, settings: Sequence[str], published: Mapping[tuple[str, str], Rates]
) -> Iterator[str]:
    first, *others = SYSTEMS.values()
    theirs = {
        system: {
            name: _independent(published[system, name], published[first, name]) for name in settings
        }
        for system in others
    }
    less = "less that of the row without memory, in points"
    yield _table(
        "Do memory and referring come apart?",
        f"Success {less}.",
        settings,
        _gaps(played, "setting", {"policy": FIRST}) | theirs,
    )
    explicit = played[played["setting"] == EXPLICIT]
    filmed = explicit[explicit["demonstration_steps"] > 0].assign(suite="with a video")
    groups: dict[str, set[str]] = {}
    found: dict[str, dict[str, Any]] = {}
    for frame in (one for one in (explicit, filmed) if FIRST in set(one["policy"])):
        for group, tasks in frame.groupby("suite", sort=False)["task"]:
            groups[str(group)] = set(tasks)
        for row, by_group in _gaps(frame, "suite", {"policy": FIRST}).items():
            found.setdefault(row, {}).update(by_group)
    for system in others:
        rates, reference = published[system, EXPLICIT], published[first, EXPLICIT]
        found[system] = {
            group: _independent({task: rates[task] for task in rates if task in tasks}, reference)
            for group, tasks in groups.items()
        }
    yield _table(
        "Where does memory help?",
        f"Explicit success {less}, by group of tasks.",
        list(groups),
        found,
    )


def _stage_question(told: pd.DataFrame) -> str:
    rows = published_rows("context")
    shortest = min(rows, key=lambda one: len(one.options.stages)).label
    longer = [one for one in dict.fromkeys(row.label for row in rows) if one != shortest]
    rates = {(one.model, one.label): one.rates for one in rows}
    theirs = {
        system: {one: _independent(rates[system, one], rates[system, shortest]) for one in longer}
        for system in dict.fromkeys(one.model for one in rows)
    }
    return _table(
        "Does success fall with each stage of the context?",
        f"Success less that in {shortest}, in points.",
        longer,
        _gaps(told, "instruction_options", {"instruction_options": shortest}) | theirs,
    )


def _gaps(
    frame: pd.DataFrame, column: str, against: Mapping[str, str], form: str = "implicit"
) -> dict[str, dict[str, Any]]:
    """Return the gaps of the groups of policy, a column and a form that have one."""
    found: dict[str, dict[str, Any]] = {}
    for one in roboirg.measure(frame, ("policy", column, "form"), against):
        policy, name, own_form = one.key
        if one.gap is not None and own_form == form:
            found.setdefault(policy, {})[name] = one.gap
    ordered = dict.fromkeys([*map(row_name, SYSTEMS), *found])
    return {row: found[row] for row in ordered if row in found}


def _independent(first: Rates, second: Rates) -> Difference:
    """Return the difference of published rates, the mean over the tasks of the first.

    The trials of two published cells are taken as independent, as only their rates are known.
    """
    shares = [
        (float(rate) / 100, float(second[task] or 0) / 100)
        for task, rate in first.items()
        if rate is not None
    ]
    variance = sum(one * (1 - one) for pair in shares for one in pair) / TRIALS / len(shares) ** 2
    value, spread = sum(one - other for one, other in shares) / len(shares), math.sqrt(variance)
    if not spread:
        return Difference(value, None, 1.0)
    interval = value - Z_95 * spread, value + Z_95 * spread
    return Difference(value, interval, math.erfc(abs(value) / spread / math.sqrt(2)))


def _retention(
    settings: Sequence[str],
    carried: Mapping[str, Mapping[str, Any]],
    published: Mapping[tuple[str, str], Rates],
) -> str:
    kept: dict[str, dict[str, str]] = {}
    for row, own in carried.items():
        for name, gap in own.items():
            if gap.retention is not None:
                kept.setdefault(row, {})[name] = _with_ends(
                    100 * gap.retention, gap.retention_interval, "{:.0f}", "{:.0f}"
                )
    for system in SYSTEMS.values():
        for name in settings:
            own, explicit = published[system, name], published[system, EXPLICIT]
            pairs = [(one, explicit[task]) for task, one in own.items() if one is not None]
            whole = sum(float(other or 0) for _, other in pairs)
            share = 100 * sum(float(one) for one, _ in pairs) / whole
            kept.setdefault(system, {})[name] = f"{share:.0f}"
    return markdown_table(
        "Do planners keep more?",
        settings,
        [("", row, [own.get(name, "–") for name in settings]) for row, own in kept.items()],
        ("Success in each setting by explicit success, in percent.",),
    )


def _table(title: str, note: str, columns: Sequence[str], found: Differences) -> str:
    """Return a table of differences; a star marks p at most 0.05 with Holm's correction by row."""
    rows = []
    for row, own in found.items():
        shown = [name for name in columns if name in own]
        adjusted = dict(zip(shown, holm([own[name].p_value for name in shown]), strict=True))
        cells = {
            name: _with_ends(
                100 * own[name].value,
                own[name].interval,
                "{:+.1f}" + "*" * (adjusted[name] <= ALPHA),
                "{:+.0f}",
            )
            for name in shown
        }
        rows.append(("", row, [cells.get(name, "–") for name in columns]))
    return markdown_table(title, columns, rows, (note, _POINTS))


def _with_ends(value: float, interval: tuple[float, float] | None, form: str, of_end: str) -> str:
    """Return a value in percent with the ends of its interval, 0 to 1."""
    if interval is None:
        return f"{form.format(value)} (no interval)"
    low, high = (of_end.format(100 * end) for end in interval)
    return f"{form.format(value)} ({low} to {high})"
