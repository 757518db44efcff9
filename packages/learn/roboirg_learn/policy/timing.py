"""When to act after waiting: what is learned of it from recordings, and the rule of a policy.

A look is a moment at which the front picture is looked at. A wait is a move that leaves the tool
where it is; the expert waits for the right moment with many of them in a row.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.sight import ExpertRecording
from roboirg_learn.policy.moves import NO_LABEL, STAY, decisions_of

WAIT_STEPS = 7
"""Control steps of one wait."""
MOST_STEPS_LEFT = 8 * WAIT_STEPS
"""Most control steps until the end of a wait that are learned; more count as this many."""
DUE_TIME = math.log1p(0.75)
"""A time left below which it is time to move: three quarters of a wait, as networks say times,
log(1 + control steps / `WAIT_STEPS`). Half a wait would be the nearest decision, but the times that
networks say are rather too long."""
MOVING_CUBE = "shuttle"
"""Class of a cube that goes back and forth over a target by itself."""
TARGET = "target"


def passes_so_far(recorded: ExpertRecording) -> NDArray[np.int64]:
    """Return how often the moving cube has passed the target at each of T looks: (T,).

    `NO_LABEL` everywhere if nothing moves by itself. The cube begins at an end of its way, and has
    passed the target when it is on the other side of it: 0, 0, 1, 1, 2, …
    """
    if MOVING_CUBE not in recorded.classes:
        return np.full(len(recorded.steps), NO_LABEL)
    places = recorded.things[:, :, :2]
    cube = places[:, recorded.classes.index(MOVING_CUBE)]
    target = places[:, recorded.classes.index(TARGET)]
    from_target = cube - target
    is_beyond = from_target @ from_target[0] < 0
    has_passed = np.diff(is_beyond, prepend=False)
    return has_passed.cumsum()


def steps_to_act(recorded: ExpertRecording) -> NDArray[np.int64]:
    """Return at each of T looks the control steps until the expert ends its wait: (T,).

    They count from the first of several waits to the decision that ends them, where they are 0, and
    are at most `MOST_STEPS_LEFT`; `NO_LABEL` where the expert does not wait, or never moves again.
    """
    steps_left = np.full(len(recorded.steps), NO_LABEL)
    next_move = None  # the look of the next decision that is no wait
    for decision in reversed(decisions_of(recorded)):
        if decision.move.turn != STAY:
            next_move = decision.look
        elif next_move is not None:
            wait = slice(decision.look, next_move + 1)
            steps_left[wait] = recorded.steps[next_move] - recorded.steps[wait]
    return steps_left.clip(max=MOST_STEPS_LEFT)


def timed_move(
    scores: NDArray[np.floating],
    is_wait: NDArray[np.bool_],
    time_left: float,
    *,
    was_waiting: bool,
) -> int:
    """Return the number of the next of M moves: the best one, unless it would come at a wrong time.

    A policy that neither waits nor is about to takes the best move. Any other takes the best that
    is no wait when it is time to move, less than `DUE_TIME` before the moment, and until then the
    best wait. With the scores 1, 2 and 3, of which the last is a wait, it is move 1 when it is time
    and else move 2, the wait.

    Args:
        scores: (M,) of the moves.
        is_wait: (M,) which of them are waits.
        time_left: until it is time to move, as of `BodyAnswer`.
        was_waiting: whether the last move was a wait.
    """
    best = scores.argmax()
    if not is_wait[best] and not was_waiting:
        return int(best)
    if time_left < DUE_TIME:
        allowed = ~is_wait
    else:
        allowed = is_wait
    return int(np.where(allowed, scores, -np.inf).argmax())
