"""When things that move by themselves are worth a look."""

from __future__ import annotations

from collections.abc import Sequence

from roboirg.core.motions import Away, Motion, Swap


class KeyEvents:
    """Tells, step by step, what is moving by itself.

    Args:
        motions: of the scene.
    """

    def __init__(self, motions: Sequence[Motion]) -> None:
        self._swaps = [motion for motion in motions if isinstance(motion, Swap)]
        self._comings: dict[int, list[str]] = {}
        for motion in motions:
            if isinstance(motion, Away) and motion.under is None:
                self._comings.setdefault(motion.end + 1, []).append(motion.subject)
        self._begun: dict[int, int] = {}

    def at(self, step: int, stage: int) -> str | None:
        """What happens at the picture after a control step; None if nothing remarkable does.

        Args:
            step: control steps since reset; to be called for each.
            stage: index of the stage that is due.
        """
        self._begun.setdefault(stage, step)
        for swap in self._swaps:
            begin = 0 if swap.stage is None else self._begun.get(swap.stage)
            # Half way through, they are farthest from the straight line.
            if begin is not None and step == begin + swap.start + swap.steps // 2 + 1:
                return f"{_plain(swap.first)} and {_plain(swap.second)} change places"
        names = self._comings.get(step)
        return (
            f"{', '.join(map(_plain, names))} appear" + "s" * (len(names) == 1) if names else None
        )


def _plain(name: str) -> str:
    return name.replace("_", " ")
