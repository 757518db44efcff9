"""Serve a policy, given by name, in any protocol."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from roboirg.core.errors import InvalidValueError, check_names
from roboirg.core.inference_facts import inference_facts
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.policy_ref import BUILT_IN, RESOLVE, PolicyRef
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
    if policy.kind == RESOLVE:
        raise InvalidValueError(
            f"Policy {spec!r} rewrites words next to the simulator, so it cannot be served; serve "
            f"the policy behind it, and name {RESOLVE}:…?policy=URL where it plays."
        )

    if policy.is_foreign:
        policy = opened(policy, seed)
    _check_carried(policy, protocols[protocol], protocols.values())

    make = functools.partial(make_policy, policy, seed)
    listening = WebsocketServer(service(make), _metadata(policy, protocol), options)
    endpoint = Endpoint(options.host, listening.socket.getsockname()[1])
    return PolicyServer(listening, f"{protocol}://{endpoint}")


def _metadata(policy: PolicyRef, protocol: str) -> dict[str, Any]:
    """Return what a server reports to its clients: of the policy, and of this process."""
    process = inference_facts(None)
    declared: object = {}
    if policy.kind in (CLASS, BUILT_IN):
        declared = getattr(find_class(policy.body), "metadata", {})
    if not isinstance(declared, Mapping):  # a property, which is of an object
        declared = {}
    return {
        **as_json(declared, "the policy's metadata"),
        "policy": policy.spec,
        "version": policy.version,
        "protocol": protocol,
        "python": process.python,
        "libraries": process.libraries,
    }


def _check_carried(policy: PolicyRef, protocol: Protocol, others: Iterable[Protocol]) -> None:
    """Raise if a protocol does not carry what a policy needs; the error names others that do."""
    needs = policy.needs or PolicyNeeds()
    lacking = _lacking(needs, protocol)
    if not lacking:
        return
    able = []
    for other in others:
        if other.service is not None and not _lacking(needs, other):
            able.append(other.name)
    raise InvalidValueError(
        f"Policy {policy.spec!r} declares {' and '.join(lacking)}, which {protocol.name} does not "
        f"carry; protocols that do: {', '.join(able) or 'none'}."
    )


def _lacking(needs: PolicyNeeds, protocol: Protocol) -> list[str]:
    """Return the needs of a policy that a protocol does not carry, such as ``["depth"]``.

    A protocol carries a need if its client declares more than the usual itself, or has an option
    of that name.
    """
    usual = PolicyNeeds()
    # A client is asked for its needs; nothing listens at this address, and none connects.
    of_client = PolicyNeeds.of(protocol.client(f"{protocol.name}://{LOOPBACK}:1"))
    options = protocol.client.options_type.model_fields
    lacking = []
    for name in ("depth", "calibration", "observe_every", "actions"):
        usual_value = getattr(usual, name)
        is_carried = name in options or getattr(of_client, name) != usual_value
        if not is_carried and getattr(needs, name) != usual_value:
            lacking.append(name)
    return lacking
