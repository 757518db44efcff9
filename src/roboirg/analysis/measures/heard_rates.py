"""Rates over the episodes in which the policy's model read the whole instruction."""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from fractions import Fraction

from roboirg.analysis.results.frame import MISSING, Frame, RunNames
from roboirg.core.plain_text import counted
from roboirg.stats.cells import Key, rows_of
from roboirg.stats.rates import percent_range

HeardCounts = Counter[str]
"""Numbers of ``episodes`` that were played, those that ended in an error, too; and of them by what
became of the prompt: ``heard`` whole, ``cut``, or perhaps cut (``unknown``)."""


def count_heard(frame: Frame, by: Sequence[str]) -> Mapping[Key, HeardCounts]:
    """Count episodes by policy run and some columns.

    By ``("task",)``, for example, ``{(run, "StopCube"): {"episodes": 50, "heard": 44, "cut": 6}}``.
    A policy run is left out if it declares no limit, so that nothing is known of any prompt.
    """
    counts_by_key: defaultdict[Key, HeardCounts] = defaultdict(Counter)
    runs_with_limit = set()
    for run, *values, prompt, outcome in rows_of(frame, "run", *by, "prompt", "outcome"):
        if outcome == MISSING:
            continue
        counts_by_key[run, *values].update(("episodes", prompt))
        if prompt != "unknown":
            runs_with_limit.add(run)
    return {key: counts for key, counts in counts_by_key.items() if key[0] in runs_with_limit}


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
    """Return the share of episodes with a cut prompt in percent, such as ``12`` or ``12–20``.

    It stands between bounds if some were perhaps cut. Of several tasks it is the mean of their
    shares.
    """
    cut = Fraction(0)
    perhaps_cut = Fraction(0)
    for counts in tasks:
        cut += Fraction(counts["cut"], counts["episodes"])
        perhaps_cut += Fraction(counts["unknown"], counts["episodes"])
    return percent_range(cut / len(tasks), (cut + perhaps_cut) / len(tasks))
