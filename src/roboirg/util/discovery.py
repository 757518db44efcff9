"""Finding what the files of a package offer: adding a thing is adding a file."""

from __future__ import annotations

import importlib
import pkgutil
from importlib.metadata import entry_points
from types import ModuleType
from typing import Any


def discover(package: ModuleType, name: str) -> list[Any]:
    """What the modules of a package call `name`, in the order of the files' names."""
    modules = (
        importlib.import_module(f"{package.__name__}.{found.name}")
        for found in pkgutil.iter_modules(package.__path__)
    )
    return [getattr(module, name) for module in modules if hasattr(module, name)]


def load_entry_points(group: str) -> list[Any]:
    """Return what installed packages offer as entry points of a group, in the order of names."""
    found = sorted(entry_points(group=group), key=lambda entry: entry.name)
    return [entry.load() for entry in found]
