"""The keyword arguments of `roboirg.make`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from roboirg.core.instruction_options import InstructionKeywords

if TYPE_CHECKING:
    # Not at run time: it loads NumPy, which `import roboirg` must not.
    from roboirg.core.observations import DemonstrationFrames


class EnvOptions(InstructionKeywords, total=False):
    """Keyword arguments of `make`, which documents them; `EnvSettings` has their defaults."""

    split: str
    episode: int | None
    arm: str
    actions: str
    cameras: Sequence[str]
    depth: bool
    calibration: bool
    grounded: bool
    demonstration_frames: DemonstrationFrames
    observe_every: int | None
    history_cameras: Sequence[str] | None
    meshes: str
    max_steps: int
    render_mode: str | None
