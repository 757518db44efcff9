"""The commands of what learns: ``roboirg learn``."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from roboirg.extension.commands import (
    InvalidValueError,
    PlanName,
    PlanWords,
    Tasks,
    Workers,
    check_output_file,
    known_name,
    locked,
    worker_count,
)

if TYPE_CHECKING:
    from roboirg_learn.listener.listener_training import TrainingPlan
    from roboirg_learn.listener.reader_plan import ReaderPlan
    from roboirg_learn.policy.policy_files import PolicyFiles
    from roboirg_learn.trainer import Progress

# Heavy modules are imported inside the commands, so that --help is fast.

learn_app = typer.Typer(no_args_is_help=True, help="Train a listener or a policy.")

TRAINING = "training"
"""Key in a plan of what is rare in a training."""


LISTENER_OPTIONS = (
    "scenes", "goals", "detector_epochs", "reader_epochs", "seed", "seeds", "encoders",
)  # fmt: skip
"""What a plan may have under `training` for a listener."""
POLICY_OPTIONS = (
    "scenes", "drawn", "goals", "detector_epochs", "body_epochs", "reader_epochs", "seed",
    "encoders",
)  # fmt: skip
"""What it may have for a policy."""
READER_OPTIONS = ("scenes", "goals", "reader_epochs", "seed", "encoders")
"""What it may have for a reader of words alone."""
LISTENER_EPOCHS = 6
"""Usual passes over all instructions of a listener's reader."""


HeardSettings = Annotated[
    str, typer.Option(help="Settings that it hears, separated by commas, or none.")
]


@learn_app.command("listener")
def learn_listener(
    context: typer.Context,
    out: Annotated[Path, typer.Option(help="File for what it has learned; with --study a folder.")],
    plan: PlanName = None,
    without: Annotated[
        str, typer.Option(help="What it does not get: none, pictures, video or words.")
    ] = "none",
    study: Annotated[
        bool,
        typer.Option(
            "--study",
            help="Train listeners that get or lack settings, video, pictures or words, and compare "
            "them in tables.",
        ),
    ] = False,
) -> None:
    """Train a listener on the train split: pictures with free labels, then instructions.

    Pictures and what is unfinished are kept in the folder listener-work next to the result, so
    that a command that was killed goes on. A plan may have, under `training`: scenes, goals,
    detector_epochs, reader_epochs, seed, encoders; for a study also seeds, how many times each
    listener is trained (3).

    Example: roboirg learn listener --out listener.safetensors
    """
    from roboirg_learn.learn_support import check_learn_support

    check_learn_support()
    training = _listener_plan(PlanWords(context, plan, TRAINING, LISTENER_OPTIONS), without)
    if study:
        _run_study(training, out, worker_count())
        return
    from roboirg_learn.listener.learned_model import save_model
    from roboirg_learn.listener.listener_study import WORK
    from roboirg_learn.listener.listener_training import train_listener

    check_output_file(out)
    work = out.parent / WORK
    model = train_listener(training, work, out.stem, worker_count(), _print_tenths())
    save_model(model, out)
    typer.echo(f"{out}, {out.stat().st_size / 2**20:.1f} MiB")


def _listener_plan(command_plan: PlanWords, without: str) -> TrainingPlan:
    """Return how a listener is trained, from the command line and the plan file.

    Args:
        command_plan: the command's options and its plan file.
        without: what it does not get: none, pictures, video or words.
    """
    from roboirg_learn.listener.learned_model import WITHOUTS
    from roboirg_learn.listener.listener_training import TrainingPlan

    return TrainingPlan(
        _reader_plan(command_plan, command_plan.tasks(), "all", reader_epochs=LISTENER_EPOCHS),
        without=known_name("variant", without, WITHOUTS),
        **command_plan.choices(TrainingPlan),
    )


def _run_study(plan: TrainingPlan, out: Path, workers: int) -> None:
    """Train and compare the listeners of the study; print the path of the page with tables."""
    from roboirg_learn.listener.listener_study import run_study
    from roboirg_learn.listener.study_report import write_study

    _check_folder(out, "--study needs a folder as --out")
    answers = run_study(plan, out, workers, _print_tenths())
    # The listeners of a study differ in these, so the page does not show them.
    shown = {**plan.about, "seeds": plan.seeds}
    for name in ("tasks", "settings", "without"):
        del shown[name]
    typer.echo(str(write_study(answers, shown, out)))


def _check_folder(out: Path, needed: str) -> None:
    """Refuse a file where a folder is needed; `needed` says so, for the message."""
    if out.exists() and not out.is_dir():
        raise InvalidValueError(f"{str(out)!r} is a file; {needed}.")


