"""The ``roboirg`` command: the commands of `cli`, and those of the applications.

Exit codes: 0 success; 2 invalid usage, or episodes ended in errors (one sentence on stderr);
130 stopped by Ctrl-C, 143 by SIGTERM.
"""

from __future__ import annotations

import contextlib
import errno
import importlib.metadata
import importlib.util
import io
import pkgutil
import sys
from collections.abc import Mapping
from typing import Annotated

import typer

from roboirg import apps
from roboirg.cli import (
    declared_options,
    export_commands,
    look_commands,
    policy_commands,
    records_commands,
    report_commands,
    run_commands,
)
from roboirg.cli.listed_names import ListingCommand
from roboirg.cli.run_commands import INTERRUPTED, USAGE_ERROR
from roboirg.core.error_words import is_of_others, one_line
from roboirg.core.errors import RoboIRGError
from roboirg.core.extras import install_command
from roboirg.core.plain_text import printable
from roboirg.core.version import __version__

# Heavy modules are imported inside the commands, so that --help is fast.

# The base class of typer's usage errors has moved between versions.
_WrongUsage: type[Exception] = next(
    kind
    for kind in typer.BadParameter.__mro__
    if kind.__name__ == "ClickException" and issubclass(kind, Exception)
)
_MAX_MESSAGE_LENGTH = 300
_UNWRITTEN = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Errors of writing, which name no file."""
COMMANDS = "roboirg.commands"
"""Entry points of other packages: a function is a command, a `typer.Typer` a group of them."""


app = typer.Typer(
    name="roboirg",
    help="RoboIRGBench: test whether robot policies understand implicit references.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
_MODULES: Mapping[str, tuple[str, ...]] = {
    "sim": ("sapien", "gymnasium", "toppra", "av", "cv2", "zstandard"),
    "light": ("fast_simplification",),
    "pages": ("starlette", "uvicorn"),
    "report": ("jinja2", "markupsafe", "matplotlib", "sklearn", "scipy"),
    "export": ("pyarrow",),
    "demonstrations": ("h5py",),
    "ray": ("ray",),
    "remote": ("websockets", "msgpack"),
    "tokens": ("sentencepiece", "tokenizers"),
    "vlm": ("httpx",),
}
"""Modules that each extra brings. Where two bring one, the extra with which it is mostly used."""


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"roboirg {__version__}")
        raise typer.Exit


# Eager, so that --version needs no subcommand.
_Version = Annotated[
    bool,
    typer.Option(
        "--version", callback=_print_version, is_eager=True, help="Show the version and exit."
    ),
]


@app.callback()
def _options(*, version: _Version = False) -> None:
    del version


def _add_commands() -> None:
    """Add the commands of the core, then those of the applications that are installed."""
    app.command(cls=declared_options.RunCommand)(run_commands.run)
    for command in (
        look_commands.doctor,
        report_commands.report,
        report_commands.tables,
        report_commands.figures,
        report_commands.compare,
    ):
        app.command(cls=ListingCommand)(command)
    app.command("fetch-models")(look_commands.fetch_models)
    app.command("tasks")(look_commands.list_tasks)
    app.command(cls=ListingCommand)(policy_commands.serve)
    app.add_typer(export_commands.export_app, name="export")
    app.add_typer(records_commands.records_app, name="records")
    for application in pkgutil.iter_modules(apps.__path__):
        commands = f"{apps.__name__}.{application.name}.commands"
        if importlib.util.find_spec(commands) is not None:
            importlib.import_module(commands).add_commands(app)
    for entry in importlib.metadata.entry_points(group=COMMANDS):
        _add_outside(entry)


def _add_outside(entry: importlib.metadata.EntryPoint) -> None:
    """Add what another package offers; one that is broken takes no other command away."""
    offered = typer.Typer()
    try:
        found = entry.load()
        if isinstance(found, typer.Typer):
            offered.add_typer(found, name=entry.name)
        else:
            offered.command(entry.name)(found)
        typer.main.get_command(offered)  # which reads the parameters
    except (Exception, SystemExit) as error:  # noqa: BLE001 - a stranger's code
        words = printable(one_line(error))
        typer.echo(f"roboirg: no command {entry.name}: {entry.value}: {words}", err=True)
        return
    app.registered_groups += offered.registered_groups
    app.registered_commands += offered.registered_commands


_add_commands()


def main() -> None:
    """Run the command; errors are one sentence on stderr, and only bugs of ours a traceback.

    Characters that the output's encoding lacks become question marks.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # stderr replaces them anyway
    try:
        code = app(prog_name="roboirg", standalone_mode=False)
    except RoboIRGError as error:
        typer.echo(f"roboirg: {printable(str(error))}", err=True)
        sys.exit(USAGE_ERROR)
    except _WrongUsage as error:
        sys.exit(_print_usage_error(error))
    except typer.Abort:
        code = INTERRUPTED
    except Exception as error:
        message = _describe(error)
        if message is None:
            raise
        typer.echo(f"roboirg: {message}", err=True)
        sys.exit(USAGE_ERROR)
    # The code of `typer.Exit`, as which typer hands on Ctrl-C; commands return nothing.
    if code == INTERRUPTED:
        typer.echo("roboirg: stopped.", err=True)
    sys.exit(code)


def _describe(error: Exception) -> str | None:
    """Return one sentence about an error that is no bug of ours; None if it may be one."""
    missing = describe_missing(error)
    if missing is not None or sys.flags.dev_mode:
        return missing
    if is_of_others(error):
        return f"{printable(one_line(error))}; PYTHONDEVMODE=1 shows the traceback."
    return _describe_refused(error) if isinstance(error, OSError) else None


def _print_usage_error(error: Exception) -> int:
    """Print what was wrong with the command line. Returns the exit code."""
    # Compared by name, because the class has moved too.
    message = str(getattr(error, "format_message", error.__str__)())
    if type(error).__name__ == "NoArgsIsHelpError":
        typer.echo(message.rstrip(), err=True)
        return USAGE_ERROR
    words = " ".join(message.split()).rstrip(".")
    if len(words) > _MAX_MESSAGE_LENGTH:
        words = f"{words[:_MAX_MESSAGE_LENGTH]}…"
    context = getattr(error, "ctx", None)
    command = getattr(context, "command_path", "roboirg")
    typer.echo(f"roboirg: {words}; see {command} --help.", err=True)
    return USAGE_ERROR


def _describe_refused(error: OSError) -> str | None:
    """Return one sentence about a file, or the output, that the system refuses; None for others."""
    if error.filename is not None:
        return f"{printable(str(error.filename))!r} cannot be used: {error.strerror}."
    if error.errno not in _UNWRITTEN:
        return None
    with contextlib.suppress(OSError):
        sys.stdout.close()  # Python would try again at its end
    return f"The output cannot be written: {error.strerror}."


def describe_missing(error: Exception) -> str | None:
    """Return one sentence that names the extra with a missing module; None if none has it."""
    if not isinstance(error, ModuleNotFoundError) or error.name is None:
        return None
    module, _, _ = error.name.partition(".")
    for extra, modules in _MODULES.items():
        if module in modules:
            return (
                f"This command needs the package {module!r}, which is not installed; "
                f"run: {install_command(extra)}"
            )
    return None
