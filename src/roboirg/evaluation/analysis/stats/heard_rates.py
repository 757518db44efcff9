"""Rates over the episodes in which the policy's model read the whole instruction."""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from fractions import Fraction

from roboirg.core.plain_text import counted
from roboirg.evaluation.analysis.results.frame import MISSING, Frame, RunNames
from roboirg.evaluation.analysis.stats.cells import Key, rows_of
from roboirg.evaluation.analysis.stats.rates import percent_range

HeardCounts = Counter[str]
"""Numbers of ``episodes`` that were played, those that ended in an error, too; and of them by what
became of the prompt: ``heard`` whole, ``cut``, or perhaps cut (``unknown``)."""


def count_heard(frame: Frame, by: Sequence[str]) -> Mapping[Key, HeardCounts]:
    """Count episodes by some columns; policies that declare no limit are left out."""
    found: defaultdict[Key, HeardCounts] = defaultdict(Counter)
    declared = set()
    for run, *key, prompt, outcome in rows_of(frame, "run", *by, "prompt", "outcome"):
        if outcome != MISSING:
            found[run, *key].update(("episodes", prompt))
            if prompt != "unknown":
                declared.add(run)
    return {key: counts for key, counts in found.items() if key[0] in declared}


def heard_notes(frame: Frame, names: RunNames) -> list[str]:
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
                f"{cut_text([heard])} % of its prompts were cut; "
                "tables --which heard has the rates."
            )
        if guesses[run]:
            notes.append(
                f"{name} guessed a goal in {guesses[run]} of {counted(episodes[run], 'episode')}, "
                "whose words have no meaning for it."
            )
    return notes


def cut_text(tasks: Sequence[HeardCounts]) -> str:
    """Return the share of episodes with a cut prompt in percent, between bounds if need be.

    Of several tasks it is the mean of their shares.
    """
    least = sum(Fraction(counts["cut"], counts["episodes"]) for counts in tasks)
    most = least + sum(Fraction(counts["unknown"], counts["episodes"]) for counts in tasks)
    return percent_range(Fraction(least, len(tasks)), Fraction(most, len(tasks)))
