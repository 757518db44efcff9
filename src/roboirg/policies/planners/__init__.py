"""Planners, which name the next subgoal for a policy; made from a kind and options."""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping
from typing import Any

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
"""Import path of the class for each kind. A class says in ``options_type`` which options it has."""


def make_planner(kind: str, options: Mapping[str, Any], origin: str, seed: int = 0) -> Planner:
    """Return a new planner; its model, if it has one, is not connected yet.

    Args:
        kind: one of `PLANNERS`.
        options: of that kind, by name; values may be text, ``{"video_frames": "4"}``.
        origin: of the options, for error messages.
        seed: of its own random choices.

    Raises:
        UnknownNameError: there is no such planner, or it has no such option.
        InvalidValueError: an option has an invalid value.
    """
    check_names("planner", [kind], PLANNERS)
    planner_class = pkgutil.resolve_name(PLANNERS[kind])
    checked = check_options(planner_class.options_type, options, origin)
    planner: Planner = planner_class(checked, kind, seed)
    return planner
