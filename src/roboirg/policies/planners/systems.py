"""Systems: configurations of a policy and an optional planner, such as the paper's six."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from importlib import resources
from importlib.abc import Traversable
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from pydantic import BaseModel, ConfigDict

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.policy_ref import HANDS
from roboirg.policies.contract.option_checking import check_options
from roboirg.policies.contract.policy_urls import is_url, split_url

PACKAGE, FOLDER = "roboirg.policies.planners", "system_files"
SUFFIX = ".toml"

SERVER, VLM, MODEL = "server", "vlm", "model"
POLICY, PLANNER = "policy.", "planner."
SHORTCUTS: Mapping[str, str] = {VLM: "planner.model.base_url", MODEL: "planner.model.model"}
"""Short names of options, and the entries that they set."""
OPTIONS = (SERVER, HANDS, *SHORTCUTS, "policy.OPTION", "planner.OPTION", "planner.model.OPTION")


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
    files = resources.files(PACKAGE).joinpath(FOLDER).iterdir()
    names = (one.name for one in files)
    return tuple(sorted(name.removesuffix(SUFFIX) for name in names if name.endswith(SUFFIX)))


def find_system(name_or_file: str, overrides: Mapping[str, str]) -> System:
    """Load the configuration of a system.

    Args:
        name_or_file: a name such as ``GroundSG-QwenVL``, or a TOML file with the same entries.
        overrides: ``server`` (host:port of the policy), ``vlm`` (URL of the planner's model),
            ``model`` (its name), ``hands`` (``scripted``, or the spec of a policy that follows
            subgoals, instead of its own), ``policy.OPTION``, ``planner.OPTION``,
            ``planner.model.OPTION``.

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
    except OSError as error:
        raise InvalidValueError(f"System {name_or_file!r} cannot be read ({error}).") from error
    except ValueError as error:  # not Unicode, or not TOML
        raise InvalidValueError(f"System {name_or_file!r} is not TOML ({error}).") from error
    origin = f"system {name_or_file}"
    return _overridden(check_options(System, entries, origin), overrides, origin)


def _overridden(system: System, overrides: Mapping[str, str], origin: str) -> System:
    policy, planner = system.policy, system.planner
    for option, value in overrides.items():
        entry = SHORTCUTS.get(option, option)
        if option == HANDS and planner is not None:
            policy = value
        elif option == SERVER or option.startswith(POLICY):
            policy = _policy_with(policy, option, value, origin)
        elif option != HANDS and not entry.startswith(PLANNER):
            raise UnknownNameError(f"option of {origin}", option, OPTIONS)
        elif planner is None:
            raise InvalidValueError(f"Option {option!r}: {origin} has no planner.")
        else:
            planner = _nested(planner, entry.removeprefix(PLANNER).split("."), value)
    return system.model_copy(update={"policy": policy, "planner": planner})


def _policy_with(spec: str, option: str, value: str, origin: str) -> str:
    """Return a policy's URL with another server or another option."""
    if not is_url(spec):
        raise InvalidValueError(
            f"Option {option!r}: the policy of {origin} is {spec!r}, which is not a URL."
        )
    url = split_url(spec)
    place = value if option == SERVER else url.place
    changed = {} if option == SERVER else {option.removeprefix(POLICY): value}
    query = urlencode({**url.options, **changed})
    return f"{url.scheme}://{place}" + (f"?{query}" if query else "")


def _nested(entries: Mapping[str, Any], path: list[str], value: str) -> dict[str, Any]:
    first, *rest = path
    if not rest:
        return {**entries, first: value}
    table = entries.get(first, {})
    return {**entries, first: _nested(table if isinstance(table, dict) else {}, rest, value)}
