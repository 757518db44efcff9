"""Turn filled-in rating sheets into the table of docs/validity.md.

``python scripts/rate_words.py key.csv sheet-1.csv sheet-2.csv sheet-3.csv`` prints a row for each
setting: the mean of all ratings with its 95 % interval over frames; the frame that rates worst; and
how well the raters agree. ``roboirg language sample`` writes key and sheets.
"""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import typer
from written_parts import table

from roboirg.stats.intervals import TOO_FEW, interval_of_values

LOWEST = 1
HIGHEST = 5
NUMBERS = ("texts", "rated")
HEADS = ("words", *NUMBERS, "95 % interval", "worst frame")


def read_key(path: Path) -> dict[str, dict[str, str]]:
    """Return what the numbers stand for."""
    with path.open(newline="", encoding="utf-8") as file:
        return {row["number"]: row for row in csv.DictReader(file)}


def read_ratings(path: Path, known: Mapping[str, object]) -> dict[str, float]:
    """Return the ratings of a sheet by number; complains about one that is missing or odd."""
    found: dict[str, float] = {}
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            number = row["number"]
            rating = row["rating"].strip()
            if number not in known:
                raise SystemExit(f"{path} rates text {number!r}, which the key does not have.")
            try:
                found[number] = float(rating)
            except ValueError:
                raise SystemExit(
                    f"{path} rates text {number} {rating!r}; it must be a number from 1 to 5."
                ) from None
            if not LOWEST <= found[number] <= HIGHEST:
                raise SystemExit(f"{path} rates text {number} {rating}; it must be 1 to 5.")
    missing = sorted(set(known) - set(found), key=int)
    if missing:
        raise SystemExit(f"{path} lacks the ratings of {', '.join(missing)}.")
    return found


def interval(means: Sequence[float]) -> str:
    """Return the 95 % interval of a mean over frames: ``4.1 to 4.7``."""
    found = interval_of_values([means], LOWEST, HIGHEST)
    if found is None:
        return TOO_FEW
    return f"{found.low:.1f} to {found.high:.1f}"


def rows(
    key: Mapping[str, Mapping[str, str]], sheets: Sequence[Mapping[str, float]]
) -> list[tuple[object, ...]]:
    """Return the cells of each setting."""
    found: list[tuple[object, ...]] = []
    for setting, frames in sorted(by_frame(key, sheets).items()):
        means = {frame: float(np.mean(ratings)) for frame, ratings in frames.items()}
        rated = float(np.mean(list(means.values())))
        worst = min(means, key=means.__getitem__)
        shown = f"{means[worst]:.1f} ({worst})"
        found.append((setting, len(means), f"{rated:.1f}", interval(list(means.values())), shown))
    return found


def by_frame(
    key: Mapping[str, Mapping[str, str]], sheets: Sequence[Mapping[str, float]]
) -> dict[str, dict[str, list[float]]]:
    """Return all ratings by setting and frame; a text without a frame stands alone."""
    found: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for number, text in key.items():
        frame = f"text {number}"
        if text["frame"]:
            frame = f"{text['task']}: {text['frame']}"
        found[text["setting"]][frame] += [sheet[number] for sheet in sheets]
    return found


def agreement(sheets: Sequence[Mapping[str, float]]) -> str:
    """Return the mean correlation of two raters."""
    if len(sheets) == 1:
        return "One rater."
    numbers = list(sheets[0])
    ratings = []
    for sheet in sheets:
        ratings.append([sheet[number] for number in numbers])
    correlations = np.corrcoef(ratings)
    pairs = np.triu_indices(len(sheets), k=1)
    return f"Mean correlation of two raters: {np.mean(correlations[pairs]):.2f}."


def main(key: Path, sheets: list[Path]) -> None:
    """Print the table of a key and of the sheets that raters filled in."""
    known = read_key(key)
    ratings = [read_ratings(path, known) for path in sheets]
    print(table(HEADS, rows(known, ratings), NUMBERS), "", agreement(ratings), sep="\n")


if __name__ == "__main__":
    typer.run(main)
