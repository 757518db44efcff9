"""How episodes ended, as rates of all of them, and of what a gap to explicit consists.

A share among failures conditions on failing: it may rise because other failures became fewer, and
its difference between two settings is not one of the same episodes. Rates of all episodes are.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from fractions import Fraction

from roboirg.core.failures import FAILURE_KINDS, FailureKind
from roboirg.evaluation.analysis.results.frame import Frame, as_column
from roboirg.evaluation.analysis.stats.cells import ByTask, cells_of
from roboirg.evaluation.analysis.stats.measure import (
    ScopeKey,
    ScopeSummary,
    mean_rate,
    summarize,
)
from roboirg.evaluation.analysis.stats.run_data import RunData

Ends = tuple[Fraction, Fraction]
"""The least and the most that a share can be."""


def measure_ends(
    data: RunData, scopes: Collection[str]
) -> Mapping[ScopeKey, tuple[ScopeSummary, ...]]:
    """Measure success and each kind of failure, in the order of `FAILURE_KINDS`, in some scopes.

    All are rates of the episodes with a verdict, so they add up to 1, and their gaps to explicit
    to 0. A failure that was not attributed is undecided.
    """
    kinds = [summarize(cells_of(_only(data.frame, kind)), scopes) for kind in FAILURE_KINDS]
    return {
        key: (success, *(one[key] for one in kinds))
        for key, success in data.summaries.items()
        if key.scope in scopes and success.tasks
    }


def _only(frame: Frame, kind: FailureKind) -> Frame:
    """Return the frame with failures of a kind in place of successes."""
    ends = zip(frame["outcome"], frame["failure_kind"], strict=True)
    found = [
        "success"
        if end == "failure" and (own or "undecided") == kind
        else "failure"
        if end == "success"
        else end
        for end, own in ends
    ]
    return frame.extended({"outcome": as_column(found)})


def grounding_share(kinds: Sequence[ByTask]) -> Ends | None:
    """Return the share of grounding among failures; None without failures.

    At least, all that is undecided was execution; at most, it was grounding.

    Args:
        kinds: for each kind of failure, the episodes by task, in which it counts as success.
    """
    grounding, execution, undecided = (mean_rate(one) or Fraction(0) for one in kinds)
    failed = grounding + execution + undecided
    return (grounding / failed, (grounding + undecided) / failed) if failed else None
