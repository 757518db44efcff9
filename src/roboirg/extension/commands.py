"""What a package needs to add a command: options, names, errors, whole files, processes."""

from __future__ import annotations

from roboirg.cli.options import PlanName, PlanWords, Tasks, Workers, check_output_file
from roboirg.core.errors import InvalidValueError, MissingDependencyError, known_name
from roboirg.util.atomic_write import locked, write_atomically
from roboirg.util.parallel_map import parallel_map
from roboirg.util.processor import worker_count
from roboirg.util.short_hash import short_hash

__all__ = [
    "InvalidValueError",
    "MissingDependencyError",
    "PlanName",
    "PlanWords",
    "Tasks",
    "Workers",
    "check_output_file",
    "known_name",
    "locked",
    "parallel_map",
    "short_hash",
    "worker_count",
    "write_atomically",
]
