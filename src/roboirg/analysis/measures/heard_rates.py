"""Rates over the episodes in which the policy's model read the whole instruction."""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from fractions import Fraction

from roboirg.analysis.results.frame import UNPLAYED, Frame, RunNames
from roboirg.core.plain_text import counted
from roboirg.stats.cells import Key, rows_of
from roboirg.stats.rates import percent_range

HeardCounts = Counter[str]
"""Numbers of ``episodes`` that were played, those that ended in an error, too; and of them by what
became of the prompt: ``heard`` whole, ``cut``, or perhaps cut (``unknown``)."""


def count_heard(frame: Frame, by: Sequence[str]) -> Mapping[Key, HeardCounts]:
    """Count episodes by whether the policy's model read the whole prompt or only its beginning.

    They are counted by policy run and some columns: by ``("task",)``, for example,
    ``{(run, "StopCube"): {"episodes": 50, "heard": 44, "cut": 6}}``. A policy run that declares no
    limit of its prompt is left out, as nothing is known of any prompt.
    """
    counts_by_key: defaultdict[Key, HeardCounts] = defaultdict(Counter)
    runs_with_limit = set()
    for run, *values, prompt, outcome in rows_of(frame, "run", *by, "prompt", "outcome"):
        if outcome in UNPLAYED:
            continue
        # Adds 1 to both: all episodes, and those with this prompt (heard, cut or unknown).
        counts_by_key[run, *values].update(("episodes", prompt))
        if prompt != "unknown":
            runs_with_limit.add(run)
    return {key: counts for key, counts in counts_by_key.items() if key[0] in runs_with_limit}


def heard_notes(frame: Frame, names: RunNames) -> list[str]:
    """Return sentences on policies that did not read all words, or guessed a goal without them.

    Prompts count that were cut at the limit of the policy's model, and those that may have been.
    """
    counts = count_heard(frame, ())
    played = frame.take(frame.is_played)
    episodes = Counter(played["run"])
    guesses = Counter(itertools.compress(frame["run"], frame["guessed"]))
    notes = []
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
    """Return the share of prompts that were cut in percent, the mean over tasks: ``12``.

    If it is unknown whether some were cut, the least and the largest possible share: ``12–20``.

    Args:
        tasks: numbers of prompts of each task: all ``episodes``, ``cut`` and ``unknown``.
    """
    cut = Fraction(0)
    perhaps_cut = Fraction(0)
    for counts in tasks:
        cut += Fraction(counts["cut"], counts["episodes"])
        perhaps_cut += Fraction(counts["unknown"], counts["episodes"])
    return percent_range(cut / len(tasks), (cut + perhaps_cut) / len(tasks))
