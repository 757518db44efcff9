"""What a worker on a machine of a cluster reserves there, and what it gets from the driver."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from roboirg.core.errors import InvalidValueError


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

    Raises:
        InvalidValueError: a number is negative, or there is no CPU.
    """

    cpus: float = 1.0
    gpus: float = 0.0
    memory_gb: float = 0.0
    labels: Mapping[str, str] = field(default_factory=dict)
    variables: tuple[str, ...] = ()
    working_dir: str | None = None

    def __post_init__(self) -> None:
        if self.cpus <= 0:
            raise InvalidValueError(f"cluster.cpus is {self.cpus:g}; it must be more than 0.")
        for name, amount in (("gpus", self.gpus), ("memory_gb", self.memory_gb)):
            if amount < 0:
                raise InvalidValueError(f"cluster.{name} is {amount:g}; it must not be negative.")

    def slots(self, node: Mapping[str, Any]) -> int:
        """Return how many workers a machine of the cluster has room for."""
        if not self.labels.items() <= node.get("Labels", {}).items():
            return 0
        amounts = {"CPU": self.cpus, "GPU": self.gpus, "memory": self.memory_gb * 1e9}
        return min(
            int(node["Resources"].get(name, 0.0) / amount)
            for name, amount in amounts.items()
            if amount
        )

    def options(self) -> dict[str, Any]:
        """Return the same as options of a Ray actor."""
        memory = {"memory": int(self.memory_gb * 1e9)} if self.memory_gb else {}
        return {"num_cpus": self.cpus, "num_gpus": self.gpus, **memory}
