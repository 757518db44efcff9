"""Make policies from specs with a kind, such as ``system:…``, on the command line.

| spec | meaning |
| --- | --- |
| ``system:NAME?server=host:port&vlm=URL`` | a system of the paper, or of a file |
| ``vlm-listener:PROVIDER?model=NAME&base_url=URL`` | a model names the goal |
| ``learned:PATH`` | a listener that `roboirg learn listener` trained names the goal |
| ``people:FOLDER`` | people name the goal, in a study of `roboirg listen` |
| ``recorded:RUN?policy=NAME`` | the stored actions of a run |

Values that contain ``&`` or ``#`` are percent-encoded.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.policies.base import Policy
from roboirg.policies.option_checking import check_options
from roboirg.policies.planning.models import ModelOptions
from roboirg.policies.planning.vlm_listener import ListenerOptions, VLMListener
from roboirg.policies.policy_urls import parse_query
from roboirg.policies.requirements import (
    wanted_actions,
    wanted_calibration,
    wanted_cameras,
    wanted_demonstration_frames,
    wanted_depth,
    wanted_history,
    wanted_history_cameras,
    wanted_lower_case,
    wanted_prompt_added,
    wanted_prompt_tokens,
    wanted_tokenizer,
)

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

SYSTEM = "system"
LISTENER = "vlm-listener"
LEARNED = "learned"
PEOPLE = "people"
RECORDED = "recorded"

Build = Callable[[int], Policy]


class PolicyFactory:
    """Makes policies, and has the attributes of a class of such policies.

    Args:
        spec: names the policies.
        build: makes a policy from a seed, without network or the libraries of providers.
        sample: a policy that `build` made.
    """

    def __init__(self, spec: str, build: Build, sample: Policy) -> None:
        self.spec, self._build = spec, build
        self.__name__ = spec
        self.cameras = wanted_cameras(sample)
        self.actions = wanted_actions(sample).name
        self.demonstration_frames = wanted_demonstration_frames(sample)
        self.observe_every = wanted_history(sample)
        self.history_cameras = wanted_history_cameras(sample)
        self.depth = wanted_depth(sample)
        self.calibration = wanted_calibration(sample)
        self.prompt_tokens = wanted_prompt_tokens(sample)
        self.prompt_added = wanted_prompt_added(sample)
        self.tokenizer = wanted_tokenizer(sample)
        self.lowers_prompt = wanted_lower_case(sample)
        self.grounded = bool(getattr(sample, "grounded", False))
        self.version = str(getattr(sample, "version", "unknown"))

    def __call__(self, seed: int = 0) -> Policy:
        """Make a fresh policy."""
        return self._build(seed)


class PrivilegedPolicyFactory(PolicyFactory):
    """Makes privileged policies; having ``attach`` declares it."""

    def attach(self, env: RoboIRGEnv) -> None:
        """Raise TypeError: only the policies themselves can be attached."""
        raise TypeError(f"{self.spec} makes policies; call attach({env}) on one of those.")


def find_policy_factory(spec: str) -> PolicyFactory | None:
    """Return the factory of a spec; None if the spec is of another kind.

    Needs neither a network nor a provider's client library.

    Raises:
        UnknownNameError: there is no such system, provider or option.
        InvalidValueError: an option is missing or has an invalid value.
    """
    kind, colon, rest = spec.partition(":")
    if not colon or kind not in BUILDERS:
        return None
    name, _, query = rest.partition("?")
    build = BUILDERS[kind](spec, name, parse_query(spec, query))
    sample = build(0)
    made = PrivilegedPolicyFactory if hasattr(sample, "attach") else PolicyFactory
    return made(spec, build, sample)


def _system(spec: str, name: str, options: Mapping[str, str]) -> Build:
    from roboirg.policies.planning.systems import build_system, find_system

    if not name:
        raise InvalidValueError(f"Policy {spec!r} names no system.")
    system = find_system(name, options)
    return lambda seed: build_system(system, seed)


def _listener(_spec: str, name: str, options: Mapping[str, str]) -> Build:
    """Return the builder of a VLM listener; its options and its model's stand side by side."""
    own = [option for option in ListenerOptions.model_fields if option != "model"]
    of_model = [option for option in ModelOptions.model_fields if option != "provider"]
    for option in options:
        if option not in (*own, *of_model):
            raise UnknownNameError(f"option of {LISTENER}:", option, [*own, *of_model])
    values: dict[str, Any] = {key: value for key, value in options.items() if key in own}
    model: dict[str, Any] = {key: value for key, value in options.items() if key not in own}
    origin = f"policy {LISTENER}:{name}"
    values["model"] = check_options(ModelOptions, {"provider": name, **model}, origin)
    checked = check_options(ListenerOptions, values, origin)
    return lambda seed: VLMListener(checked, seed)


def _learned(spec: str, name: str, options: Mapping[str, str]) -> Build:
    from roboirg.policies.learned.learned_listener import LearnedListener

    for option in options:
        raise UnknownNameError(f"option of {LEARNED}:", option, [])
    if not name:
        raise InvalidValueError(f"Policy {spec!r} names no file.")
    return lambda seed: LearnedListener(Path(name), seed)


def _people(spec: str, name: str, options: Mapping[str, str]) -> Build:
    from roboirg.policies.builtin.people_listener import PeopleListener

    if not name or options:
        raise InvalidValueError(f"Policy {spec!r} is not people:FOLDER, the folder of a study.")
    return lambda seed: PeopleListener(Path(name), seed)


def _recorded(spec: str, name: str, options: Mapping[str, str]) -> Build:
    from roboirg.policies.builtin.recorded_policy import RecordedPolicy

    for option in options.keys() - {"policy"}:
        raise UnknownNameError(f"option of {RECORDED}:", option, ["policy"])
    if not name:
        raise InvalidValueError(f"Policy {spec!r} names no folder of a run.")
    return lambda _seed: RecordedPolicy(Path(name), options.get("policy"))


BUILDERS: Mapping[str, Callable[[str, str, Mapping[str, str]], Build]] = {
    SYSTEM: _system,
    LISTENER: _listener,
    LEARNED: _learned,
    PEOPLE: _people,
    RECORDED: _recorded,
}
