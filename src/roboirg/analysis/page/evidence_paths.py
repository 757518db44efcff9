"""The evidence of a run that stops when it is decided, scene by scene, as lines on the page."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from roboirg.analysis.results.sources import Source
from roboirg.runs.plan.stopping import ComparedSides
from roboirg.stats.anytime import p_path

WIDTH = 600
HEIGHT = 120
"""Of a drawing; the page stretches it."""
_MOST = 1000.0
"""Evidence (1 / p) at the upper edge, in a logarithmic scale."""


class EvidencePath(NamedTuple):
    """A line that shows how the evidence on a comparison grew.

    Attributes:
        sentence: what was found.
        points: corners of the line as SVG writes them, ``0.0,120.0 12.0,80.5``, from left (no
            scene) to right (all planned scenes).
        mark: height at which a single comparison is decided, from above.
    """

    sentence: str
    points: str
    mark: float


def evidence_paths(sources: Iterable[Source]) -> Iterator[EvidencePath]:
    """Yield a line for each comparison of the runs that stop when they are decided."""
    for source in sources:
        if source.stopping is not None:
            for compared in source.stopping.compared:
                yield _path(compared)


def _path(compared: ComparedSides) -> EvidencePath:
    """Return the line of a comparison up to its last look."""
    seen = compared.pairs.first(compared.decision.places)
    has_result = np.isfinite(seen.differences)
    evidence = 1 / p_path(seen.differences)[has_result]
    corners = [f"0.0,{_height(1.0):.1f}"]
    for scene, value in enumerate(evidence, 1):
        left = WIDTH * scene / max(compared.planned, 1)
        corners.append(f"{left:.1f},{_height(float(value)):.1f}")
    return EvidencePath(compared.sentence, " ".join(corners), _height(1 / compared.rule.alpha))


def _height(evidence: float) -> float:
    """Return where an amount of evidence is drawn, from above: 1 at the foot."""
    share = min(np.log(evidence) / np.log(_MOST), 1.0)
    return float(HEIGHT * (1 - share))
