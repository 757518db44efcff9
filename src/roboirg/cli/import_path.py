"""Where the commands find policies that are not installed."""

from __future__ import annotations

import sys
from pathlib import Path


def add_working_directory() -> None:
    """As `python -m` has it: policies in the working directory can be named."""
    sys.path.insert(0, str(Path.cwd()))
