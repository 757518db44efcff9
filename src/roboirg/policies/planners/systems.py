"""Systems: configurations of a policy and an optional planner, such as the paper's six."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from pydantic import BaseModel, ConfigDict

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.policy_ref import HANDS
from roboirg.policies.contract.option_checking import check_options
from roboirg.policies.contract.policy_urls import is_url, split_url
from roboirg.policies.vlm.models import ModelOptions

PACKAGE, FOLDER = "roboirg.policies.planners", "system_files"
SUFFIX = ".toml"

SERVER, VLM, POLICY = "server", "vlm", "policy."


class System(BaseModel):
    """A system to evaluate.

    Attributes:
        name: as on the command line.
        policy: spec of the low-level policy.
        planner: ``kind`` and options of its planner, or None.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    policy: str
    planner: dict[str, Any] | None = None


def all_systems() -> tuple[str, ...]:
    """Return the names of the systems in this package."""
    names = (one.name for one in resources.files(PACKAGE).joinpath(FOLDER).iterdir())
    return tuple(sorted(name.removesuffix(SUFFIX) for name in names if name.endswith(SUFFIX)))


def find_system(name_or_file: str, overrides: Mapping[str, str]) -> System:
    """Load the configuration of a system.

    Args:
        name_or_file: a name such as ``GroundSG-QwenVL``, or a TOML file with the same entries.
        overrides: ``server`` (host:port of the policy), ``policy.OPTION``, ``hands`` (``scripted``,
            or the spec of a policy that follows subgoals, instead of its own), ``vlm`` (URL of the
            planner's model), and options of the planner and its model.

    Raises:
        UnknownNameError: there is no such system or option.
        InvalidValueError: the file cannot be read, or an option has an invalid value.
    """
    file: Path | Traversable = Path(name_or_file)
    if name_or_file in all_systems():
        file = resources.files(PACKAGE).joinpath(FOLDER, f"{name_or_file}{SUFFIX}")
    elif not name_or_file.endswith(SUFFIX):
        raise UnknownNameError("system", name_or_file, [*all_systems(), f"FILE{SUFFIX}"])
    try:
        entries = tomllib.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:  # not Unicode, or not TOML
        raise InvalidValueError(
            f"System {name_or_file!r} cannot be read as TOML ({error})."
        ) from error
    origin = f"system {name_or_file}"
    system = check_options(System, entries, origin)
    policy = system.policy
    planner = system.planner
    own = {"base_url" if option == VLM else option: value for option, value in overrides.items()}
    for option in [one for one in own if one == SERVER or one.startswith(POLICY)]:
        policy = _policy_with(policy, option, own.pop(option), origin)
    if planner is not None:
        policy = own.pop(HANDS, policy)
        planner = with_options(planner, own)
    elif own:
        known = [SERVER, f"{POLICY}OPTION"]
        raise UnknownNameError(f"option of {origin}, which has no planner,", min(own), known)
    return System(name=system.name, policy=policy, planner=planner)


def with_options(planner: Mapping[str, Any], options: Mapping[str, str]) -> dict[str, Any]:
    """Return a planner's entries with options set; those of its model stand next to the others."""
    of_model = {name: value for name, value in options.items() if name in ModelOptions.model_fields}
    own = {name: value for name, value in options.items() if name not in of_model}
    model = {**planner.get("model", {}), **of_model}
    return {**planner, **own, **({"model": model} if model else {})}


def _policy_with(spec: str, option: str, value: str, origin: str) -> str:
    """Return a policy's URL with another server or another option."""
    if not is_url(spec):
        raise InvalidValueError(
            f"Option {option!r}: the policy of {origin} is {spec!r}, which is not a URL."
        )
    url = split_url(spec)
    place = url.target
    options = dict(url.options)
    if option == SERVER:
        place = value
    else:
        options[option.removeprefix(POLICY)] = value
    query = f"?{urlencode(options)}" if options else ""
    return f"{url.kind}://{place}{query}"
