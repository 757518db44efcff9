"""Planners, one file each, and how a configuration becomes one."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from roboirg.core.errors import UnknownNameError
from roboirg.policies.planning.option_checking import check_options
from roboirg.policies.planning.planner import Planner

PLANNERS: Mapping[str, str] = {
    "oracle": "roboirg.policies.planning.planners.oracle_planner:OraclePlanner",
    "qwen": "roboirg.policies.planning.planners.qwen:QwenPlanner",
    "gemini": "roboirg.policies.planning.planners.gemini:GeminiPlanner",
    "memer": "roboirg.policies.planning.planners.memer:MemerPlanner",
}
"""Classes with ``options_type``, made with such options."""


def make_planner(kind: str, options: Mapping[str, Any], origin: str) -> Planner:
    """A planner.

    Args:
        kind: one of `PLANNERS`.
        options: of that kind.
        origin: where they are from, for complaints.

    Raises:
        UnknownNameError: there is no such planner, or it has no such option.
        InvalidValueError: an option has a value that it cannot have.
    """
    if kind not in PLANNERS:
        raise UnknownNameError("planner", kind, PLANNERS)
    module, _, name = PLANNERS[kind].partition(":")
    planner_class = getattr(importlib.import_module(module), name)
    options_type: type[BaseModel] = planner_class.options_type
    planner: Planner = planner_class(check_options(options_type, options, origin))
    return planner
