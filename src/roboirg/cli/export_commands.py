"""``roboirg export``: the group of commands that write data for other programs."""

from __future__ import annotations

import typer

export_app = typer.Typer(no_args_is_help=True, help="Export data for other programs.")


@export_app.callback()
def _export() -> None:
    # With a callback, a single command keeps its name.
    pass
