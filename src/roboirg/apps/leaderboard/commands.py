"""Commands for results that others can check."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboirg.cli.export_commands import export_app
from roboirg.cli.options import check_output_file
from roboirg.cli.progress_bar import progress_bar
from roboirg.cli.run_commands import USAGE_ERROR, Folder
from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import counted, printable, verb_for

if TYPE_CHECKING:
    from roboirg.apps.leaderboard.run_verification import Verification

_MOST_SHOWN = 20
"""Records of each kind of finding that are printed."""

RunOrPack = Annotated[str, typer.Argument(help="Output folder of a run, or its packed file.")]
SampleShare = Annotated[
    str, typer.Option(help="Share of the episodes whose actions are played again.")
]
SampleSeed = Annotated[
    int | None, typer.Option(help="Seed of the sample; without it, every call draws another one.")
]


def verify(
    run: RunOrPack,
    sample: SampleShare = "100%",
    sample_seed: SampleSeed = None,
) -> None:
    """Play the actions of a run again and check its records; exit code 2 if one does not hold.

    Example: roboirg leaderboard verify runs/first --sample 10%
    """
    from roboirg.apps.leaderboard.run_verification import verify_run
    from roboirg.records.action_log import ACTION_FOLDER
    from roboirg.records.packs import opened_run
    from roboirg.records.run_files import run_folder
    from roboirg.util.processor import worker_count

    opened = opened_run(run_folder(run), [ACTION_FOLDER])
    with opened as folder, progress_bar("records") as show:
        verification = verify_run(
            folder,
            sample=_share(sample),
            seed=sample_seed,
            workers=worker_count(),
            progress=show,
        )
    _print(verification)
    if not verification.holds:
        sys.exit(USAGE_ERROR)


def pack(
    run: Folder,
    out: Annotated[Path, typer.Option(help="File to write, such as mine.roboirg.zip.")],
    videos: Annotated[bool, typer.Option(help="Include the videos.")] = False,
    logs: Annotated[bool, typer.Option(help="Include what policies printed.")] = False,
) -> None:
    """Pack records, plan and actions of a run into one file for others to check.

    Example: roboirg leaderboard pack runs/first --out first.roboirg.zip
    """
    from roboirg.apps.leaderboard.packing import pack_run
    from roboirg.records.run_files import run_folder

    check_output_file(out)
    manifest = pack_run(run_folder(run), out, videos=videos, logs=logs)
    size = out.stat().st_size / 1e6
    typer.echo(f"{counted(manifest.records, 'record')}, {size:.1f} MB: {out}")


def hub_results(
    run: RunOrPack,
    policy: Annotated[str, typer.Argument(help="Name of the policy in it.")],
    dataset: Annotated[
        str, typer.Option(help="The benchmark's dataset at Hugging Face: OWNER/NAME.")
    ],
) -> None:
    """Print success rates for .eval_results/roboirg.yaml in a model's repository at Hugging Face.

    Example: roboirg export hub-results mine.roboirg.zip mine --dataset OWNER/roboirg-instructions
    """
    from roboirg.analysis.results.sources import opened_sources
    from roboirg.apps.leaderboard.hub_results import hub_results as results_text

    with opened_sources([f"{run}:{policy}"]) as (source,):
        typer.echo(results_text(source.frame, dataset), nl=False)


def _share(text: str) -> float:
    """Return the share that a text says, above 0 and at most 1: ``5%`` and ``0.05`` give 0.05."""
    number = text.strip().removesuffix("%")
    whole = 100 if "%" in text else 1
    with contextlib.suppress(ValueError):
        share = float(number) / whole
        if 0 < share <= 1:
            return share
    raise InvalidValueError(f"The share of episodes is {text!r}; give one such as 5%.")


def _print(verification: Verification) -> None:
    """Print what was found in a run, and last one sentence: whether all that was checked holds.

    Of records with faults, and of missing ones, only the first `_MOST_SHOWN` are listed, and the
    others counted.
    """
    played = verification.records - verification.verdicts["not replayed"]
    _print_played(verification, played)
    for note in verification.notes:
        typer.echo(note)
    for fault in verification.faults:
        typer.echo(f"does not hold: {printable(fault)}")
    for check in verification.checks[:_MOST_SHOWN]:
        for sentence in check.findings:
            typer.echo(f"does not hold: {check.slug}: {printable(sentence)}")
    for slug in verification.missing[:_MOST_SHOWN]:
        typer.echo(f"has no record: {printable(slug)}")
    if len(verification.missing) > _MOST_SHOWN:
        typer.echo(f"… and {len(verification.missing) - _MOST_SHOWN:,} more.")
    if len(verification.checks) > _MOST_SHOWN:
        typer.echo(f"… and {counted(len(verification.checks) - _MOST_SHOWN, 'more record')}.")

    if not verification.holds:
        wrong = len(verification.checks) + len(verification.missing) + len(verification.faults)
        typer.echo(f"{counted(wrong, 'thing')} {verb_for(wrong, 'do')} not hold.")
    elif played == verification.records and not verification.notes:
        typer.echo("Everything holds.")
    else:
        typer.echo("All that was checked holds.")


def _print_played(verification: Verification, played: int) -> None:
    """Print how many records were played again, and how often their end states were equal.

    Args:
        verification: of the run.
        played: number of records that were played again.
    """
    from roboirg.apps.leaderboard.record_check import TOLERANCE

    verb = verb_for(played, "were")
    typer.echo(
        f"{counted(verification.records, 'record')}; {played:,} {verb} played again from stored "
        "actions."
    )
    typer.echo(f"End states equal bit for bit: {verification.verdicts['exact']:,}.")
    tolerant = verification.verdicts["tolerant"]
    if tolerant:
        typer.echo(
            f"End states from other processors equal within {TOLERANCE:g} (m, rad, s): "
            f"{tolerant:,}; the largest difference is {verification.deviation:.1g}."
        )
    if verification.errors:
        typer.echo(
            f"{counted(verification.errors, 'record')} ended in an error: actions do not show "
            "whether a policy raised one, and the rates leave such episodes out."
        )


def add_commands(app: typer.Typer) -> None:
    group = typer.Typer(no_args_is_help=True, help="Verify and pack runs.")
    for command in (verify, pack):
        group.command()(command)
    app.add_typer(group, name="leaderboard")
    export_app.command("hub-results")(hub_results)
