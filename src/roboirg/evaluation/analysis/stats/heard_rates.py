"""Rates over the episodes in which the policy's model read the whole instruction."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from fractions import Fraction

from roboirg.evaluation.analysis.results.frame import MISSING, Frame, RunNames
from roboirg.evaluation.analysis.stats.cells import Key
from roboirg.evaluation.analysis.stats.rates import whole_percent

HeardCounts = Counter[str]
"""Numbers of ``episodes`` that were played, those that ended in an error, too; and of them by what
became of the prompt: ``heard`` whole, ``cut``, or perhaps cut (``unknown``)."""


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
    return {key: counts for key, counts in found.items() if key[0] in declared}


def heard_notes(frame: Frame, names: RunNames) -> list[str]:
    """Return a sentence for each policy of which some prompts were cut, or may have been."""
    counts = count_heard(frame, ())
    found = {run: one for (run,), one in counts.items() if one["cut"] or one["unknown"]}
    return [
        f"{name} did not read every instruction to its end (its prompt is limited): "
        f"{cut_text([found[run]])} % of its prompts were cut; tables --which heard has the rates."
        for run, name in names.items()
        if run in found
    ]


def cut_text(tasks: Sequence[HeardCounts]) -> str:
    """Return the share of episodes with a cut prompt in percent, between bounds if need be.

    Of several tasks it is the mean of their shares.
    """
    least = most = Fraction(0)
    for counts in tasks:
        cut = Fraction(counts["cut"], counts["episodes"])
        least += cut
        most += cut + Fraction(counts["unknown"], counts["episodes"])
    low, high = whole_percent(least / len(tasks)), whole_percent(most / len(tasks))
    return low if low == high else f"{low}–{high}"
