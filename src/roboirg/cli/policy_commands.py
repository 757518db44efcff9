"""The commands about policies: serve one, and check one."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType
from typing import Annotated

import typer

from roboirg.cli.import_path import add_working_directory
from roboirg.core.errors import InvalidValueError

FAILED = 2
_STOPPED = {signal.SIGINT: 130, signal.SIGTERM: 143}
_LOOPBACK = "127.0.0.1"

PolicySpec = Annotated[str, typer.Argument(help="Built-in name, package.module:Class, or a URL.")]


def serve(
    policy: PolicySpec,
    protocol: Annotated[
        str, typer.Option(help="openpi, mme-vla, challenge or challenge+http.")
    ] = "mme-vla",
    host: Annotated[str, typer.Option(help="Address to listen at.")] = _LOOPBACK,
    port: Annotated[int, typer.Option(help="0 takes any that is free.")] = 8000,
    seed: Annotated[int, typer.Option(help="Of the policy's random choices.")] = 0,
    api_key_env: Annotated[
        str | None,
        typer.Option(help="Environment variable with the key that clients have to send."),
    ] = None,
) -> None:
    """Serve a policy to this benchmark and to any other client of the protocol."""
    from roboirg.policies.serving import open_server

    add_working_directory()
    key = None if api_key_env is None else os.environ.get(api_key_env)
    if api_key_env is not None and not key:
        raise InvalidValueError(f"The environment variable {api_key_env} holds no key.")
    server = open_server(policy, protocol, host, port, seed=seed, key=key)
    for number in _STOPPED:
        signal.signal(number, _stop)
    if host not in (_LOOPBACK, "localhost", "::1") and key is None:
        typer.echo(f"Whoever reaches {host} can use it: there is no --api-key-env.", err=True)
    typer.echo(f"{policy} at {server.url}; Ctrl-C stops.")
    server.listening.serve_forever()


def check_policy(
    policy: PolicySpec,
    seed: Annotated[int, typer.Option(help="Of the policy's random choices.")] = 0,
) -> None:
    """Check that a policy keeps the contract, on made-up observations; needs no simulator."""
    from rich.console import Console

    from roboirg.policies.policy_check import FAIL, print_check_results
    from roboirg.policies.policy_check import check_policy as check

    add_working_directory()
    findings = check(policy, seed=seed)
    print_check_results(findings, Console())
    if any(finding.verdict == FAIL for finding in findings):
        raise typer.Exit(FAILED)


def _stop(number: int, frame: FrameType | None) -> None:
    del frame
    # Connections may be in the middle of something that takes long; there is nothing to save.
    sys.stdout.flush()
    os._exit(_STOPPED[signal.Signals(number)])
