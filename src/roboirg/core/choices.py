"""The choices of RoboMME's multi-choice mode: motions by a letter and perhaps a point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from roboirg.core.actions import CHOICE, CheckedActions
from roboirg.core.episode import Primitive
from roboirg.core.errors import InvalidActionError


class Choice(NamedTuple):
    """One motion that can be chosen.

    Attributes:
        label: its letter, from a.
        action: the motion in words.
        primitives: the motion, with the kind of object in place of what a point or the hand
            decides; of waiting, one for each checkpoint.
        kind: of the objects that a point can mean; None if the choice needs no point.
    """

    label: str
    action: str
    primitives: tuple[Primitive, ...]
    kind: str | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return what a program is given, as in RoboMME."""
        return {
            "label": self.label,
            "action": self.action,
            "need_parameter": self.kind is not None,
        }


def check_choices(actions: CheckedActions, choices: Sequence[Choice]) -> None:
    """Check that actions (n, 3) choose one of a task's choices, with a point where it needs one.

    An action is the number of a choice (0 is a), then row and column of the point, or -1, -1; see
    `roboirg.core.actions.CHOICE`. With two choices, ``[2, -1, -1]`` is an error.

    Raises:
        InvalidActionError: one does not; the message names the choices.
    """
    lowest = CHOICE.low[1:]
    highest = CHOICE.high[1:]
    for action in actions:
        number = action[0]
        if number not in range(len(choices)):
            listed = ", ".join(f"{choice.label} ({choice.action})" for choice in choices)
            raise InvalidActionError(
                f"Choice number {number:g} is not one of 0 to {len(choices) - 1}: {listed}."
            )
        chosen = choices[int(number)]
        if chosen.kind is None:
            continue
        point = action[1:]
        # Above -1, which stands for no point, so that 0 is the first row and column.
        is_inside = bool(((point > lowest) & (point <= highest)).all())
        if not is_inside:
            raise InvalidActionError(
                f"Choice {chosen.label} ({chosen.action}) needs the row and column of a point, "
                f"0 to {highest[0]:g}; got {point[0]:g}, {point[1]:g}."
            )
