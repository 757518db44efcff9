"""Systems: a policy and mostly a planner, configured in TOML files, such as the paper's six."""

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
"""Options of a system: the policy's address, the URL of the planner's model, and what stands before
the policy's own options: ``policy.execute``."""


class System(BaseModel):
    """A low-level policy, and the planner that gives it subgoals.

    Attributes:
        name: as on the command line.
        policy: spec of the low-level policy, ``openpi://localhost:8000``.
        planner: ``kind`` and options of its planner, ``{"kind": "qwen", "video_frames": 4}``; None
            without a planner.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    policy: str
    planner: dict[str, Any] | None = None

    @property
    def planner_kind(self) -> str:
        """The planner's kind, or its class as ``package.module:Class``; empty without a planner."""
        return "" if self.planner is None else str(self.planner.get("kind", ""))

    @property
    def planner_options(self) -> dict[str, Any]:
        """The planner's entries besides its kind; empty without a planner."""
        options = dict(self.planner or {})
        options.pop("kind", None)
        return options


def all_systems() -> tuple[str, ...]:
    """Return the names of the systems in this package, such as ``GroundSG-QwenVL``, sorted."""
    names = []
    for file in resources.files(PACKAGE).joinpath(FOLDER).iterdir():
        if file.name.endswith(SUFFIX):
            names.append(file.name.removesuffix(SUFFIX))
    return tuple(sorted(names))


def find_system(name_or_file: str, overrides: Mapping[str, str]) -> System:
    """Return the system that a file configures, with some options replaced.

    ``"GroundSG-QwenVL", {"server": "localhost:8001", "video_frames": "4"}`` replaces the address of
    the policy, and an option of the planner.

    Args:
        name_or_file: a name such as ``GroundSG-QwenVL``, or a TOML file with the same entries.
        overrides: ``server`` (host:port of the policy), ``policy.OPTION``, ``hands`` (``scripted``,
            or the spec of a policy that follows subgoals, instead of its own), ``vlm`` (URL of the
            planner's model), and options of the planner and its model.

    Raises:
        UnknownNameError: there is no such system or option.
        InvalidValueError: the file cannot be read, or an option has an invalid value.
    """
    origin = f"system {name_or_file}"
    system = check_options(System, _read_entries(name_or_file), origin)

    # Each override changes the URL of the policy, or else the planner.
    policy = system.policy
    planner_overrides = {}
    for option, value in overrides.items():
        if option == SERVER or option.startswith(POLICY):
            policy = _policy_with(policy, option, value, origin)
        elif option == VLM:
            planner_overrides["base_url"] = value
        else:
            planner_overrides[option] = value

    planner = system.planner
    if planner is not None:
        # Other hands replace the whole policy, whatever its URL has become.
        policy = planner_overrides.pop(HANDS, policy)
        planner = with_options(planner, planner_overrides)
    elif planner_overrides:
        unknown = min(planner_overrides)
        known = [SERVER, f"{POLICY}OPTION"]
        raise UnknownNameError(f"option of {origin}, which has no planner,", unknown, known)
    return System(name=system.name, policy=policy, planner=planner)


def _read_entries(name_or_file: str) -> dict[str, Any]:
    """Return the entries of a system's TOML file, which is a path or a name in this package.

    ``{"name": "GroundSG-QwenVL", "policy": "mme-vla://...", "planner": {...}}``; not yet checked.
    """
    file: Path | Traversable = Path(name_or_file)
    if name_or_file in all_systems():
        file = resources.files(PACKAGE).joinpath(FOLDER, f"{name_or_file}{SUFFIX}")
    elif not name_or_file.endswith(SUFFIX):
        raise UnknownNameError("system", name_or_file, [*all_systems(), f"FILE{SUFFIX}"])
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:  # not Unicode, or not TOML
        raise InvalidValueError(
            f"System {name_or_file!r} cannot be read as TOML ({error})."
        ) from error


def with_options(planner: Mapping[str, Any], options: Mapping[str, str]) -> dict[str, Any]:
    """Return a planner's entries with options set.

    Options of its model, which are typed next to the others, go into its table ``model``:
    ``{"video_frames": "4", "temperature": "1"}`` sets ``video_frames`` and ``model.temperature``.
    """
    entries = dict(planner)
    model = dict(planner.get("model", {}))
    for name, value in options.items():
        if name in ModelOptions.model_fields:
            model[name] = value
        else:
            entries[name] = value
    if model:
        entries["model"] = model
    return entries


def _policy_with(spec: str, option: str, value: str, origin: str) -> str:
    """Return a policy's URL with another server or another option.

    Of ``openpi://a:1?execute=5``, the option ``server`` with ``b:2`` makes
    ``openpi://b:2?execute=5``, and ``policy.execute`` with ``8`` makes ``openpi://a:1?execute=8``.

    Args:
        spec: of the policy, which must be a URL.
        option: `SERVER`, or `POLICY` followed by the option's name.
        value: of it.
        origin: of the spec, for errors.
    """
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
