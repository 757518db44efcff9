"""Plan files for commands."""

from __future__ import annotations

import tempfile
from pathlib import Path

import yaml


def plan_file(**fields: object) -> str:
    """Write a plan file and return its path."""
    folder = Path(tempfile.mkdtemp(prefix="plan-"))
    path = folder / "plan.yaml"
    path.write_text(yaml.safe_dump(fields))
    return str(path)
