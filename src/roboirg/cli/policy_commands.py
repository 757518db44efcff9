"""Commands that serve and check a policy."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType
from typing import Annotated

import typer

from roboirg.cli.options import add_working_directory
from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.core.field_types import MOST_SECONDS
from roboirg.util.web.listening import TIMEOUT_S
from roboirg.util.web.request_origin import LOOPBACK, LOOPBACK_NAMES

_STOPPED = {signal.SIGINT: 130, signal.SIGTERM: 143}
"""Exit codes by the signal that ends a server."""

PolicySpec = Annotated[
    str,
    typer.Argument(
        help="Built-in name, package.module:Class, or a URL "
        "({roboirg.policies.by_name.policy_classes:url_forms})."
    ),
]


def serve(
    policy: PolicySpec,
    protocol: Annotated[
        str,
        typer.Option(
            help="Protocol of the clients: one of "
            "{roboirg.policies.remote.protocols:served_protocols}."
        ),
    ] = "mme-vla",
    host: Annotated[str, typer.Option(help="Address to listen on.")] = LOOPBACK,
    port: Annotated[int, typer.Option(help="Port to listen on; 0 for any free port.")] = 8000,
    seed: Annotated[int, typer.Option(help="Seed of the policy's random choices.")] = 0,
    api_key_env: Annotated[
        str | None,
        typer.Option(help="Environment variable with the key that clients must send."),
    ] = None,
    timeout_s: Annotated[
        float,
        typer.Option(
            min=1,
            max=MOST_SECONDS,
            help="Seconds for which a connection may be idle or a message may take to arrive.",
        ),
    ] = TIMEOUT_S,
) -> None:
    """Serve a policy to this benchmark and other clients of a protocol.

    Example: roboirg serve my_policy:MyPolicy --protocol openpi
    """
    from roboirg.policies.policy_server import open_server
    from roboirg.policies.remote.websocket_server import ServerOptions
    from roboirg.util.freed_memory import keep_freed_memory

    keep_freed_memory()
    add_working_directory()
    key = None
    if api_key_env is not None:
        key = os.environ.get(api_key_env)
        if not key:
            raise InvalidValueError(f"The environment variable {api_key_env} holds no key.")
    options = ServerOptions(host, port, key, timeout_s)
    server = open_server(policy, protocol, options, seed=seed)
    for number in _STOPPED:
        signal.signal(number, _stop)
    if host not in LOOPBACK_NAMES and key is None:
        typer.echo(
            f"Without --api-key-env, every client that reaches {host} can use the policy.", err=True
        )
    typer.echo(f"{policy} at {server.url}; press Ctrl-C to stop.")
    server.listening.serve_forever()
    # Only a signal ends it, and that ends the process.
    raise RoboIRGError(f"The server at {server.url} has stopped by itself.")


def _stop(number: int, frame: FrameType | None) -> None:
    """End this process at a signal."""
    del frame
    # A connection may be in the middle of a long call; there is nothing to save.
    sys.stdout.flush()
    os._exit(_STOPPED[signal.Signals(number)])
