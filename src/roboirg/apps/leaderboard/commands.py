"""Commands for results that others can check."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboirg.cli.options import add_working_directory, check_output_file
from roboirg.cli.progress_bar import progress_bar
from roboirg.cli.run_commands import USAGE_ERROR, Folder, folder_of, report_problems
from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import counted, printable, verb_for

if TYPE_CHECKING:
    from roboirg.apps.leaderboard.repeats import RepeatedEpisode
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
    submission: Annotated[
        bool, typer.Option("--submission", help="Also check whether the board would rank it.")
    ] = False,
) -> None:
    """Play the actions of a run again and check its records; exit code 2 if one does not hold.

    Example: roboirg leaderboard verify runs/first --sample 10%
    """
    from roboirg.apps.leaderboard.admission import find_refusal
    from roboirg.apps.leaderboard.packing import opened_run
    from roboirg.apps.leaderboard.run_verification import verify_run
    from roboirg.util.processor import worker_count

    with opened_run(folder_of(run)) as folder, progress_bar("records") as show:
        found = verify_run(
            folder,
            sample=_share(sample),
            seed=sample_seed,
            workers=worker_count(),
            progress=show,
        )
        refusal = find_refusal(folder) if submission else ""
    _print(found)
    if submission and found.holds:
        typer.echo(f"The board does not rank it: {refusal}." if refusal else "The board ranks it.")
    elif submission:
        typer.echo("The board does not accept it: what it says does not hold.")
    if refusal or not found.holds:
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

    check_output_file(out)
    manifest = pack_run(folder_of(run), out, videos=videos, logs=logs)
    size = out.stat().st_size / 1e6
    typer.echo(f"{counted(manifest.records, 'record')}, {size:.1f} MB: {out}")


def board(
    folder: Annotated[str, typer.Argument(help="Folder of packed runs.", metavar="DIR")],
    out: Annotated[Path, typer.Option(help="Folder to write; it also keeps what was verified.")],
    verify_share: Annotated[
        str | None,
        typer.Option(
            "--verify",
            help="Share of the episodes to play again, such as 5%, of packs of which fewer were.",
        ),
    ] = None,
) -> None:
    """Make a static site of packed runs: the board, a page for each run, and the rules.

    Example: roboirg leaderboard board packs --out site --verify 5%
    """
    from roboirg.apps.leaderboard.board_page import read_packs, write_board
    from roboirg.evaluation.analysis.page.report import check_report_support
    from roboirg.util.processor import worker_count

    check_report_support()
    path = folder_of(folder)
    if out.resolve().is_relative_to(path.resolve()):
        raise InvalidValueError(
            f"--out is {str(out)!r}, in the folder of the packs, where a submission could put what "
            "the board trusts; give a folder outside."
        )
    with progress_bar("packed runs") as show:
        packs = read_packs(
            path,
            out,
            sample=None if verify_share is None else _share(verify_share),
            workers=worker_count(),
            progress=show,
        )
    page = write_board(packs, out)
    typer.echo(f"{counted(len(packs), 'packed run')}: {page}")


def _share(text: str) -> float:
    """Return a share such as 5% or 0.05."""
    number = text.strip().removesuffix("%")
    with contextlib.suppress(ValueError):
        share = float(number) / (100 if "%" in text else 1)
        if 0 < share <= 1:
            return share
    raise InvalidValueError(f"The share of episodes is {text!r}; give one such as 5%.")


def _print(found: Verification) -> None:
    from roboirg.apps.leaderboard.record_check import TOLERANCE, ReplayVerdict

    played = found.records - found.verdicts[ReplayVerdict.NOT_REPLAYED]
    verb = verb_for(played, "were")
    typer.echo(
        f"{counted(found.records, 'record')}; {played:,} {verb} played again from stored actions."
    )
    typer.echo(f"End states equal bit for bit: {found.verdicts[ReplayVerdict.EXACT]:,}.")
    if tolerant := found.verdicts[ReplayVerdict.TOLERANT]:
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
    _print_some("has no record", found.missing)
    _print_some("has several verdicts", found.doubled)
    if len(found.checks) > _MOST_SHOWN:
        typer.echo(f"… and {counted(len(found.checks) - _MOST_SHOWN, 'more record')}.")
    wrong = len(found.checks) + len(found.missing) + len(found.doubled)
    fails = f"{counted(wrong, 'thing')} {verb_for(wrong, 'do')} not hold."
    all_hold = "Everything holds." if played == found.records else "All that was checked holds."
    typer.echo(all_hold if found.holds else fails)


def _print_some(what: str, slugs: tuple[str, ...]) -> None:
    for slug in slugs[:_MOST_SHOWN]:
        typer.echo(f"{what}: {printable(slug)}")
    if len(slugs) > _MOST_SHOWN:
        typer.echo(f"… and {len(slugs) - _MOST_SHOWN:,} more.")


def repeat(
    run: Folder,
    out: Annotated[
        str, typer.Option(help="Folder for the repetition; give the same folder again to resume.")
    ],
) -> None:
    """Play a run's plan again with its policies, and print which verdicts changed.

    Example: roboirg leaderboard repeat runs/first --out runs/again
    """
    from roboirg.apps.leaderboard.repeats import flips_by_cell, repeated_episodes, write_flips
    from roboirg.cli.run_commands import play
    from roboirg.evaluation.plan.stored_plans import read_plan, with_secret
    from roboirg.evaluation.run.executor import choose_executor

    folder, target = folder_of(run), folder_of(out)
    if folder.resolve() == target.resolve():
        raise InvalidValueError(f"{out} is the run itself; choose another --out.")
    plan = read_plan(folder)
    if plan is None:
        raise InvalidValueError(f"{run} has no readable plan.json, so it cannot be repeated.")
    add_working_directory(last=True)
    summary = play(
        with_secret(plan, folder).checked(),
        target,
        choose_executor(episode_timeout_s=plan.episode_timeout_s),
        retry=True,
    )
    found = repeated_episodes(folder, target)
    _print_flips(found)
    for where in (folder, target):
        write_flips(flips_by_cell(found), where)
    report_problems(summary, target)


def _print_flips(episodes: tuple[RepeatedEpisode, ...]) -> None:
    from rich.console import Console
    from rich.table import Table

    from roboirg.apps.leaderboard.repeats import count_flips, flips_by_cell
    from roboirg.evaluation.analysis.stats.option_labels import options_label

    table = Table(title="verdicts, first and second time", title_justify="left")
    for name in ("policy", "setting"):
        table.add_column(name)
    for name in ("✓✓", "✗✗", "✓✗", "✗✓", "other actions", "errors"):
        table.add_column(name, justify="right")
    for (policy, options), one in flips_by_cell(episodes).items():
        counts = (one.both, one.neither, one.lost, one.gained, one.acted_differently, one.errors)
        table.add_row(policy, options_label(options), *map(str, counts))
    Console().print(table)
    for changed in [one for one in episodes if one.is_flip][:_MOST_SHOWN]:
        where = (
            ""
            if changed.differs_at is None
            else f"; the actions differ from number {changed.differs_at} on"
        )
        typer.echo(f"{changed.slug}: {' then '.join(changed.outcomes)}{where}")
    for policy, (before, now) in dict.fromkeys((one.policy, one.arithmetic) for one in episodes):
        if before != now:
            typer.echo(
                printable(f"{policy}: first {before or 'unknown'}; then {now or 'unknown'}.")
            )
        elif now:
            typer.echo(printable(f"{policy}: {now}, both times."))
    found = count_flips(episodes)
    typer.echo(f"{found.flips:,} of {counted(found.verdicts, 'verdict')} changed.")


def add_commands(app: typer.Typer) -> None:
    group = typer.Typer(no_args_is_help=True, help="Verify, pack, rank and repeat runs.")
    for command in (verify, pack, board, repeat):
        group.command()(command)
    app.add_typer(group, name="leaderboard")
