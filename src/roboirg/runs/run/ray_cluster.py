"""Play jobs on many machines with Ray.

Each remote worker is an actor that supervises a process of its own, as `LocalProcesses` does, so
that policies and simulator are isolated in the same way; the workers on a machine share its policy
hosts. `ray_pool` has the driver's loop, `ray_head` whether the cluster's head answers, and
`ray_machines` what runs on the machines.
"""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import socket
import sys
import threading
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.core.extras import extra_needed
from roboirg.policies.by_name.key_variables import check_variables
from roboirg.records.record import Job
from roboirg.runs.plan.plan_sections import WorkerNeeds
from roboirg.runs.play.rollout import PlayJob
from roboirg.runs.run.executor import NO_TIMEOUT_S, Records, Warn
from roboirg.runs.run.ray_pool import RayPool

CONNECT_S = 10.0


@dataclass(frozen=True, slots=True)
class RayCluster:
    """Plays jobs on a Ray cluster.

    Args:
        workers: most workers at a time; None for one on every CPU of the cluster, also of machines
            that join later.
        address: of the cluster, as for ``ray.init``; None joins the cluster that runs on this
            machine or starts one.
        episode_timeout_s: how long an episode may take.
        needs: what a worker reserves, and what it gets from here.

    Raises:
        InvalidValueError: fewer than one worker.
        MissingDependencyError: Ray is not installed.
    """

    workers: int | None = None
    address: str | None = None
    episode_timeout_s: float = NO_TIMEOUT_S
    needs: WorkerNeeds = field(default_factory=WorkerNeeds)

    def __post_init__(self) -> None:
        if self.workers is not None and self.workers < 1:
            raise InvalidValueError(f"workers is {self.workers}; Ray needs at least 1.")
        import_ray()

    def run(self, jobs: deque[Job], play: PlayJob, warn: Warn, /) -> Records:
        """Yield one record for each job as they finish.

        Raises:
            RoboIRGError: the cluster cannot be joined, is lost, has no free CPU, or none of its
                machines can play.
        """
        ray = import_ray()
        environment = _runtime_environment(self.needs)
        with _connected(ray, self.address, self.needs.working_dir):
            pool = RayPool(
                ray, play, self.episode_timeout_s, self.workers, self.needs, environment, warn
            )
            with contextlib.closing(pool):
                yield from pool.play_all(jobs)


def import_ray() -> ModuleType:
    """Return the module of Ray, which would send usage statistics to its developers.

    Raises:
        MissingDependencyError: it is not installed.
    """
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    with extra_needed("--executor ray needs Ray", "ray"):
        import ray
    return ray


@contextlib.contextmanager
def _connected(ray: ModuleType, address: str | None, folder: str | None) -> Iterator[None]:
    """Join a Ray cluster while the block runs, unless this process has joined one before.

    Args:
        ray: the module.
        address: of the cluster; None to start one on this machine.
        folder: that Ray copies to all machines of the cluster; None for none.

    Raises:
        InvalidValueError: a folder is given, but this process has joined a cluster before.
        RoboIRGError: the cluster cannot be joined.
    """
    if ray.is_initialized():
        if folder is not None:
            raise InvalidValueError(
                f"cluster.working_dir is {folder!r}, but this process has joined a Ray cluster "
                "before; pass the folder to ray.init() there."
            )
        yield  # the caller connected, so the caller disconnects
        return
    sigterm_handler = signal.getsignal(signal.SIGTERM)
    _join(ray, address, folder)
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, sigterm_handler)  # Ray has set its own
    try:
        yield
    finally:
        ray.shutdown()


def _join(ray: ModuleType, address: str | None, folder: str | None) -> None:
    """Join a cluster; raise in one sentence if that fails. The arguments are as of `_connected`."""
    _check_reachable(address)
    try:
        ray.init(
            address=address,
            runtime_env={} if folder is None else {"working_dir": folder},
            logging_level=logging.WARNING,
            log_to_driver=False,
        )
    except (ConnectionError, RuntimeError, ValueError, ray.exceptions.RayError) as error:
        words = " ".join(str(error).split())
        hint = "" if "RAY_AUTH_MODE" in os.environ else " (RAY_AUTH_MODE=token if it has a token)"
        raise RoboIRGError(
            f"The Ray cluster {address!r} cannot be joined{hint}: {words}"
        ) from error


def _runtime_environment(needs: WorkerNeeds) -> dict[str, Any]:
    """Return the environment variables of Ray's actors, in the form in which Ray takes them.

    These are the variables that the plan names, and the path on which Python finds the user's
    policies: ``{"env_vars": {"PYTHONPATH": "/home/me/lab", …}}``.
    """
    check_variables(needs.variables, "workers")
    variables = {name: os.environ[name] for name in needs.variables}
    # Without this, older versions of Ray hide the GPUs from actors that reserve none.
    variables["RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO"] = "0"
    if needs.working_dir is None:  # else Ray adds the copy of that folder to the path
        # The import path without installed packages is where a user's policies are.
        installed = (sys.prefix, sys.base_prefix)
        paths = [path for path in sys.path if path and not path.startswith(installed)]
        variables["PYTHONPATH"] = os.pathsep.join(paths)
    return {"env_vars": variables}


def _check_reachable(address: str | None) -> None:
    """Raise if a cluster's address accepts no connection; Ray would wait minutes and then exit.

    Only ``host:port``, maybe after ``ray://``, is checked.
    """
    if address is None:
        return
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not host or not port.isdigit():
        return  # a word such as "auto"
    try:
        socket.create_connection((host, int(port)), timeout=CONNECT_S).close()
    except OSError as error:
        reason = error.strerror or error
        raise RoboIRGError(f"The Ray cluster {address!r} cannot be joined: {reason}.") from error
