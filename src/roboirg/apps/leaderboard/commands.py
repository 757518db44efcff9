"""Commands for results that others can check."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboirg.cli.options import check_output_file
from roboirg.cli.progress_bar import progress_bar
from roboirg.cli.run_commands import USAGE_ERROR, Folder
from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import counted, printable, verb_for

if TYPE_CHECKING:
    from roboirg.apps.leaderboard.run_verification import Verification

_MOST_SHOWN = 20

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
    from roboirg.evaluation.records.packs import opened_run
    from roboirg.evaluation.records.run_files import run_folder
    from roboirg.util.processor import worker_count

    with opened_run(run_folder(run)) as folder, progress_bar("records") as show:
        found = verify_run(
            folder,
            sample=_share(sample),
            seed=sample_seed,
            workers=worker_count(),
            progress=show,
        )
    _print(found)
    if not found.holds:
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
    from roboirg.evaluation.records.run_files import run_folder

    check_output_file(out)
    manifest = pack_run(run_folder(run), out, videos=videos, logs=logs)
    size = out.stat().st_size / 1e6
    typer.echo(f"{counted(manifest.records, 'record')}, {size:.1f} MB: {out}")


def _share(text: str) -> float:
    """Return a share such as 5% or 0.05."""
    number = text.strip().removesuffix("%")
    with contextlib.suppress(ValueError):
        share = float(number) / (100 if "%" in text else 1)
        if 0 < share <= 1:
            return share
    raise InvalidValueError(f"The share of episodes is {text!r}; give one such as 5%.")


def _print(found: Verification) -> None:
    from roboirg.apps.leaderboard.record_check import TOLERANCE

    played = found.records - found.verdicts["not replayed"]
    verb = verb_for(played, "were")
    typer.echo(
        f"{counted(found.records, 'record')}; {played:,} {verb} played again from stored actions."
    )
    typer.echo(f"End states equal bit for bit: {found.verdicts['exact']:,}.")
    if tolerant := found.verdicts["tolerant"]:
        typer.echo(
            f"End states from other processors equal within {TOLERANCE:g} (m, rad, s): "
            f"{tolerant:,}; the largest difference is {found.deviation:.1g}."
        )
    if found.errors:
        typer.echo(
            f"{counted(found.errors, 'record')} ended in an error: actions do not show whether a "
            "policy raised one, and the rates leave such episodes out."
        )
    for note in found.notes:
        typer.echo(note)
    for check in found.checks[:_MOST_SHOWN]:
        for sentence in check.findings:
            typer.echo(f"does not hold: {check.slug}: {printable(sentence)}")
    for slug in found.missing[:_MOST_SHOWN]:
        typer.echo(f"has no record: {printable(slug)}")
    if len(found.missing) > _MOST_SHOWN:
        typer.echo(f"… and {len(found.missing) - _MOST_SHOWN:,} more.")
    if len(found.checks) > _MOST_SHOWN:
        typer.echo(f"… and {counted(len(found.checks) - _MOST_SHOWN, 'more record')}.")
    wrong = len(found.checks) + len(found.missing)
    fails = f"{counted(wrong, 'thing')} {verb_for(wrong, 'do')} not hold."
    all_hold = "All that was checked holds."
    if played == found.records and not found.notes:
        all_hold = "Everything holds."
    typer.echo(all_hold if found.holds else fails)


def add_commands(app: typer.Typer) -> None:
    group = typer.Typer(no_args_is_help=True, help="Verify and pack runs.")
    for command in (verify, pack):
        group.command()(command)
    app.add_typer(group, name="leaderboard")
