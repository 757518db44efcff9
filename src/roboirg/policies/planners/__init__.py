"""Planners, one file each, made from a kind and options."""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from roboirg.core.errors import UnknownNameError
from roboirg.policies.contract.option_checking import check_options
from roboirg.policies.planners.planner import Planner

PLANNERS: Mapping[str, str] = {
    "oracle": "roboirg.policies.planners.oracle_planner:OraclePlanner",
    "qwen": "roboirg.policies.planners.qwen:QwenPlanner",
    "gemini": "roboirg.policies.planners.gemini:GeminiPlanner",
    "memer": "roboirg.policies.planners.memer:MemerPlanner",
}
"""Import paths of the classes, whose attribute ``options_type`` is the type of their options."""


def make_planner(kind: str, options: Mapping[str, Any], origin: str) -> Planner:
    """Make a planner.

    Args:
        kind: one of `PLANNERS`.
        options: of that kind.
        origin: of the options, for error messages.

    Raises:
        UnknownNameError: there is no such planner, or it has no such option.
        InvalidValueError: an option has an invalid value.
    """
    if kind not in PLANNERS:
        raise UnknownNameError("planner", kind, PLANNERS)
    planner_class = pkgutil.resolve_name(PLANNERS[kind])
    options_type: type[BaseModel] = planner_class.options_type
    planner: Planner = planner_class(check_options(options_type, options, origin))
    return planner
