"""Table of verdicts under other choices of the analysis."""

from __future__ import annotations

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.stats.sensitivity import Robustness, gap_contrasts, try_choices
from roboirg.evaluation.analysis.tables.table import (
    NOT_APPLICABLE,
    POLICY,
    Column,
    Entry,
    Row,
    Table,
)

SAME = "same"

_NOTE = (
    "Whether success is lower or higher than in explicit on the same episodes (open: the test does "
    "not decide), as tested everywhere, and what becomes of that under each other choice: same, or "
    "the other verdict with the choices that lead to it. Within a column, p-values are corrected "
    "over all rows of the policy. An episode is a scene, so that rollouts and tasks are the "
    "other units."
)


def make_sensitivity_table(data: RunData) -> Table:
    """Make the table of the gaps of all policies.

    Raises:
        InvalidValueError: no policy has a gap that another choice could change.
    """
    tested = {
        name: try_choices(
            gap_contrasts([one for owner, one in data.results if owner == policy_run])
        )
        for policy_run, name in data.names.items()
    }
    groups = dict.fromkeys(
        choice.group for found in tested.values() for one in found for choice in one.others
    )
    if not groups:
        raise InvalidValueError(
            "No other choice can change the runs: they need explicit and another setting, in "
            "several tasks or with several seeds."
        )
    return Table(
        key="sensitivity",
        title="Gaps under other choices of the analysis",
        heads=(POLICY, "setting"),
        columns=(Column("gap"), *map(Column, groups), Column("holds in")),
        rows=tuple(
            Row(name, one.label, "ours", tuple(map(_entry, _words(one, tuple(groups)))))
            for name, found in tested.items()
            for one in found
        ),
        notes=(_NOTE,),
    )


def _entry(word: str) -> Entry:
    return Entry(word=word)


def _words(found: Robustness, groups: tuple[str, ...]) -> list[str]:
    kept = len(found.others) - len(found.exceptions)
    return [
        found.verdict,
        *(_group_words(found, group) for group in groups),
        f"{kept} of {len(found.others)}" if found.exceptions else "all",
    ]


def _group_words(found: Robustness, group: str) -> str:
    """Return what the choices of a group change; a dash if there are none."""
    own = [one for one in found.others if one.group == group]
    if not own:
        return NOT_APPLICABLE
    changed: dict[str, list[str]] = {}
    for one in own:
        if one in found.exceptions:
            changed.setdefault(found.others[one], []).append(one.name)
    listed = (f"{verdict} ({', '.join(filter(None, names))})" for verdict, names in changed.items())
    return "; ".join(listed).replace(" ()", "") or SAME
