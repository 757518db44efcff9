"""Commands whose help lists names of a registry, which are found only for that, as it is slow."""

from __future__ import annotations

import pkgutil
import re
from typing import Any

from typer.core import TyperCommand

_LIST = re.compile(r"\{([\w.]+:\w+)\}")
"""Stands for the names that a function returns, as in ``{package.module:function}``."""


class ListingCommand(TyperCommand):
    """A command whose options have texts with `_LIST`."""

    def get_help(self, ctx: Any) -> str:  # noqa: ANN401 - typer does not export its base class
        """Return the help with all lists filled in."""
        for parameter in self.params:
            words = getattr(parameter, "help", None) or ""
            vars(parameter)["help"] = _LIST.sub(_names, words)
        return super().get_help(ctx)


def _names(found: re.Match[str]) -> str:
    """Return the names for a match of `_LIST`, with commas: those that its function returns."""
    return ", ".join(pkgutil.resolve_name(found[1])())
