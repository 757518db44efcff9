"""Serve a policy, given by name, in any protocol."""

from __future__ import annotations

import functools
import os
import platform
import subprocess
from collections.abc import Mapping
from typing import NamedTuple

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.field_types import MOST_SECONDS
from roboirg.core.inference_facts import inference_facts
from roboirg.core.policy_ref import BUILT_IN
from roboirg.policies.by_name.finding import make_policy, read_policy
from roboirg.policies.by_name.policy_classes import find_class
from roboirg.policies.by_name.policy_kinds import CLASS
from roboirg.policies.contract.base import Policy
from roboirg.policies.contract.json_values import as_json
from roboirg.policies.opening import opened
from roboirg.policies.remote.endpoints import Endpoint
from roboirg.policies.remote.protocols import protocols_by_scheme
from roboirg.policies.remote.server_options import ServerOptions
from roboirg.policies.remote.transport import ListeningServer

_MAX_PORT = 65535
FLAG_VARIABLES = (
    "XLA_FLAGS",
    "JAX_DEFAULT_MATMUL_PRECISION",
    "CUBLAS_WORKSPACE_CONFIG",
    "NVIDIA_TF32_OVERRIDE",
    "TORCH_ALLOW_TF32_CUBLAS_OVERRIDE",
    "TF_DETERMINISTIC_OPS",
)
"""Environment variables that choose kernels or their precision."""
TIMEOUT_S = 30.0


class PolicyServer(NamedTuple):
    """A server that listens.

    Attributes:
        listening: the server.
        url: names the policy for clients.
    """

    listening: ListeningServer
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
    if protocol not in protocols:
        raise UnknownNameError("protocol", protocol, protocols)
    service = protocols[protocol].service
    if service is None:
        raise InvalidValueError(f"{protocol}:// is for clients only: no policy is served with it.")
    if not 0 <= options.port <= _MAX_PORT:
        raise InvalidValueError(f"The port is {options.port}; it must be 0 to {_MAX_PORT}.")
    if not 0 < options.timeout_s <= MOST_SECONDS:
        raise InvalidValueError(
            f"timeout_s is {options.timeout_s}; it must be more than 0 and at most "
            f"{MOST_SECONDS:,} seconds."
        )
    policy = read_policy(spec)
    if policy.is_privileged:
        raise InvalidValueError(
            f"Policy {spec!r} is privileged: it reads the simulator in its own process, so it "
            "cannot be served."
        )

    if policy.is_foreign:
        policy = opened(policy, seed)

    def make() -> Policy:
        return make_policy(policy, seed)

    found = protocols[protocol]
    process = inference_facts(None)
    declared = (
        getattr(find_class(policy.body), "metadata", {}) if policy.kind in (CLASS, BUILT_IN) else {}
    )
    has_metadata = isinstance(declared, Mapping)  # a property is of an object
    metadata = {
        **as_json(declared if has_metadata else {}, "the policy's metadata"),
        "policy": spec,
        "version": policy.version,
        "protocol": protocol,
        "python": process.python,
        "libraries": process.libraries,
        **describe_arithmetic(),
    }
    listen = found.clients[protocol].transport.load_server()
    try:
        listening = listen(service(make), metadata, options)
    except OSError as error:  # of another package's transport
        raise InvalidValueError(
            f"Cannot listen on {options.host}:{options.port} ({error})."
        ) from error
    endpoint = Endpoint(options.host, listening.socket.getsockname()[1])
    return PolicyServer(listening, f"{protocol}://{endpoint}")


def describe_arithmetic() -> dict[str, str]:
    """Return ``device``, ``driver`` if there is one, and ``flags`` if some are set."""
    flags = [f"{name}={os.environ[name]}" for name in FLAG_VARIABLES if os.environ.get(name)]
    return {**_device(), **({"flags": " ".join(flags)} if flags else {})}


@functools.cache
def _device() -> dict[str, str]:
    command = ["nvidia-smi", "--query-gpu=name,driver_version", "--format=csv,noheader"]
    try:
        told = subprocess.check_output(command, text=True, timeout=TIMEOUT_S)  # noqa: S603
    except (OSError, subprocess.SubprocessError):
        told = ""
    rows = [line.rpartition(", ") for line in told.splitlines()]
    if not rows:
        return {"device": f"{platform.machine()} processor"}
    names, drivers = ([row[end] for row in rows] for end in (0, 2))
    return {"device": ", ".join(names), "driver": drivers[0]}
