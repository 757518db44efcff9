"""Subjects of a plan: hosts of policies, attempts at an episode, costs of models, a cluster."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from roboirg.core.errors import check_names
from roboirg.core.field_types import MOST_COUNT, Label, described
from roboirg.policies.contract.option_checking import Seconds
from roboirg.records.record import ERROR_KINDS, ErrorKind, Summary
from roboirg.runs.hosting.host_pool import DEFAULT_BATCH, HostSettings
from roboirg.runs.plan.option_parsing import Names, parse_names
from roboirg.stats.intervals import ALPHA

PolicyProcessMode = Literal["own", "shared"]
RETRYABLE: tuple[ErrorKind, ...] = ("connection", "environment", "infrastructure")
"""Kinds of errors that may not occur again when the episode is retried."""
_BYTES_IN_GB = 1e9


def _names_if_any(kind: str, given: object) -> Names:
    """Return names of a kind, of which there may be none.

    An empty list is none; an empty text or 0 is a mistake, which `parse_names` refuses.
    """
    if isinstance(given, list | tuple) and not given:
        return ()
    return parse_names(kind, given)


def names_of(kind: str) -> BeforeValidator:
    """Return what pydantic calls to read names of a kind; there may be none."""
    return BeforeValidator(partial(_names_if_any, kind))


def _error_kinds(given: object) -> Names:
    """Return the kinds of errors that are typed, in their usual order; ``none`` gives none."""
    names = _names_if_any("kind of error", given)
    if {name.lower() for name in names} <= {"none"}:
        return ()
    check_names("kind of error", names, ERROR_KINDS)
    return tuple(kind for kind in ERROR_KINDS if kind in names)


Count = Annotated[int, Field(ge=1, le=MOST_COUNT)]
TimeLimit = Annotated[Seconds, Field(gt=0)]


@dataclass(frozen=True, slots=True)
class Hosting:
    """How policies are hosted."""

    policy_process: PolicyProcessMode = field(
        default="own",
        metadata=described(
            "own: a policy that is neither built in nor remote has a process of its own; shared: "
            "it runs in the simulator's process, for debuggers."
        ),
    )
    batch: Count = field(
        default=DEFAULT_BATCH,
        metadata=described("Largest number of episodes that a policy is asked about at once."),
    )
    devices: Annotated[Names, names_of("device")] = field(
        default=(),
        metadata=described(
            "GPUs, such as 0,1; each policy gets a process on each. If empty, one process on any "
            "GPU."
        ),
    )
    policy_env: Annotated[Names, names_of("environment variable")] = field(
        default=(),
        metadata=described(
            "Environment variables with secrets, such as HF_TOKEN, that policies in processes of "
            "their own get."
        ),
    )
    policy_timeout_s: TimeLimit = field(
        default=600.0, metadata=described("Time limit of one call of a policy, seconds.")
    )

    @property
    def settings(self) -> HostSettings | None:
        """What the policies' processes need to know; None if policies run in the simulator's."""
        if self.policy_process == "shared":
            return None
        return HostSettings(self.batch, self.devices, self.policy_env)


@dataclass(frozen=True, slots=True)
class Attempts:
    """How long and how often an episode is played."""

    episode_timeout_s: TimeLimit = field(
        default=7200.0, metadata=described("Time limit of an episode, seconds.")
    )
    tries: Count = field(
        default=2,
        metadata=described(
            "How often an episode is played if it ends in an error of a kind in `retry_on`."
        ),
    )
    retry_on: Annotated[tuple[ErrorKind, ...], BeforeValidator(_error_kinds)] = field(
        default=RETRYABLE,
        metadata=described("Kinds of errors after which an episode is played again; or none."),
    )

    def has_left(self, result: Summary) -> bool:
        """Return whether an episode with this result is to be played again."""
        return result.error in self.retry_on and result.attempt < self.tries


@dataclass(frozen=True, slots=True)
class ModelUse:
    """What models may cost."""

    max_cost: Annotated[float, Field(gt=0)] | None = field(
        default=None,
        metadata=described(
            "Most US dollars that models may cost; then the run stops and can be resumed with more."
        ),
    )
    model_replies: Literal["stored", "anew"] = field(
        default="stored",
        metadata=described(
            "stored: replies in the folder are used again; anew: models are asked again."
        ),
    )


@dataclass(frozen=True, slots=True)
class StopRule:
    """When a run has played enough scenes to say how the sides that it compares differ.

    Attributes:
        alpha: level at which a difference counts as shown, over all comparisons of the run.
        margin: points; a comparison is closed, too, if its difference is surely smaller. 0 for
            never.
        against: name of a policy whose results are in the run's folder already, and with which the
            plan's is compared; None for a plan that has both sides.
    """

    alpha: Annotated[float, Field(gt=0, lt=1)] = ALPHA
    margin: Annotated[float, Field(ge=0, le=100)] = 10.0
    against: Label | None = None


@dataclass(frozen=True, slots=True)
class WorkerNeeds:
    """What a worker reserves on its machine.

    Attributes:
        cpus: number of CPUs.
        gpus: number of GPUs; may be a part of one.
        memory_gb: memory in GB; 0 reserves none.
        labels: which a machine must have.
        variables: environment variables of this process that workers get.
        working_dir: folder that is copied to all machines, with the policies' files.
    """

    cpus: Annotated[float, Field(gt=0)] = 1.0
    gpus: Annotated[float, Field(ge=0)] = 0.0
    memory_gb: Annotated[float, Field(ge=0, le=MOST_COUNT)] = 0.0
    labels: Mapping[str, str] = field(default_factory=dict)
    variables: Names = ()
    working_dir: str | None = None

    def slots(self, node: Mapping[str, Any]) -> int:
        """Return how many workers fit on a machine by its CPUs, GPUs and memory.

        It is 0 if the machine lacks one of the labels.

        Args:
            node: what Ray reports of the machine.
        """
        if not self.labels.items() <= node.get("Labels", {}).items():
            return 0
        needs = {"CPU": self.cpus, "GPU": self.gpus, "memory": self.memory_gb * _BYTES_IN_GB}
        rooms = []
        for resource, needed in needs.items():
            if needed:
                available = node["Resources"].get(resource, 0.0)
                rooms.append(int(available / needed))
        return min(rooms)

    def options(self) -> dict[str, Any]:
        """Return what a worker reserves, as options of a Ray actor: ``{"num_cpus": 1.0, …}``."""
        options: dict[str, Any] = {"num_cpus": self.cpus, "num_gpus": self.gpus}
        if self.memory_gb:
            options["memory"] = int(self.memory_gb * _BYTES_IN_GB)
        return options