@learn_app.command("policy")
def learn_policy(
    context: typer.Context,
    out: Annotated[
        Path, typer.Option(help="Folder for body and reader, and for what they are learned from.")
    ],
    tasks: Tasks = "all",
    settings: HeardSettings = "explicit",
    memory: Annotated[
        str,
        typer.Option(
            help="What it remembers: none, recurrent, ttt, framesamp, subgoal or keyframes."
        ),
    ] = "recurrent",
    plan: PlanName = None,
    workers: Workers = None,
) -> None:
    """Train a policy that acts on pictures and words: records the expert, then learns.

    It becomes two files: a body, and a reader of words for it. What is there already is used again.
    A plan may have, under `training`: scenes, drawn, goals, detector_epochs, body_epochs,
    reader_epochs, seed, encoders.

    Example: roboirg learn policy --tasks PickXtimes --out learned
    """
    from roboirg_learn.learn_support import check_learn_support
    from roboirg_learn.policy.policy_plan import MEMORY_NAMES, BodyPlan

    command_plan = PlanWords(context, plan, TRAINING, POLICY_OPTIONS)
    reader_plan = _reader_plan(command_plan, command_plan.tasks(tasks), settings)
    memory = known_name("memory", memory, MEMORY_NAMES)
    body_plan = BodyPlan(reader_plan.tasks, memory, **command_plan.choices(BodyPlan))
    _check_folder(out, "--out needs a folder")
    check_learn_support()
    with locked(out / ".lock", f"Another command learns in {str(out)!r}."):
        from roboirg_learn.policy.policy_training import trained_files

        files = trained_files(body_plan, reader_plan, out, worker_count(workers), _print_tenths())
    print_policy(files, reader_plan)


def _reader_plan(
    command_plan: PlanWords, tasks: tuple[str, ...], settings: str, **usual: int
) -> ReaderPlan:
    """Return how a reader of words is trained.

    Args:
        command_plan: the command's options and its plan file.
        tasks: names of tasks.
        settings: those whose instructions it hears, as the option was given: ``explicit,direct``,
            ``all``, or ``none`` for a reader without words. If it was not typed, the plan file's
            are taken.
        usual: defaults in place of `ReaderPlan`'s, for fields that the plan file does not have.
    """
    from roboirg_learn.listener.reader_plan import ReaderPlan
    from roboirg_learn.listener.vocabulary import WORD_POOLS

    hears_none = command_plan.given("settings", settings) in ("none", ["none"])
    heard = () if hears_none else command_plan.settings(settings)
    pool = command_plan.fields.get("wordings") or "train"
    return ReaderPlan(
        tasks,
        heard,
        words=known_name("pool of words", pool, WORD_POOLS),
        **{**usual, **command_plan.choices(ReaderPlan)},
    )


@learn_app.command("reader")
def learn_reader(
    context: typer.Context,
    body: Annotated[Path, typer.Option(help="File of the body that it is for.")],
    out: Annotated[Path, typer.Option(help="File for the reader.")],
    tasks: Tasks = "all",
    settings: HeardSettings = "explicit",
    plan: PlanName = None,
    workers: Workers = None,
) -> None:
    """Train the reader of words for a body that was trained before.

    It sees the train split and random scenes as the body does, and hears what is said in them;
    no expert plays. All tasks are those of the body. What is unfinished is kept in the folder
    reader-work next to the result, so that a command that was killed goes on. A plan may have,
    under `training`: scenes, goals, reader_epochs, seed, encoders.

    Example: roboirg learn reader --body small.body.safetensors --out new.reader.safetensors
    """
    from roboirg_learn.learn_support import check_learn_support

    check_learn_support()
    from roboirg_learn.policy.policy_files import PolicyFiles
    from roboirg_learn.policy.trained_body import load_body
    from roboirg_learn.policy.trained_reader import save_reader
    from roboirg_learn.policy.word_training import check_words, train_policy_reader

    command_plan = PlanWords(context, plan, TRAINING, READER_OPTIONS)
    check_output_file(out)
    trained_body = load_body(body)
    if tasks == "all":
        tasks = ",".join(trained_body.goals.tasks)
    reader_plan = _reader_plan(command_plan, command_plan.tasks(tasks), settings)
    for task in reader_plan.tasks:
        known_name("task of this body", task, trained_body.goals.tasks)
    check_words(reader_plan)
    work = out.parent / "reader-work"
    work.mkdir(exist_ok=True)
    reader = train_policy_reader(
        trained_body, reader_plan, work, out.stem, worker_count(workers), _print_tenths()
    )
    save_reader(reader, out)
    print_policy(PolicyFiles(body, out), reader_plan)


def print_policy(files: PolicyFiles, plan: ReaderPlan) -> None:
    """Print the command that plays a trained policy with the settings that its reader learned."""
    heard = ",".join(plan.settings) or "explicit"
    if plan.heard == "all":  # tasks without one of the settings are played in the others
        heard = plan.heard
    options = (
        f"--tasks {','.join(plan.tasks)} --split val --settings {heard} "
        "--wordings test --out runs/learned"
    )
    typer.echo(f"Play it with: roboirg run --policy {quote(files.spec)} {options}")


def _print_tenths() -> Progress:
    """Return a function that prints progress to stderr: each tenth, and whatever has a note.

    A line is such as ``detector: 3 of 12, loss 1.234``.
    """
    shown: dict[str, int] = {}  # the last tenth printed of each kind of work

    def progress(work: str, done: int, total: int, note: str = "") -> None:
        tenth = 10 * done // total
        if note or shown.get(work) != tenth:
            shown[work] = tenth
            ending = f", {note}" if note else ""
            typer.echo(f"{work}: {done} of {total}{ending}", err=True)

    return progress
