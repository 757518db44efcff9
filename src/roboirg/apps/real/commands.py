"""Commands for studies with a real robot: ``roboirg real``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboirg.cli.run_commands import INTERRUPTED, USAGE_ERROR
from roboirg.core.plain_text import counted

if TYPE_CHECKING:
    from roboirg.apps.real.pages.operator_console import OperatorConsole
    from roboirg.apps.real.study.study_plan import StudyPlan
    from roboirg.apps.real.study.study_run import Study

# Heavy modules are imported inside the commands, so that --help is fast.

real_app = typer.Typer(
    name="real",
    help="Run a study with a real robot or its simulated twin.",
    no_args_is_help=True,
)

Folder = Annotated[str, typer.Argument(help="Folder of the study, made by roboirg real plan.")]


@real_app.command()
def plan(
    policy: Annotated[
        list[str],
        typer.Option(help="Policy: a spec, NAME=SPEC, or a label; repeatable.", metavar="SPEC"),
    ],
    out: Annotated[str, typer.Option(help="Folder of the study.")],
    tasks: Annotated[str, typer.Option(help="Tasks or suites, separated by commas.")] = "real",
    settings: Annotated[str, typer.Option(help="Settings, separated by commas, or all.")] = "all",
    trials: Annotated[int, typer.Option(help="Object arrangements per task.")] = 10,
    demonstrations: Annotated[
        int, typer.Option(help="Demonstrations per task, explicit setting only.")
    ] = 50,
    seed: Annotated[int, typer.Option(help="Random seed of the trial order.")] = 0,
) -> None:
    """Plan a study: write plan.json, CSV files and a sheet to print.

    Example: roboirg real plan --policy my_policy:MyPolicy --out study
    """
    from roboirg.apps.real.study.study_plan import make_study
    from roboirg.cli.names import known_settings
    from roboirg.evaluation.plan.option_parsing import ALL, parse_names
    from roboirg.tasks import find_tasks

    made = make_study(
        policy,
        tasks=find_tasks(parse_names("task", tasks)),
        settings=None if settings.strip().lower() == ALL else known_settings(settings),
        trials=trials,
        demonstrations=demonstrations,
        seed=seed,
    )
    _write(made, Path(out))


def _write(made: StudyPlan, folder: Path) -> None:
    """Write the files of a plan and print their names."""
    from roboirg.apps.real.pages.trial_sheet import SHEET_FILE, write_sheet
    from roboirg.apps.real.study import study_csv
    from roboirg.apps.real.study.study_plan import write_study
    from roboirg.core.errors import MissingDependencyError
    from roboirg.util.atomic_write import write_atomically

    typer.echo(write_study(made, folder))
    for name, text in (
        (study_csv.TRIALS_FILE, study_csv.trials_csv(made)),
        (study_csv.DEMONSTRATIONS_FILE, study_csv.demonstrations_csv(made)),
    ):
        if text:
            write_atomically(folder / name, text)
            typer.echo(folder / name)
    try:
        count = write_sheet(made, folder / SHEET_FILE)
        typer.echo(f"{folder / SHEET_FILE} ({counted(count, 'page')})")
    except MissingDependencyError as error:
        typer.echo(f"roboirg: no sheet to print: {error}", err=True)
    typer.echo(_size(made))


def _size(made: StudyPlan) -> str:
    blocks = made.trials[-1].block
    return (
        f"{counted(len(made.trials), 'trial')} in {counted(blocks, 'block')}, "
        f"{counted(len(made.demonstrations), 'demonstration')}, plan {made.fingerprint}"
    )


@real_app.command()
def run(
    folder: Folder,
    policy: Annotated[
        list[str] | None,
        typer.Option(
            help="Play only the trials of this policy (NAME or NAME=SPEC); repeatable.",
            metavar="SPEC",
        ),
    ] = None,
    robot: Annotated[
        str, typer.Option(help="Robot: twin, twin?real_time=true, or lerobot:MODULE:FUNCTION.")
    ] = "twin",
    limits: Annotated[
        Path | None, typer.Option(help="JSON file that overrides default limits.")
    ] = None,
    score: Annotated[
        str, typer.Option(help="Who scores the trials: judge (only with the twin) or operator.")
    ] = "",
    retry_errors: Annotated[
        bool, typer.Option(help="Play trials again that ended in an error or were declared void.")
    ] = True,
) -> None:
    """Play the trials of a study in order, on a robot or its twin.

    Example: roboirg real run study --robot twin
    """
    from roboirg.apps.real.control.control_loop import never
    from roboirg.apps.real.control.limits import read_limits
    from roboirg.apps.real.control.robot import JudgingRobot
    from roboirg.apps.real.control.robot_loading import make_robot
    from roboirg.apps.real.pages.operator_console import OperatorConsole
    from roboirg.apps.real.study.study_plan import read_study
    from roboirg.apps.real.study.study_run import Study, select_scorer

    path = Path(folder)
    made = read_study(path)
    console = OperatorConsole(made)
    device = make_robot(robot, console.request_arrangement)
    study = Study(
        made,
        path,
        device,
        read_limits(limits),
        select_scorer(score, device),
        never if isinstance(device, JudgingRobot) else console.stop_requested,
        console.report,
    )
    _play(study, console, policy or [], retry=retry_errors)


@real_app.command()
def score(
    folder: Folder,
    operator: Annotated[
        str, typer.Option(help="Name of the operator, for the records.")
    ] = "operator",
    port: Annotated[int, typer.Option(help="Port to listen on; 0 for any free port.")] = 0,
) -> None:
    """Serve the scoring page: one trial at a time, by keyboard, each verdict stored at once.

    Example: roboirg real score study
    """
    from roboirg.apps.real.pages.score_server import ScoreServer
    from roboirg.apps.real.study.study_plan import read_study

    path = Path(folder)
    server = ScoreServer(read_study(path), path, operator, port)
    server.read_trial_log()  # fail now if the records cannot be read
    typer.echo(f"Open {server.url}")
    typer.echo("Press Ctrl-C to stop; all verdicts are stored.")
    sys.stdout.flush()
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    finally:
        server.server_close()


def _play(study: Study, console: OperatorConsole, policies: list[str], *, retry: bool) -> None:
    """Play a study and print a summary; exits with 2 if a trial ended in an error."""
    from roboirg.apps.real.control.control_loop import Interruption

    # SIGTERM stops the run like Ctrl-C, with the arm at rest.
    interruption = Interruption()
    interruption.watch()
    study.stop_requested = interruption.before(study.stop_requested)
    try:
        records = study.run(policies, retry_errors=retry)
    except KeyboardInterrupt:
        typer.echo(
            f"Stopped; finished trials are stored in {study.folder}. Run the same command to "
            "resume.",
            err=True,
        )
        sys.exit(INTERRUPTED)
    errors = console.errors
    typer.echo(f"Played {counted(len(records), 'trial')}; {len(errors)} ended in an error.")
    if errors:
        typer.echo(f"roboirg: first error: {errors[0]}", err=True)
        sys.exit(USAGE_ERROR)


def add_commands(app: typer.Typer) -> None:
    app.add_typer(real_app, name="real")
