"""Turn filled-in rating sheets into the table of docs/validity.md.

``python scripts/rate_words.py key.csv sheet-1.csv sheet-2.csv sheet-3.csv`` prints a row for each
setting: the mean of all ratings with its 95 % interval, by a bootstrap over frames; the frame that
rates worst; and how well the raters agree. ``roboirg language sample`` writes key and sheets.
"""

from __future__ import annotations

import argparse
import csv
import itertools
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from roboirg.stats.intervals import without_spread

DRAWS = 10_000
LOWEST, HIGHEST = 1, 5
HEAD = "| words | texts | rated | 95 % interval | worst frame |\n| --- | ---: | ---: | --- | --- |"


def read_key(path: Path) -> dict[str, dict[str, str]]:
    """Return what the numbers stand for."""
    with path.open(newline="", encoding="utf-8") as file:
        return {row["number"]: row for row in csv.DictReader(file)}


def read_ratings(path: Path, known: Mapping[str, object]) -> dict[str, float]:
    """Return the ratings of a sheet by number; complains about one that is missing or odd."""
    found: dict[str, float] = {}
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            number, rating = row["number"], row["rating"].strip()
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


def interval(means: Sequence[float]) -> tuple[float, float]:
    """Return the 95 % interval of a mean by a bootstrap over frames.

    If all frames have the same mean, as many others may have any as for shares of 0 or 1.
    """
    mean, scale = float(np.mean(means)), HIGHEST - LOWEST
    if np.ptp(means) == 0:
        low, high = without_spread((mean - LOWEST) / scale, len(means))
        return LOWEST + scale * low, LOWEST + scale * high
    rng = np.random.default_rng(0)
    drawn = rng.choice(np.asarray(means), size=(DRAWS, len(means))).mean(axis=1)
    low, high = np.percentile(drawn, (2.5, 97.5))
    return float(low), float(high)


def rows(key: Mapping[str, Mapping[str, str]], sheets: Sequence[Mapping[str, float]]) -> list[str]:
    """Return a row for each setting."""
    groups: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for number, row in key.items():
        frame = f"{row['task']}: {row['frame']}" if row["frame"] else f"text {number}"
        groups[row["setting"]][frame] += [sheet[number] for sheet in sheets]
    found = []
    for setting, frames in sorted(groups.items()):
        means = {frame: float(np.mean(ratings)) for frame, ratings in frames.items()}
        low, high = interval(list(means.values()))
        worst = min(means, key=lambda frame: means[frame])
        found.append(
            f"| {setting} | {len(means)} | {np.mean(list(means.values())):.1f} | {low:.1f} to "
            f"{high:.1f} | {means[worst]:.1f} ({worst}) |"
        )
    return found


def agreement(sheets: Sequence[Mapping[str, float]]) -> str:
    """Return the mean correlation of two raters."""
    numbers = list(sheets[0])
    pairs = [
        np.corrcoef([one[at] for at in numbers], [other[at] for at in numbers])[0, 1]
        for one, other in itertools.combinations(sheets, 2)
    ]
    return f"Mean correlation of two raters: {np.mean(pairs):.2f}." if pairs else "One rater."


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("key", type=Path)
    parser.add_argument("sheets", type=Path, nargs="+")
    given = parser.parse_args()
    key = read_key(given.key)
    sheets = [read_ratings(path, key) for path in given.sheets]
    print(HEAD, *rows(key, sheets), "", agreement(sheets), sep="\n")


if __name__ == "__main__":
    main()
