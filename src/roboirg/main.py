"""The ``roboirg`` command.

Exit codes: 0 success; 2 invalid usage, or episodes ended in errors (one sentence on stderr);
130 stopped by Ctrl-C, 143 by SIGTERM.
"""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from roboirg.cli import (
    check_commands,
    demo_commands,
    demonstration_commands,
    episode_commands,
    grounding_commands,
    import_commands,
    language_commands,
    look_commands,
    people_commands,
    policy_commands,
    report_commands,
    run_commands,
    show_commands,
    split_commands,
    verification_commands,
)
from roboirg.cli.bench_commands import bench
from roboirg.cli.export_commands import export_app
from roboirg.cli.learn_commands import learn_app
from roboirg.cli.missing_extras import describe_missing
from roboirg.cli.real_commands import real_app
from roboirg.cli.run_commands import INTERRUPTED, USAGE_ERROR
from roboirg.core.errors import RoboIRGError
from roboirg.core.printable import printable
from roboirg.core.version import __version__

# Heavy modules are imported inside the commands, so that --help is fast.

# The base class of typer's usage errors has moved between versions.
_WrongUsage: type[Exception] = next(
    kind
    for kind in typer.BadParameter.__mro__
    if kind.__name__ == "ClickException" and issubclass(kind, Exception)
)
_MAX_MESSAGE_LENGTH = 300


app = typer.Typer(
    name="roboirg",
    help="RoboIRGBench: test whether robot policies understand implicit references.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

app.add_typer(language_commands.language_app, name="language")
app.add_typer(export_app, name="export")
app.add_typer(grounding_commands.score_app, name="score")
app.add_typer(learn_app, name="learn")
app.add_typer(real_app, name="real")
app.add_typer(people_commands.listen_app, name="listen")
app.add_typer(language_commands.wordings_app, name="wordings")
app.command()(bench)


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


app.command()(run_commands.run)
app.command()(run_commands.merge)
app.command()(verification_commands.verify)
app.command()(verification_commands.pack)
app.command()(verification_commands.board)
app.command()(verification_commands.repeat)
app.command()(demonstration_commands.replay)
app.command()(report_commands.report)
app.command()(report_commands.view)
app.command()(report_commands.tables)
app.command()(report_commands.figures)
app.command()(report_commands.compare)
app.command()(import_commands.import_results)
app.command()(people_commands.drive)
app.command()(demo_commands.demo)
app.command()(look_commands.doctor)
app.command("fetch-models")(look_commands.fetch_models)
app.command("tasks")(look_commands.list_tasks)
app.command()(look_commands.instruct)
app.command("build-splits")(split_commands.build_splits)
app.command()(show_commands.show)
app.command(cls=policy_commands.ProtocolHelpCommand)(policy_commands.serve)
app.command("check-policy", cls=policy_commands.ProtocolHelpCommand)(check_commands.check_policy)
export_app.command("grounding")(grounding_commands.export_grounding)
export_app.command("episodes")(episode_commands.export_episodes)
export_app.command("records")(run_commands.export_records)
export_app.command("demonstrations")(demonstration_commands.export_demonstrations)


def main() -> None:
    """Run the command; errors are one sentence on stderr, never a traceback."""
    try:
        code = app(prog_name="roboirg", standalone_mode=False)
    except RoboIRGError as error:
        typer.echo(f"roboirg: {printable(str(error))}", err=True)
        sys.exit(USAGE_ERROR)
    except ModuleNotFoundError as error:
        message = describe_missing(error)
        if message is None:
            raise
        typer.echo(f"roboirg: {message}", err=True)
        sys.exit(USAGE_ERROR)
    except _WrongUsage as error:
        sys.exit(_print_usage_error(error))
    except typer.Abort:
        sys.exit(INTERRUPTED)
    # The code of `typer.Exit`; commands return nothing.
    sys.exit(code)


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
