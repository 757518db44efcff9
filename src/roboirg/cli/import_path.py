"""Import path for policies that are not installed."""

from __future__ import annotations

import sys
from pathlib import Path


def add_working_directory() -> None:
    """Add the working directory to the import path, as `python -m` does."""
    sys.path.insert(0, str(Path.cwd()))
