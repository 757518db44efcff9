"""Planners, made from a kind and options."""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from roboirg.core.errors import check_names
from roboirg.policies.contract.option_checking import check_options
from roboirg.policies.planners.planner import Planner

_HERE = "roboirg.policies.planners"
_OF_GOALS = ("listener", "forgetful", "first-mention", "last-mention", "elimination", "surface")
OF_MODELS: Mapping[str, str] = {
    kind: f"{_HERE}.model_planners:{kind.title()}Planner"
    for kind in ("qwen", "gemini", "memer", "stateless")
}
"""Planners that query a model."""

PLANNERS: Mapping[str, str] = {
    "oracle": f"{_HERE}.oracle_planner:OraclePlanner",
    **dict.fromkeys(_OF_GOALS, f"{_HERE}.goal_planner:GoalPlanner"),
    **OF_MODELS,
}
"""Import paths of the classes; ``options_type`` is the type of a class's options."""


def make_planner(kind: str, options: Mapping[str, Any], origin: str, seed: int = 0) -> Planner:
    """Make a planner.

    Args:
        kind: one of `PLANNERS`.
        options: of that kind.
        origin: of the options, for error messages.
        seed: of its own random choices.

    Raises:
        UnknownNameError: there is no such planner, or it has no such option.
        InvalidValueError: an option has an invalid value.
    """
    checked = planner_options(kind, options, origin)
    planner: Planner = pkgutil.resolve_name(PLANNERS[kind])(checked, kind, seed)
    return planner


def planner_options(kind: str, options: Mapping[str, Any], origin: str) -> BaseModel:
    """Return the checked options of a planner; raises like `make_planner`."""
    check_names("planner", [kind], PLANNERS)
    options_type: type[BaseModel] = pkgutil.resolve_name(PLANNERS[kind]).options_type
    return check_options(options_type, options, origin)
