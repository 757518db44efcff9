"""Commands for studies with a real robot: ``roboirg real``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboirg.cli.run_commands import INTERRUPTED
from roboirg.core.plain_text import counted

if TYPE_CHECKING:
    from roboirg.apps.real.study.study_plan import StudyPlan

# Heavy modules are imported inside the commands, so that --help is fast.

real_app = typer.Typer(
    name="real",
    help="Plan and score a study with a real robot.",
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
    """Plan a study: write plan.json, CSV files, plans for the twin, and a sheet to print.

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
    from roboirg.apps.real.pages.trial_sheet import SHEET_FILE, sheet_text
    from roboirg.apps.real.study import study_csv
    from roboirg.apps.real.study.study_plan import write_study
    from roboirg.evaluation.plan.plan_file import plan_text
    from roboirg.util.atomic_write import write_atomically

    typer.echo(write_study(made, folder))
    for name, text in (
        (study_csv.TRIALS_FILE, study_csv.trials_csv(made)),
        (study_csv.DEMONSTRATIONS_FILE, study_csv.demonstrations_csv(made)),
        *((f"twin-{task}.yaml", plan_text(twin)) for task, twin in made.twin_plans.items()),
        (SHEET_FILE, sheet_text(made)),
    ):
        if text:
            write_atomically(folder / name, text)
            typer.echo(folder / name)
    blocks = made.trials[-1].block
    typer.echo(
        f"{counted(len(made.trials), 'trial')} in {counted(blocks, 'block')}, "
        f"{counted(len(made.demonstrations), 'demonstration')}, plan {made.fingerprint}"
    )


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


def add_commands(app: typer.Typer) -> None:
    app.add_typer(real_app, name="real")
