"""Key events: moments at which objects move by themselves."""

from __future__ import annotations

from collections.abc import Sequence

from roboirg.core.motions import Away, Motion, Swap


class KeyEvents:
    """Reports, step by step, the objects that move by themselves.

    Args:
        motions: scripted motions of the scene.
    """

    def __init__(self, motions: Sequence[Motion]) -> None:
        self._swaps = [motion for motion in motions if isinstance(motion, Swap)]
        self._appearances: dict[int, list[str]] = {}
        for motion in motions:
            if isinstance(motion, Away) and motion.under is None:
                self._appearances.setdefault(motion.end + 1, []).append(motion.subject)
        self._stage_starts: dict[int, int] = {}

    def at(self, step: int, stage: int) -> str | None:
        """Return the event after a control step, or None; call for every step.

        Args:
            step: control steps since reset.
            stage: index of the current stage.
        """
        self._stage_starts.setdefault(stage, step)
        for swap in self._swaps:
            begin = 0 if swap.stage is None else self._stage_starts.get(swap.stage)
            # Halfway, they are farthest from the straight line.
            if begin is not None and step == begin + swap.start + swap.steps // 2 + 1:
                return f"{_plain(swap.first)} and {_plain(swap.second)} change places"
        names = self._appearances.get(step)
        if not names:
            return None
        return f"{', '.join(map(_plain, names))} {'appears' if len(names) == 1 else 'appear'}"


def _plain(name: str) -> str:
    return name.replace("_", " ")
