"""Commands for words from outside: ``roboirg wordings``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from roboirg.cli.options import check_output_file
from roboirg.core.errors import RoboIRGError
from roboirg.util.plurals import counted

# Heavy modules are imported inside the commands, so that --help is fast.

wordings_app = typer.Typer(no_args_is_help=True, help="Use the commands of others.")


@wordings_app.callback()
def _wordings() -> None:
    # With a callback, a single command keeps its name.
    pass


@wordings_app.command("import-robomme")
def import_robomme(
    path: Annotated[Path, typer.Argument(help="Folder of a clone of RoboMME's repository.")],
    out: Annotated[Path, typer.Option(help="Wording file to write, TOML.")],
    name: Annotated[str, typer.Option(help="Name of the wordings, for records.")] = "robomme",
) -> None:
    """Make a wording file of RoboMME's sentences; exit code 2 if one cannot be read back."""
    from roboirg.language.wordings.robomme_import import import_robomme as make_wordings
    from roboirg.language.wordings.robomme_import import summary
    from roboirg.util.atomic_write import write_atomically

    check_output_file(out)
    found = make_wordings(path, name)
    for task, case, reason in found.refused:
        typer.echo(f"Refused {task} ({case}): {reason}", err=True)
    if found.wordings is None:
        raise RoboIRGError(f"No sentence of {str(path)!r} can be used; {out} was not written.")
    write_atomically(out, found.text)
    for line in summary(found.wordings):
        typer.echo(line)
    typer.echo(f"Wrote {found.wordings.identity}: {out}")
    if found.refused:
        count = counted(len(found.refused), "template")
        raise RoboIRGError(f"{count} could not be read back; {out} has the rest.")
