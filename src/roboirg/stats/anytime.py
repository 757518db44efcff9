"""Evidence from paired scenes that holds however often one looked, and when to stop for it.

A p-value of a fixed number of scenes is wrong if somebody looks after every scene and stops when
it suits him. The evidence here is what a gambler has won who began with 1 and bets on the next
scene before he sees it. If nothing can be won on average, he multiplies his money by 20 in at most
5 % of all games, at whatever moment one looks (Ville, 1939). So 1 / (the largest winnings so far)
is a p-value at every moment.

Scenes come in a random order that does not depend on results. Their differences are those of two
policies, or of two instructions of one, in the same scene: from -1 to 1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from roboirg.stats.intervals import ALPHA, Interval
from roboirg.stats.paired_tests import holm

Numbers = NDArray[np.float64]

BETS = 64
"""Stakes among which the money is spread; more of them change results by less than 1 %."""
_HALVINGS = 20
"""Of the range in which an end of an interval is searched."""
_ROUNDING = 1e-9
"""Sums of shares that differ by less are equal."""

Finding = Literal["first", "second", "within", "undecided", "open"]
"""What the scenes so far say: the first or the second is better; they differ by less than the
margin; neither although all scenes are known; neither yet."""


class PairedScenes(NamedTuple):
    """Two sides in the scenes of a plan, in its random order. All scenes of the plan have a place.

    Attributes:
        differences: (known,) of the first scenes of the order: success of the first side less that
            of the second, -1 to 1; NaN in a scene that is left out, as a side is not played there
            or ended in an error.
        weights: (places,) by how much each scene counts in the mean difference; 0 in a scene in
            which a side is not planned. Their sum is the number of planned scenes.
    """

    differences: Numbers
    weights: Numbers

    @property
    def planned(self) -> int:
        """The number of scenes in which both sides are planned."""
        return int(np.count_nonzero(self.weights))

    @property
    def known(self) -> int:
        """The number of scenes with results of both sides."""
        return int(np.isfinite(self.differences).sum())

    @property
    def is_even(self) -> bool:
        """Whether all planned scenes count alike, as tasks have equally many."""
        planned = self.weights[self.weights > 0]
        return not len(planned) or bool(np.allclose(planned, planned[0]))

    @property
    def better(self) -> Literal["first", "second"]:
        """The side with more successes, which the test is about; the second if they are equal."""
        return "first" if np.nansum(self.differences) > 0 else "second"

    def first(self, places: int) -> PairedScenes:
        """Return what was known after so many places of the order."""
        return PairedScenes(self.differences[:places], self.weights)


class SequentialDecision(NamedTuple):
    """What the scenes say about two sides, up to the place of the order where it was decided.

    Attributes:
        finding: which side is better, if any.
        places: of the random order that count; while it is open, those that were looked at.
        scenes: of these, how many have results of both sides.
        p_holm: p-value of the hypothesis that the two could be swapped in every scene, after Holm's
            correction over all decisions of the plan; holds at any time.
    """

    finding: Finding
    places: int
    scenes: int
    p_holm: float


def decide(
    contrasts: Sequence[PairedScenes], alpha: float = ALPHA, margin: float = 0.0
) -> list[SequentialDecision]:
    """Look after every scene, and close each contrast when it is decided; return what was found.

    A look needs the results of the scene in all open contrasts, so it waits for the slowest one.

    Args:
        contrasts: of one plan, with equally many places.
        alpha: level of Holm's test over all contrasts.
        margin: a contrast is closed, too, if its mean difference is surely smaller, 0 to 1; 0 for
            never.
    """
    watched = [_WatchedContrast.of(pairs, alpha, margin) for pairs in contrasts]
    p_holm: Sequence[float] = [1.0] * len(watched)
    places = max((len(pairs.weights) for pairs in contrasts), default=0)
    for place in range(places):
        still_open = [contrast for contrast in watched if contrast.finding == "open"]
        if any(place >= len(contrast.p_path) for contrast in still_open):
            break  # not all of them know this scene
        for contrast in still_open:
            contrast.look(place)
        p_holm = holm([contrast.p_value for contrast in watched])
        for contrast, corrected in zip(watched, p_holm, strict=True):
            if contrast.finding == "open":
                contrast.close_if_decided(corrected <= alpha, place + 1 == places)

    decisions = []
    for contrast, corrected in zip(watched, p_holm, strict=True):
        scenes = contrast.pairs.first(contrast.places).known
        decisions.append(SequentialDecision(contrast.finding, contrast.places, scenes, corrected))
    return decisions


@dataclass
class _WatchedContrast:
    """A contrast while its scenes are looked at one by one.

    Attributes:
        pairs: its scenes.
        p_path: p-value after each scene that is known.
        within_path: whether its difference is surely within the margin then.
        finding: so far.
        places: that were looked at.
        p_value: at the last look.
    """

    pairs: PairedScenes
    p_path: Numbers
    within_path: NDArray[np.bool_]
    finding: Finding = "open"
    places: int = 0
    p_value: float = 1.0

    @classmethod
    def of(cls, pairs: PairedScenes, alpha: float, margin: float) -> Self:
        return cls(pairs, p_path(pairs.differences), within_path(pairs, margin, alpha))

    def look(self, place: int) -> None:
        """Look at the scene at a place of the order."""
        self.places = place + 1
        self.p_value = float(self.p_path[place])

    def close_if_decided(self, is_shown: bool, is_last: bool) -> None:
        """Close the contrast after a look, if there is a reason.

        Args:
            is_shown: whether the corrected test shows a difference.
            is_last: whether no scene is left.
        """
        if is_shown:
            self.finding = self.pairs.first(self.places).better
        elif self.within_path[self.places - 1]:
            self.finding = "within"
        elif is_last:
            self.finding = "undecided"


def scene_weights(sizes: Mapping[str, int]) -> dict[str, float]:
    """Return by how much a scene of each task counts, so that the mean is that over tasks.

    For one task of 1 scene and one of 9 these are 5 and 10/18; over all scenes they add up to 10.

    Args:
        sizes: of each task, how many scenes are planned.
    """
    scenes = sum(sizes.values())
    return {task: scenes / (len(sizes) * size) for task, size in sizes.items()}


def mean_difference(seen: PairedScenes) -> float:
    """Return the weighted mean of the differences that are known, -1 to 1; 0 without any.

    A task of which half as many scenes are known as of another one counts half as much. So it may
    differ from the mean over tasks, which would leave out a task without a known scene.
    """
    has_result = np.isfinite(seen.differences)
    if not has_result.any():
        return 0.0
    weights = seen.weights[: len(seen.differences)][has_result]
    return float(np.average(seen.differences[has_result], weights=weights))


def p_path(differences: Numbers) -> Numbers:
    """Return the p-value after each scene: 1 / (the largest winnings so far), at most 1.

    Args:
        differences: (..., n) from -1 to 1; NaN in scenes that are left out.
    """
    most = np.maximum.accumulate(sign_winnings(np.nan_to_num(differences)), axis=-1)
    return np.asarray(1 / np.maximum(most, 1.0))


def p_in_any_order(differences: Numbers) -> float:
    """Return the p-value of scenes that became known in another order, such as task by task.

    The winnings are the same in every order, but how high they once were is not. So this is
    1 / (the winnings now): it may rise again, and holds however often one looked.

    Args:
        differences: (n,) from -1 to 1.
    """
    if not len(differences):
        return 1.0
    return float(1 / max(sign_winnings(differences)[-1], 1.0))


def sign_winnings(differences: Numbers) -> Numbers:
    """Return the winnings after each scene of bets on the sign of its difference.

    If the two could be swapped in every scene, a stake wins as often as it loses. Of differences of
    -1, 0 and 1 this is the mixture of sign tests over the scenes in which one side alone succeeds.

    Args:
        differences: (..., n) from -1 to 1.
    """
    # A stake of 0.5 turns 1 into 1.5 at a difference of 1, and into 0.5 at one of -1. Stakes are
    # the quantiles of Beta(2, 2), stretched to -1 to 1. Chosen by simulation: it decides more games
    # than Beta(1/2, 1/2), which decides clear ones a little earlier.
    quantiles = (np.arange(BETS) + 0.5) / BETS
    stakes = -2 * np.sin(np.arcsin(1 - 2 * quantiles) / 3)
    return _mixed_winnings(differences, stakes)


def within_path(pairs: PairedScenes, margin: float, alpha: float = ALPHA) -> NDArray[np.bool_]:
    """Return after each scene whether the mean difference over all is surely below a margin.

    Args:
        pairs: in the order of the plan.
        margin: between 0 and 1; the mean difference must be nearer to 0.
        alpha: share of games in which this may be wrong at some moment.
    """
    shares, scale = _shares(pairs)
    lowest = (1 - margin / scale) / 2
    is_below = winnings_above(lowest, 1 - shares, pairs.planned) >= 2 / alpha
    is_above = winnings_above(lowest, shares, pairs.planned) >= 2 / alpha
    path = np.logical_or.accumulate(is_below) & np.logical_or.accumulate(is_above)
    # Of each place the look after the last scene with a result.
    scenes = np.cumsum(np.isfinite(pairs.differences))
    before_any = np.concatenate([[False], path])
    return np.asarray(before_any[scenes])


def mean_bounds(pairs: PairedScenes, alpha: float = ALPHA) -> Interval:
    """Return where the weighted mean difference of all planned scenes lies, given the first ones.

    An end is the mean at which bets against it, on scenes drawn without putting back, have at some
    moment won 2 / alpha (Waudby-Smith and Ramdas, 2020). When all scenes are known, both ends are
    the mean.

    Args:
        pairs: in the order of the plan.
        alpha: share of games in which the mean may be outside at some moment.
    """
    shares, scale = _shares(pairs)
    low = _lowest_mean(shares, pairs.planned, alpha / 2)
    high = max(low, 1 - _lowest_mean(1 - shares, pairs.planned, alpha / 2))
    return Interval(scale * (2 * low - 1), scale * (2 * high - 1))


def _shares(pairs: PairedScenes) -> tuple[Numbers, float]:
    """Return the weighted differences of scenes with results as numbers from 0 to 1, and a scale.

    A share of 0.5 is no difference. A mean share of m stands for a mean difference of
    scale · (2 m - 1).
    """
    scale = float(pairs.weights.max(initial=1.0))
    weighted = pairs.weights[: len(pairs.differences)] * pairs.differences
    return (1 + weighted[np.isfinite(weighted)] / scale) / 2, scale


def _lowest_mean(shares: Numbers, planned: int, alpha: float) -> float:
    """Return the least mean of all scenes that bets on more do not rule out.

    Args:
        shares: (n,) from 0 to 1, of the first scenes.
        planned: the number of all.
        alpha: bets that win 1 / alpha rule a mean out.
    """
    known = float(shares.sum())
    # What is not known yet may be 0 everywhere, or 1.
    low = known / max(planned, 1)
    high = (known + planned - len(shares)) / max(planned, 1)
    if winnings_above(low, shares, planned).max(initial=1.0) < 1 / alpha:
        return low
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        if winnings_above(middle, shares, planned).max(initial=1.0) >= 1 / alpha:
            low = middle
        else:
            high = middle
    return low


def winnings_above(mean: float | Numbers, shares: Numbers, planned: int) -> Numbers:
    """Return the winnings after each scene of bets that scenes have more than a mean.

    They are endless once more was seen than there can be with that mean.

    Args:
        mean: of all scenes, from 0 to 1; or (..., 1), one for each game.
        shares: (..., n) from 0 to 1, of the first scenes.
        planned: the number of all.
    """
    seen = np.cumsum(shares, axis=-1)
    left = planned - np.arange(shares.shape[-1])
    # The mean of the scenes that are left, if that of all is right.
    expected = np.maximum(planned * mean - (seen - shares), 0.0) / left
    gains = np.divide(shares, expected, out=np.ones_like(shares), where=expected > 0)
    stakes = (np.arange(BETS) + 0.5) / BETS
    winnings = _mixed_winnings(gains - 1, stakes)
    winnings[seen > planned * mean + _ROUNDING] = math.inf
    return winnings


def _mixed_winnings(gains: Numbers, stakes: Numbers) -> Numbers:
    """Return the winnings after each scene, with the money spread evenly over the stakes.

    Args:
        gains: (..., n) what a scene adds to a stake of 1; at least -1.
        stakes: parts of the money that are bet on each scene.
    """
    with np.errstate(divide="ignore", over="ignore"):  # nothing is left, or more than can be said
        logarithms = np.cumsum(np.log1p(gains[..., np.newaxis] * stakes), axis=-2)
        return np.asarray(np.exp(logarithms).mean(axis=-1))
