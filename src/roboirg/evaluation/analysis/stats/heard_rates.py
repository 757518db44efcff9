"""Rates over the episodes in which the policy's model read the whole instruction."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Mapping, Sequence
from fractions import Fraction

from roboirg.core.plain_text import counted
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
    """Return a sentence for each policy whose prompts were or may be cut, or that guessed."""
    counts = count_heard(frame, ())
    episodes = Counter(frame["run"])
    guesses = Counter(itertools.compress(frame["run"], frame["guessed"]))
    notes: list[str] = []
    for run, name in names.items():
        heard = counts.get((run,), Counter())
        if heard["cut"] or heard["unknown"]:
            notes.append(
                f"{name} did not read every instruction to its end (its prompt is limited): "
                f"{cut_text(heard)} % of its prompts were cut; tables --which heard has the rates."
            )
        if guesses[run]:
            notes.append(
                f"{name} guessed a goal in {guesses[run]} of {counted(episodes[run], 'episode')}, "
                "whose words have no meaning for it."
            )
    return notes


def cut_text(one: HeardCounts) -> str:
    """Return the share of episodes with a cut prompt in percent, between bounds if need be."""
    low, high = (
        whole_percent(Fraction(count, one["episodes"]))
        for count in (one["cut"], one["cut"] + one["unknown"])
    )
    return low if low == high else f"{low}–{high}"
