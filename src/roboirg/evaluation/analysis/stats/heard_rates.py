"""Rates over the episodes in which the policy's model read the whole instruction."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from fractions import Fraction

from roboirg.evaluation.analysis.results.frame import MISSING, Frame
from roboirg.evaluation.analysis.results.policy_run import PolicyRun
from roboirg.evaluation.analysis.stats.cells import Key
from roboirg.evaluation.analysis.stats.rates import whole_percent

HeardCounts = Counter[str]
"""Numbers of ``episodes`` (those that ended in an error, too); of them ``cut`` and perhaps cut
(``unknown``); of ``trials`` with a verdict and their ``successes``; and of those that were heard
whole: ``heard trials``, ``heard successes``."""


def count_heard(frame: Frame, by: Sequence[str]) -> Mapping[Key, HeardCounts]:
    """Count episodes by some columns; policies that declare no limit are left out."""
    found: dict[Key, HeardCounts] = {}
    declared = set()
    names = ("run", "prompt", "outcome", *by)
    for run, prompt, outcome, *key in zip(*(frame[name] for name in names), strict=True):
        if outcome == MISSING:
            continue
        if prompt != "unknown":
            declared.add(run)
        counts = found.setdefault((run, *key), Counter())
        counts.update(("episodes", prompt))
        if outcome != "error":
            heard = "heard " * (prompt == "heard")
            for name in dict.fromkeys(("", heard)):
                counts[f"{name}trials"] += 1
                counts[f"{name}successes"] += outcome == "success"
    return {key: one for key, one in found.items() if key[0] in declared}


def heard_notes(frame: Frame, names: Mapping[PolicyRun, str]) -> list[str]:
    """Return a sentence for each policy of which some prompts were cut, or may have been."""
    counts = count_heard(frame, ())
    found = {run: one for (run,), one in counts.items() if one["cut"] or one["unknown"]}
    return [
        f"{name} did not read every instruction to its end (its prompt is limited): "
        f"{cut_text(found[run])} % of its prompts were cut; tables --which heard has the rates."
        for run, name in names.items()
        if run in found
    ]


def cut_text(one: HeardCounts) -> str:
    """Return the share of episodes with a cut prompt in percent, between bounds if need be."""
    low, high = (
        whole_percent(Fraction(count, one["episodes"]))
        for count in (one["cut"], one["cut"] + one["unknown"])
    )
    return low if low == high else f"{low}–{high}"
