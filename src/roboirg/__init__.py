"""RoboIRGBench: does a robot policy understand people who do not spell everything out?"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from roboirg.core.version import __version__

if TYPE_CHECKING:
    from roboirg.analysis.measures.measure import measure
    from roboirg.analysis.run_results import results
    from roboirg.api.evaluate import evaluate
    from roboirg.envs.factory import make
    from roboirg.policies.by_name.finding import Privileged

__all__ = ["Privileged", "__version__", "evaluate", "make", "measure", "results"]

_HOMES = {
    "Privileged": "roboirg.policies.by_name.finding",
    "evaluate": "roboirg.api.evaluate",
    "make": "roboirg.envs.factory",
    "measure": "roboirg.analysis.measures.measure",
    "results": "roboirg.analysis.run_results",
}


def __getattr__(name: str) -> object:
    """Import what is asked for: the command must handle Ctrl-C before anything heavy is loaded."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)
