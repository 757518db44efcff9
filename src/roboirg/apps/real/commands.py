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
    from roboirg.runs.plan.option_parsing import ALL, parse_names
    from roboirg.tasks import find_tasks

    has_all_settings = settings.strip().lower() == ALL
    names = find_tasks(parse_names("task", tasks))
    study = make_study(
        policy,
        tasks=names,
        settings=None if has_all_settings else known_settings(settings, names),
        trials=trials,
        demonstrations=demonstrations,
        seed=seed,
    )
    _write(study, Path(out))


def _write(study: StudyPlan, folder: Path) -> None:
    """Write the files of a plan into a folder, and print their names and how many trials there are.

    They are the plan, CSV files, a plan of the simulated twin for each task, and the sheet.
    """
    from roboirg.apps.real.pages.trial_sheet import SHEET_FILE, sheet_text
    from roboirg.apps.real.study import study_csv
    from roboirg.apps.real.study.study_plan import write_study
    from roboirg.runs.plan.plan_file import plan_text
    from roboirg.util.atomic_write import write_atomically

    typer.echo(write_study(study, folder))
    texts = {
        study_csv.TRIALS_FILE: study_csv.trials_csv(study),
        study_csv.DEMONSTRATIONS_FILE: study_csv.demonstrations_csv(study),
    }
    for task, twin in study.twin_plans.items():
        texts[f"twin-{task}.yaml"] = plan_text(twin)
    texts[SHEET_FILE] = sheet_text(study)
    for name, text in texts.items():
        if text:  # no file without demonstrations
            write_atomically(folder / name, text)
            typer.echo(folder / name)

    trials = counted(len(study.trials), "trial")
    blocks = counted(study.trials[-1].block, "block")
    demonstrations = counted(len(study.demonstrations), "demonstration")
    typer.echo(f"{trials} in {blocks}, {demonstrations}, plan {study.fingerprint}")


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
