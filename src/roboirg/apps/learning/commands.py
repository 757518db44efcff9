"""Commands of what learns: ``roboirg learn``."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

import typer

from roboirg.cli.options import PlanName, PlanWords, Tasks, Workers, check_output_file
from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import counted

if TYPE_CHECKING:
    from roboirg.apps.learning.listener.listener_training import TrainingPlan
    from roboirg.apps.learning.policy.policy_plan import PolicyPlan
    from roboirg.apps.learning.trainer import Progress

# Heavy modules are imported inside the commands, so that --help is fast.

learn_app = typer.Typer(no_args_is_help=True, help="Train a listener or a policy.")


TRAINING = "training"
"""Key in a plan of what is rare in a training."""

_Without = Annotated[
    str, typer.Option(help="What it does not get: none, pictures, video or words.")
]


@learn_app.command("listener")
def learn_listener(
    context: typer.Context,
    out: Annotated[Path, typer.Option(help="File for what it has learned; with --study a folder.")],
    plan: PlanName = None,
    without: _Without = "none",
    study: Annotated[
        bool,
        typer.Option(
            "--study",
            help="Train listeners that get or lack settings, video, pictures or words, and compare "
            "them in tables and a figure.",
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
    from roboirg.apps.learning.learn_support import check_learn_support
    from roboirg.util.processor import worker_count

    check_learn_support()
    own = ("scenes", "goals", "detector_epochs", "reader_epochs", "seed", "seeds", "encoders")
    training = _plan(PlanWords(context, plan, TRAINING, own), without)
    count = worker_count()
    if study:
        _run_study(training, out, count)
        return
    from roboirg.apps.learning.listener.learned_model import save_model
    from roboirg.apps.learning.listener.listener_study import WORK
    from roboirg.apps.learning.listener.listener_training import train_listener

    check_output_file(out)
    model = train_listener(training, out.parent / WORK, out.stem, count, _print_tenths())
    save_model(model, out)
    typer.echo(f"{out}, {out.stat().st_size / 2**20:.1f} MiB")


def _run_study(plan: TrainingPlan, out: Path, workers: int) -> None:
    from roboirg.evaluation.analysis.figures.figure_style import check_figure_support

    if out.exists() and not out.is_dir():
        raise InvalidValueError(f"{str(out)!r} is a file; --study needs a folder as --out.")
    check_figure_support()
    from roboirg.apps.learning.listener.listener_study import run_study
    from roboirg.apps.learning.listener.study_report import write_study

    answers = run_study(plan, out, workers, _print_tenths())
    about = plan._asdict().items()
    shown = {name: value for name, value in about if name not in ("tasks", "settings", "without")}
    typer.echo(str(write_study(answers, shown, out)))


@learn_app.command("answers")
def learned_answers(
    model: Annotated[Path, typer.Argument(help="What was learned.", metavar="PATH")],
    data: Annotated[Path, typer.Option(help="Folder of a grounding dataset.")],
    out: Annotated[Path, typer.Option(help="File for the answers.")],
) -> None:
    """Let a trained listener answer the grounding dataset, for roboirg score grounding.

    Example: roboirg learn answers listener.pt --data grounding --out answers.jsonl
    """
    from roboirg.apps.learning.learn_support import check_learn_support
    from roboirg.apps.learning.listener.learned_answers import learned_answers as answers_of
    from roboirg.evaluation.grounding_items.answer_file import write_answers
    from roboirg.evaluation.grounding_items.grounding_item import read_items

    check_learn_support()
    from roboirg.apps.learning.listener.learned_model import load_model

    items, learned = read_items(data), load_model(model)
    write_answers(out, answers_of(learned, items, data))
    typer.echo(f"{counted(len(items), 'answer')}: {out}")


USUAL_MEMORY = "recurrent"
PLAYED = ("episodes", "split")
"""Keys of a plan that change what the paper's experiment plays."""


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
    detector_epochs, body_epochs, reader_epochs, seed, encoders; with --paper also memories, seeds,
    parts (main, resolved, context, planner), played (settings), and at its top episodes and split.

    Example: roboirg learn policy --tasks PickXtimes --out learned
    """
    from roboirg.apps.learning.learn_support import check_learn_support
    from roboirg.apps.learning.policy.policy_plan import MEMORY_NAMES, PolicyPlan
    from roboirg.cli.names import known_name, known_settings, known_tasks
    from roboirg.core.word_pools import POOLS
    from roboirg.evaluation.plan.option_parsing import parse_names
    from roboirg.util.atomic_write import locked
    from roboirg.util.processor import worker_count

    own = (
        "scenes", "drawn", "goals", "detector_epochs", "body_epochs", "reader_epochs", "seed",
        "encoders", "memories", "seeds", "parts", "played",
    )  # fmt: skip
    words = PlanWords(context, plan, TRAINING, own)
    tasks = ",".join(parse_names("task", words.given("tasks", tasks)))
    settings = ",".join(parse_names("setting", words.given("settings", settings)))
    training = PolicyPlan(
        known_tasks(tasks),
        () if settings == "none" else known_settings(settings),
        words=known_name("pool of words", words.fields.get("wordings", "train"), POOLS),
        memory=known_name("memory", memory, MEMORY_NAMES),
        **words.choices(PolicyPlan),
    )
    if paper and memory != USUAL_MEMORY:
        raise InvalidValueError("--paper has its memories from the plan: training.memories.")
    if out.exists() and not out.is_dir():
        raise InvalidValueError(f"{str(out)!r} is a file; --out needs a folder.")
    check_learn_support()
    with locked(out / ".lock", f"Another command learns in {str(out)!r}."):
        if paper:
            _play_paper(training, words, out, worker_count(workers))
            return
        path = _train_policy(training, out, worker_count(workers))
    typer.echo(f"{path}, {path.stat().st_size / 2**20:.1f} MiB")
    typer.echo(f"Play it with: {_command_to_play(path, tasks, settings)}")


def _command_to_play(path: Path, tasks: str, settings: str) -> str:
    """Return the command that plays a policy in words that it has not heard."""
    heard = "explicit" if settings == "none" else settings
    options = f"--tasks {quote(tasks)} --split val --settings {quote(heard)} --wordings test"
    return f"roboirg run --policy {quote(f'trained:{path}')} {options} --out runs"


def _train_policy(plan: PolicyPlan, folder: Path, workers: int) -> Path:
    """Train a policy; return its file."""
    from roboirg.apps.learning.policy.policy_model import load_policy, save_policy
    from roboirg.apps.learning.policy.policy_training import check_same_plan, train_policy

    path = folder / f"{plan.name}.pt"
    if path.exists():
        check_same_plan(plan, load_policy(path), path)
    save_policy(train_policy(plan, folder, workers, _print_tenths()), path)
    return path


def _play_paper(plan: PolicyPlan, words: PlanWords, out: Path, workers: int) -> None:
    from roboirg.apps.learning.policy.paper_experiment import (
        ExperimentPlan,
        check_experiment,
        part_options,
        run_of,
        train_rows,
    )
    from roboirg.apps.learning.policy.paper_page import write_paper_page
    from roboirg.evaluation.api.python_run import play_plan
    from roboirg.evaluation.plan.plan_maker import make_plan

    experiment = ExperimentPlan(**words.choices(ExperimentPlan))
    check_experiment(experiment)
    files = train_rows(experiment, plan, out, workers, _print_tenths())
    changes: dict[str, Any] = {"tasks": plan.tasks}
    changes |= {name: words.fields[name] for name in PLAYED if name in words.fields}
    for part in experiment.parts:
        made = make_plan(**part_options(part, experiment, files, changes))
        play_plan(made, run_of(out, part), workers=workers, progress=True)
    typer.echo(str(write_paper_page(out)))


def _plan(words: PlanWords, without: str) -> TrainingPlan:
    from roboirg.apps.learning.listener.learned_model import WITHOUTS
    from roboirg.apps.learning.listener.listener_training import TrainingPlan
    from roboirg.cli.names import known_name, known_settings, known_tasks
    from roboirg.core.word_pools import POOLS

    return TrainingPlan(
        known_tasks(words.fields.get("tasks", "all")),
        known_settings(words.fields.get("settings", "all")),
        words=known_name("pool of words", words.fields.get("wordings", "train"), POOLS),
        without=known_name("variant", without, WITHOUTS),
        **words.choices(TrainingPlan),
    )


def _print_tenths() -> Progress:
    """Return a function that prints progress where it has a note or another tenth is done."""
    shown: dict[str, int] = {}

    def progress(work: str, done: int, total: int, note: str = "") -> None:
        tenth = 10 * done // total
        if note or shown.get(work) != tenth:
            shown[work] = tenth
            typer.echo(f"{work}: {done} of {total}{note and f', {note}'}", err=True)

    return progress


def add_commands(app: typer.Typer) -> None:
    app.add_typer(learn_app, name="learn")
