"""Serve a policy, given by name, in any protocol."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any, NamedTuple

from roboirg.core.errors import InvalidValueError, check_names
from roboirg.core.inference_facts import inference_facts
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.policy_ref import BUILT_IN, PolicyRef
from roboirg.policies.by_name.finding import make_policy, read_policy
from roboirg.policies.by_name.policy_classes import find_class
from roboirg.policies.by_name.policy_kinds import CLASS
from roboirg.policies.contract.json_values import as_json
from roboirg.policies.opening import opened
from roboirg.policies.remote.endpoints import Endpoint
from roboirg.policies.remote.protocols import Protocol, protocols_by_scheme
from roboirg.policies.remote.websocket_server import ServerOptions, WebsocketServer
from roboirg.util.web.request_origin import LOOPBACK


class PolicyServer(NamedTuple):
    """A server that listens.

    Attributes:
        listening: the server.
        url: names the policy for clients.
    """

    listening: WebsocketServer
    url: str


def open_server(
    spec: str,
    protocol: str = "mme-vla",
    options: ServerOptions | None = None,
    *,
    seed: int = 0,
) -> PolicyServer:
    """Serve a policy; every episode gets a fresh object with the same seed.

    Args:
        spec: of the policy, as for `roboirg.policies.make_policy`.
        protocol: a scheme of `roboirg.policies.remote.protocols.protocols_by_scheme`.
        options: where to listen, and whom to answer; by default any free port of loopback, and
            every client.
        seed: of the policy.

    Raises:
        UnknownNameError: there is no such policy or protocol.
        InvalidValueError: the policy is privileged, or the address cannot be used.
        MissingDependencyError: the protocol's network library is not installed.
    """
    options = options or ServerOptions()
    protocols = protocols_by_scheme()
    check_names("protocol", [protocol], protocols)
    service = protocols[protocol].service
    if service is None:
        raise InvalidValueError(f"{protocol}:// is for clients only: no policy is served with it.")
    policy = read_policy(spec)
    if policy.is_privileged:
        raise InvalidValueError(
            f"Policy {spec!r} is privileged: it reads the simulator in its own process, so it "
            "cannot be served."
        )

    if policy.is_foreign:
        policy = opened(policy, seed)
    if lacking := _lacking(policy.needs, protocols[protocol]):
        able = [
            one.name
            for one in protocols.values()
            if one.service and not _lacking(policy.needs, one)
        ]
        raise InvalidValueError(
            f"Policy {spec!r} declares {' and '.join(lacking)}, which {protocol} does not carry; "
            f"protocols that do: {', '.join(able) or 'none'}."
        )

    make = functools.partial(make_policy, policy, seed)
    listening = WebsocketServer(service(make), _metadata(policy, protocol), options)
    endpoint = Endpoint(options.host, listening.socket.getsockname()[1])
    return PolicyServer(listening, f"{protocol}://{endpoint}")


def _metadata(policy: PolicyRef, protocol: str) -> dict[str, Any]:
    """Return what a server reports of a policy and of this process."""
    process = inference_facts(None)
    declared = (
        getattr(find_class(policy.body), "metadata", {}) if policy.kind in (CLASS, BUILT_IN) else {}
    )
    has_metadata = isinstance(declared, Mapping)  # a property is of an object
    return {
        **as_json(declared if has_metadata else {}, "the policy's metadata"),
        "policy": policy.spec,
        "version": policy.version,
        "protocol": protocol,
        "python": process.python,
        "libraries": process.libraries,
    }


def _lacking(needs: PolicyNeeds | None, protocol: Protocol) -> list[str]:
    """Return what a policy declares and a protocol does not carry.

    Its client neither declares that itself nor has an option for it.
    """
    usual = PolicyNeeds()
    shown = PolicyNeeds.of(protocol.client(f"{protocol.name}://{LOOPBACK}:1"))
    return [
        name
        for name in ("depth", "calibration", "observe_every", "actions")
        if getattr(needs or usual, name) != getattr(usual, name) == getattr(shown, name)
        and name not in protocol.client.options_type.model_fields
    ]
