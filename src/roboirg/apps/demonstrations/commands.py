"""Commands for demonstrations: ``roboirg export demonstrations`` and ``roboirg replay``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from roboirg.cli.export_commands import export_app
from roboirg.cli.listed_names import ListingCommand
from roboirg.cli.options import (
    PlanName,
    PlanWords,
    Settings,
    Split,
    Tasks,
    Workers,
    add_working_directory,
)
from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import counted

if TYPE_CHECKING:
    from roboirg.apps.demonstrations.dataset_replay import ReplayResult
    from roboirg.apps.demonstrations.export_plan import ExportPlan


OWN_OPTIONS = (
    "cameras", "size", "video", "variations", "policy", "outcomes", "actions", "disturbed",
    "language",
)  # fmt: skip
"""What is rare in an export: keys of a plan's section ``demonstrations``."""
_TEST_EPISODES = (
    "roboirg: These demonstrations are of the test split; a policy that is trained on them is "
    "tested in episodes that it has seen. Train on --split train or random."
)
_TEST_WORDS = (
    "roboirg: These demonstrations speak the words held out for tests; a policy that is trained on "
    "them is tested in words that it knows."
)


def export_demonstrations(
    context: typer.Context,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the dataset.", show_default="required, but for --dry-run"),
    ] = None,
    format: Annotated[  # noqa: A002
        str,
        typer.Option(help="One of {roboirg.apps.demonstrations.export_format:export_formats}."),
    ] = "lerobot-v3",
    split: Split = "train",
    tasks: Tasks = "all",
    episodes: Annotated[
        str, typer.Option(help="all, 4 for the first four, or a list: 0,3,5-9.")
    ] = "all",
    settings: Settings = "all",
    plan: PlanName = None,
    pictures: Annotated[
        str, typer.Option(help="png, lossless-video, lossy-video or none.")
    ] = "png",
    trajectories: Annotated[
        Path | None,
        typer.Option(help="Folder that keeps trajectories for further exports."),
    ] = None,
    workers: Workers = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Count trajectories and episodes, and record nothing.")
    ] = False,
) -> None:
    """Export demonstrations for training, recorded once per episode, in the words of every setting.

    A plan may have, under `demonstrations`: cameras, size, video, variations, policy, outcomes,
    actions, disturbed, language. Words are those for training unless it has `wordings: test`.

    Example: roboirg export demonstrations --tasks PickXtimes --out data
    """
    from roboirg.apps.demonstrations.export_format import find_format
    from roboirg.apps.demonstrations.export_plan import ExportPlan, training_words
    from roboirg.policies import find_policy
    from roboirg.runs.plan.option_parsing import parse_episodes

    add_working_directory(last=True)
    words = PlanWords(context, plan, "demonstrations", OWN_OPTIONS)
    chosen = {"video": find_format(format).begins_with_video, **words.choices(ExportPlan)}
    find_policy(chosen.get("policy", ExportPlan.policy))
    split = words.given("split", split)
    # `validated` checks what is cast.
    names = words.tasks(tasks)
    export_plan = ExportPlan(
        tasks=names,
        split=split,
        episodes=parse_episodes(words.given("episodes", episodes), split, names),
        settings=words.settings(settings, names),
        forms=words.forms(),
        options=training_words(split, words.options()),
        format=format,
        pictures=cast("Any", pictures),
        **chosen,
    ).validated()
    if out is None and not dry_run:
        raise InvalidValueError("No folder given; name one with --out, such as data.")
    _print_size(export_plan)
    if out is not None and not dry_run:
        _export(export_plan, out, workers, trajectories)


def _print_size(plan: ExportPlan) -> None:
    """Print how many trajectories the plan records, and how many episodes it exports.

    Warn if episodes or words of the test split are exported, on which a policy must not be trained.
    All goes to the error stream.
    """
    from roboirg.apps.demonstrations.export_plan import recording_jobs

    if plan.split == "test":
        typer.echo(_TEST_EPISODES, err=True)
    if plan.options.wordings == "test":
        typer.echo(_TEST_WORDS, err=True)
    jobs = recording_jobs(plan)
    episodes = sum(len(spoken.instructions) for spoken in jobs)
    recorded = counted(len(jobs), "trajectory", "trajectories")
    typer.echo(f"{recorded}, {counted(episodes, 'episode')}", err=True)


def _export(plan: ExportPlan, out: Path, workers: int | None, trajectories: Path | None) -> None:
    """Export demonstrations, with progress bars; print how many there are, and their size.

    Args:
        plan: what is exported.
        out: folder of the dataset.
        workers: worker processes; None for as many as there are processor cores.
        trajectories: folder that keeps recorded trajectories for other exports; None to drop them.
    """
    from rich.filesize import decimal

    from roboirg.apps.demonstrations.export_run import run_export
    from roboirg.cli.progress_bar import progress_bars
    from roboirg.util.processor import worker_count

    with progress_bars() as show:

        def report(work: str, done: int, total: int, size: int) -> None:
            show(work, done, total, decimal(size) if size else "")

        summary = run_export(plan, out, worker_count(workers), report, trajectories)
    outcomes = [f"{count} {status}" for status, count in summary.statuses.items()]
    typer.echo(
        f"{counted(summary.episodes, 'episode')}, {decimal(summary.size)}: {out} "
        f"(trajectories: {', '.join(outcomes)})"
    )


def replay(
    dataset: Annotated[
        Path,
        typer.Argument(help="Folder of an export, or of RoboMME's HDF5 files, or such a file."),
    ],
) -> None:
    """Execute the actions of a dataset in the simulator, and compare states and verdicts.

    Example: roboirg replay data
    """
    from roboirg.apps.demonstrations.dataset_reading import read_dataset
    from roboirg.apps.demonstrations.dataset_replay import TOLERANCE
    from roboirg.apps.demonstrations.dataset_replay import replay as replay_trajectory
    from roboirg.util.parallel_map import parallel_map
    from roboirg.util.processor import worker_count

    results = []
    trajectories = read_dataset(dataset)
    for _, result in parallel_map(replay_trajectory, trajectories, worker_count()):
        results.append(result)
        if not result.agrees:
            typer.echo(_difference_text(result))
    total = counted(len(results), "trajectory", "trajectories")
    same_verdict = sum(result.status == result.recorded_status for result in results)
    agree = sum(result.agrees for result in results)
    largest = max([0.0, *(result.final for result in results)])
    typer.echo(
        f"{total}: {same_verdict} with the same verdict, {agree} also with a final state within "
        f"{TOLERANCE:g} (largest difference {largest:.2g})"
    )
    if agree < len(results):
        raise typer.Exit(2)


def _difference_text(result: ReplayResult) -> str:
    """Return how the replay of a trajectory differs from its recording."""
    return (
        f"{result.name}: {result.status} after {result.steps} of {result.recorded_steps} steps "
        f"(recorded: {result.recorded_status}); final state differs by {result.final:.2g}, "
        f"any by at most {result.largest:.2g}"
    )


def add_commands(app: typer.Typer) -> None:
    export_app.command("demonstrations", cls=ListingCommand)(export_demonstrations)
    app.command()(replay)
