"""Commands for people: ``roboirg listen`` and ``roboirg drive``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from roboirg.cli import run_commands
from roboirg.cli.options import (
    NO_PLAN,
    PlanWords,
    Settings,
    Tasks,
    spread,
)
from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import counted

if TYPE_CHECKING:
    from roboirg.util.web.keyed_pages import KeyedPageServer

# Heavy modules are imported inside the commands, so that --help is fast.

listen_app = typer.Typer(
    no_args_is_help=True, help="Ask people what is meant; the scripted expert plays their answers."
)


class StudyWords(PlanWords):
    """A plan with words, and what is rare in a study."""

    section = "listening"
    own = ("practice", "checks", "seed", "frames_every", "consent")


NO_WORDS = StudyWords()

Study = Annotated[Path, typer.Argument(help="Folder of the study.")]
Host = Annotated[
    str, typer.Option(help="Address to listen on; 0.0.0.0 lets other machines connect.")
]
Port = Annotated[int, typer.Option(help="Port to listen on; 0 for any free port.")]


@listen_app.command()
@spread
def plan(
    folder: Study,
    people: Annotated[
        int, typer.Option(help="Number of people, ideally a multiple of the number of settings.")
    ],
    tasks: Tasks = "all",
    settings: Settings = "all",
    episodes: Annotated[
        str, typer.Option(help="all, 4 for the first four, or a list such as 0,3,5-9.")
    ] = "4",
    words: StudyWords = NO_WORDS,
) -> None:
    """Plan a study of listeners and draw its pictures, or continue an interrupted one.

    A plan may have, under `listening`: practice, checks, seed, frames_every, and consent, the text
    that people agree to.

    Example: roboirg listen plan study --people 10
    """
    from roboirg.apps.people.listening_session import QUESTIONS
    from roboirg.apps.people.listening_study import (
        PEOPLE,
        ListeningStudy,
        write_listening_study,
    )
    from roboirg.cli.progress_bar import progress_bar
    from roboirg.evaluation.grounding_items.grounding_item import write_items
    from roboirg.evaluation.grounding_items.question_set import collect_items
    from roboirg.evaluation.plan.plan_maker import make_plan
    from roboirg.util.processor import worker_count

    # The policy can be checked only when its answers are there; the oracle stands in for it.
    made = make_plan(
        [f"{PEOPLE}=oracle"],
        tasks=tasks,
        settings=settings,
        forms=words.form(),
        split=words.fields.get("split", "test"),
        episodes=episodes,
        **words.words,
    )
    study = ListeningStudy(
        plan=made.model_copy(update={"policies": (PEOPLE,)}),
        people=people,
        **words.choices(ListeningStudy),
    ).checked()
    write_listening_study(study, folder)
    count = worker_count()
    with progress_bar("episodes") as progress:
        found = collect_items(study.export_request(), folder / QUESTIONS, count, progress)
    write_items(found, folder / QUESTIONS)
    asked = study.questions(0)
    items = sum(one.kind == "item" for one in asked)
    typer.echo(
        f"{counted(people, 'person', 'people')} with {counted(items, 'question')} each, "
        f"{len(asked) - items} for practice and checks: {folder}\n"
        f"Serve it: roboirg listen serve {folder}"
    )


@listen_app.command("serve")
def serve_study(
    folder: Study,
    host: Host = "127.0.0.1",
    port: Port = 0,
    people: Annotated[
        int | None,
        typer.Option(min=1, help="Number of people who may take part, if not as planned."),
    ] = None,
) -> None:
    """Serve the page of a study; each answer is stored before the next question is shown.

    Example: roboirg listen serve study
    """
    from roboirg.apps.people.listen_server import ListenServer

    server = ListenServer(folder, host, port, people)
    _serve(server, "Press Ctrl-C to stop; all answers are stored.")


@listen_app.command("results")
def print_results(
    folder: Study,
    play: Annotated[
        bool, typer.Option("--play", help="Let the scripted expert play the answers first.")
    ] = False,
) -> None:
    """Print how far people agree, how long they take, whether they pay attention.

    --play writes its records to FOLDER/run.

    Example: roboirg listen results study
    """
    from roboirg.apps.people.people_run import RUN, answered_plan
    from roboirg.evaluation.run.executor import choose_executor

    if not play:
        _print_listeners(folder)
        return
    made, out = answered_plan(folder), folder.absolute() / RUN
    summary = run_commands.play(made, out, choose_executor(), retry=True)
    run_commands.print_tables_of(out, made.jobs())
    _print_listeners(folder)
    run_commands.report_problems(summary, out)


def _print_listeners(folder: Path) -> None:
    from rich.console import Console

    from roboirg.apps.people.listener_answers import read_events
    from roboirg.apps.people.listener_tables import person_table, setting_table
    from roboirg.apps.people.listening_study import read_listening_study
    from roboirg.evaluation.analysis.tables.rendering.terminal import renderable
    from roboirg.util.console_width import widen

    read_listening_study(folder)
    events = read_events(folder)
    if not events:
        raise InvalidValueError(f"No question of {str(folder)!r} has been answered yet.")
    console = Console()
    widen(console)
    for table in (setting_table(events), person_table(events)):
        console.print(renderable(table, console))


def _serve(server: KeyedPageServer, words: str) -> None:
    """Serve until Ctrl-C."""
    typer.echo(f"Open {server.url}")
    if server.host in ("0.0.0.0", "::"):  # noqa: S104 - a comparison
        typer.echo("From other machines: the same address with this machine's name.")
    typer.echo(words)
    sys.stdout.flush()
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        sys.exit(run_commands.INTERRUPTED)
    finally:
        server.server_close()


@spread
def drive(
    task: Annotated[str, typer.Argument(help="Name of the task.")],
    episode: Annotated[int, typer.Argument(help="Position in the split, from 0.")],
    setting: Annotated[str, typer.Option(help="Setting of the instruction.")] = "explicit",
    words: PlanWords = NO_PLAN,
    out: run_commands.Out = "runs/driven",
    name: Annotated[str, typer.Option(help="Name of the policy in the records.")] = "person",
    host: Host = "127.0.0.1",
    port: Port = 0,
) -> None:
    """Drive an episode in the browser, by mouse, touch or keyboard; stores its record.

    Example: roboirg drive PickXtimes 3 --setting direct
    """
    from roboirg.apps.people.drive_server import DriveServer
    from roboirg.apps.people.driving_run import DRIVER
    from roboirg.envs.factory import check_simulator
    from roboirg.evaluation.plan.plan_maker import make_plan
    from roboirg.evaluation.records.record import DEFAULT_MAX_STEPS

    # The plan checks the words as those of a run; a person is no policy that can be loaded.
    made = make_plan(
        [f"{DRIVER}=oracle"],
        tasks=task,
        settings=setting,
        forms=words.form(),
        split=words.fields.get("split", "test"),
        episodes=f"{episode},",
        **words.words,
        max_steps=words.fields.get("max_steps", DEFAULT_MAX_STEPS),
    )
    check_simulator()
    jobs = made.jobs()
    if len(jobs) != 1:
        raise InvalidValueError(
            "drive plays one task, one setting and one form at a time; these options make "
            f"{len(jobs)} jobs."
        )
    job = msgspec.structs.replace(jobs[0], policy=name, spec=None)
    server = DriveServer(job, run_commands.folder_of(out), host, port)
    _serve(server, f"Press Ctrl-C to stop; the records of episodes that ended are in {out}.")


def add_commands(app: typer.Typer) -> None:
    app.add_typer(listen_app, name="listen")
    app.command()(drive)
