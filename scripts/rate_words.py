"""Turn filled-in rating sheets into the table of docs/validity.md.

``python scripts/rate_words.py key.csv sheet-1.csv sheet-2.csv sheet-3.csv`` prints a row for each
setting: the mean of all ratings with its 95 % interval over frames; the frame that rates worst; and
how well the raters agree. ``roboirg language sample`` writes key and sheets.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import typer
from written_parts import table

from roboirg.stats.intervals import TOO_FEW, interval_of_values

LOWEST = 1
HIGHEST = 5
NUMBERS = ("texts", "rated")
HEADS = ("words", *NUMBERS, "95 % interval", "worst frame")


def read_key(path: Path) -> pd.DataFrame:
    """Return what the numbers of texts, the index, stand for."""
    return pd.read_csv(path, index_col="number", keep_default_na=False)


def read_ratings(path: Path, known: pd.Index[int]) -> pd.Series[float]:
    """Return the ratings of a sheet by number, in the order of the known numbers.

    Raises:
        SystemExit: it has other texts, or a rating is missing or odd.
    """
    sheet = pd.read_csv(path, index_col="number")
    if sorted(sheet.index) != sorted(known):
        raise SystemExit(f"{path} does not have the texts of the key, each once.")
    ratings = pd.to_numeric(sheet["rating"], errors="coerce").reindex(known)
    odd = ratings[~ratings.between(LOWEST, HIGHEST)].index
    if len(odd):
        numbers = ", ".join(map(str, odd))
        raise SystemExit(f"{path} needs a number from 1 to 5 as the rating of texts {numbers}.")
    return ratings


def interval(means: list[float]) -> str:
    """Return the 95 % interval of a mean over frames: ``4.1 to 4.7``."""
    found = interval_of_values([means], LOWEST, HIGHEST)
    if found is None:
        return TOO_FEW
    return f"{found.low:.1f} to {found.high:.1f}"


def rows(key: pd.DataFrame, ratings: pd.DataFrame) -> list[tuple[object, ...]]:
    """Return the cells of each setting; a text without a frame counts as one of its own.

    Args:
        key: as `read_key` returns it.
        ratings: with a column for each rater.
    """
    named = key["task"] + ": " + key["frame"]
    frames = named.where(key["frame"] != "", "text " + key.index.astype(str))
    of_frames = ratings.mean(axis=1).groupby([key["setting"], frames], sort=False).mean()
    found: list[tuple[object, ...]] = []
    for setting, means in of_frames.groupby(level=0):
        _, worst = means.idxmin()
        shown = f"{means.min():.1f} ({worst})"
        found.append((setting, len(means), f"{means.mean():.1f}", interval([*means]), shown))
    return found


def agreement(ratings: pd.DataFrame) -> str:
    """Return the mean correlation of two raters, who have a column each."""
    raters = len(ratings.columns)
    if raters == 1:
        return "One rater."
    pairs = np.triu_indices(raters, k=1)
    return f"Mean correlation of two raters: {ratings.corr().to_numpy()[pairs].mean():.2f}."


def main(key: Path, sheets: list[Path]) -> None:
    """Print the table of a key and of the sheets that raters filled in."""
    known = read_key(key)
    columns = [read_ratings(path, known.index) for path in sheets]
    ratings = pd.concat(columns, axis="columns")
    print(table(HEADS, rows(known, ratings), NUMBERS), "", agreement(ratings), sep="\n")


if __name__ == "__main__":
    typer.run(main)
