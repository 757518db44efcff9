"""The ``roboirg`` command."""

from roboirg.cli.app import main

__all__ = ["main"]
