"""The commands of what learns: ``roboirg learn``."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

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
    from roboirg_learn.policy.policy_plan import PolicyPlan
    from roboirg_learn.trainer import Progress

# Heavy modules are imported inside the commands, so that --help is fast.

learn_app = typer.Typer(no_args_is_help=True, help="Train a listener or a policy.")

TRAINING = "training"
"""Key in a plan of what is rare in a training."""


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

    Example: roboirg learn listener --out listener.pt
    """
    from roboirg_learn.learn_support import check_learn_support

    check_learn_support()
    own = "scenes goals detector_epochs reader_epochs seed seeds encoders"
    training = _listener_plan(PlanWords(context, plan, TRAINING, own.split()), without)
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


def _listener_plan(words: PlanWords, without: str) -> TrainingPlan:
    from roboirg_learn.listener.learned_model import WITHOUTS
    from roboirg_learn.listener.listener_training import TrainingPlan
    from roboirg_learn.listener.vocabulary import WORD_POOLS

    return TrainingPlan(
        words.tasks(),
        words.settings(),
        words.options().language,
        words=known_name("pool of words", words.fields.get("wordings") or "train", WORD_POOLS),
        without=known_name("variant", without, WITHOUTS),
        **words.choices(TrainingPlan),
    )


def _run_study(plan: TrainingPlan, out: Path, workers: int) -> None:
    from roboirg_learn.listener.listener_study import run_study
    from roboirg_learn.listener.study_report import write_study

    _check_folder(out, "--study needs a folder as --out")
    answers = run_study(plan, out, workers, _print_tenths())
    about = plan._asdict().items()
    shown = {name: value for name, value in about if name not in ("tasks", "settings", "without")}
    typer.echo(str(write_study(answers, shown, out)))


def _check_folder(out: Path, needed: str) -> None:
    if out.exists() and not out.is_dir():
        raise InvalidValueError(f"{str(out)!r} is a file; {needed}.")


USUAL_MEMORY = "recurrent"


@learn_app.command("policy")
def learn_policy(
    context: typer.Context,
    out: Annotated[
        Path, typer.Option(help="Folder for the policy and for what it is learned from.")
    ],
    tasks: Tasks = "all",
    settings: Annotated[
        str, typer.Option(help="Settings that it hears, separated by commas, or none.")
    ] = "explicit",
    memory: Annotated[
        str,
        typer.Option(
            help="What it remembers: none, recurrent, ttt, framesamp, subgoal or keyframes."
        ),
    ] = USUAL_MEMORY,
    plan: PlanName = None,
    paper: Annotated[
        bool,
        typer.Option(
            "--paper",
            help="Train a policy for each mechanism of the paper, play the paper's experiment with "
            "them, and write a page with the published results next to these.",
        ),
    ] = False,
    workers: Workers = None,
) -> None:
    """Train a policy that acts on pictures and words: records the expert, then learns.

    What is there already is used again. A plan may have, under `training`: scenes, drawn, goals,
    detector_epochs, body_epochs, reader_epochs, seed, encoders; with --paper also memories, parts
    (main, resolved, context, planner), played (settings), and at its top episodes and split.

    Example: roboirg learn policy --tasks PickXtimes --out learned
    """
    from roboirg_learn.learn_support import check_learn_support

    own = (
        "scenes drawn goals detector_epochs body_epochs reader_epochs seed encoders memories parts "
        "played"
    )
    words = PlanWords(context, plan, TRAINING, own.split())
    training = _policy_plan(words, tasks, settings, memory)
    if paper and memory != USUAL_MEMORY:
        raise InvalidValueError("--paper has its memories from the plan: training.memories.")
    _check_folder(out, "--out needs a folder")
    check_learn_support()
    with locked(out / ".lock", f"Another command learns in {str(out)!r}."):
        if paper:
            _play_paper(training, words, out, worker_count(workers))
            return
        from roboirg_learn.policy.policy_training import trained_file

        path = trained_file(training, out, worker_count(workers), _print_tenths())
    typer.echo(f"{path}, {path.stat().st_size / 2**20:.1f} MiB")
    heard = ",".join(training.settings) or "explicit"
    options = f"--tasks {quote(','.join(training.tasks))} --split val --settings {quote(heard)}"
    options += f" --wordings test --out {quote(f'runs/{path.stem}')}"
    typer.echo(f"Its language is {training.language}; a run in another than 3 needs a plan file.")
    typer.echo(f"Play it with: roboirg run --policy {quote(f'trained:{path}')} {options}")


def _policy_plan(words: PlanWords, tasks: str, settings: str, memory: str) -> PolicyPlan:
    from roboirg_learn.listener.vocabulary import WORD_POOLS
    from roboirg_learn.policy.policy_plan import MEMORY_NAMES, PolicyPlan

    hears_none = words.given("settings", settings) in ("none", ["none"])
    return PolicyPlan(
        words.tasks(tasks),
        words.options().language,
        () if hears_none else words.settings(settings),
        words=known_name("pool of words", words.fields.get("wordings") or "train", WORD_POOLS),
        memory=known_name("memory", memory, MEMORY_NAMES),
        **words.choices(PolicyPlan),
    )


def _play_paper(plan: PolicyPlan, words: PlanWords, out: Path, workers: int) -> None:
    import roboirg
    from roboirg.extension.commands import write_atomically
    from roboirg_learn.policy.paper_experiment import (
        MAIN,
        RESOLVED,
        RUNS,
        ExperimentPlan,
        check_experiment,
        part_options,
        train_rows,
    )
    from roboirg_learn.policy.paper_page import INTRODUCTION, answers_text

    experiment = ExperimentPlan(**words.choices(ExperimentPlan))
    check_experiment(experiment)
    files = train_rows(experiment, plan, out, workers, _print_tenths())
    changes: dict[str, Any] = {"tasks": plan.tasks, "language": plan.language}
    changes |= {name: words.fields[name] for name in ("episodes", "split") if name in words.fields}
    played = {}
    for part in experiment.parts:
        options = part_options(part, experiment, files, changes)
        run = MAIN if part == RESOLVED else part
        played[run] = roboirg.evaluate(**options, out=out / RUNS / run, workers=workers)
    texts = [one.table(run, "markdown", published=True) for run, one in played.items()]
    texts.append(answers_text({run: one.frame for run, one in played.items()}))
    page = out / "paper.md"
    write_atomically(page, "\n".join([INTRODUCTION, *texts, ""]))
    typer.echo(str(page))


def _print_tenths() -> Progress:
    """Return a function that prints progress where it has a note or another tenth is done."""
    shown: dict[str, int] = {}

    def progress(work: str, done: int, total: int, note: str = "") -> None:
        tenth = 10 * done // total
        if note or shown.get(work) != tenth:
            shown[work] = tenth
            typer.echo(f"{work}: {done} of {total}{note and f', {note}'}", err=True)

    return progress
