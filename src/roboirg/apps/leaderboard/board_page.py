"""The leaderboard as a static site: the board, a page for each packed run, and the rules."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from roboirg.apps.leaderboard.admission import find_refusal, ranked_plans
from roboirg.apps.leaderboard.board_rows import BoardRate, BoardRow, PackedRun, board_rows
from roboirg.apps.leaderboard.entry_tables import entry_facts, entry_tables
from roboirg.apps.leaderboard.pack_checks import check_pack, read_check
from roboirg.apps.leaderboard.packing import PACK_SUFFIX, opened_run
from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.core.plain_text import printable
from roboirg.core.version import __version__
from roboirg.evaluation.analysis.page.report import check_report_support
from roboirg.evaluation.analysis.stats.option_labels import setting_sort_key
from roboirg.evaluation.plan.stored_plans import read_plans
from roboirg.evaluation.records.store import read_results
from roboirg.util.atomic_write import write_atomically
from roboirg.util.web.page_templates import template_environment

BOARD_FILE = "index.html"
ENTRIES = "entries"
_NAME = re.compile(rf"[a-z0-9][a-z0-9_.-]*{re.escape(PACK_SUFFIX)}")
"""Of a pack's file: no two names look alike, or differ in case alone."""


class _Cell(NamedTuple):
    """A rate as the page shows it, with the number by which the column is sorted."""

    text: str
    order: float
    interval: str = ""
    note: str = ""
    is_top: bool = False


def read_packs(
    folder: Path,
    site: Path,
    *,
    sample: float | None = None,
    workers: int = 0,
    progress: Callable[[int, int], object] | None = None,
) -> tuple[PackedRun, ...]:
    """Read all packed runs of a folder; what cannot be read, or has an odd name, is not ranked.

    Args:
        folder: of the packs.
        site: of the board, which keeps what was checked before.
        sample: share of the episodes to play again where that was not done before; None to check
            nothing.
        workers: number of processes that play.
        progress: is called with the number of packs that were read, and of all.
    """
    paths = sorted(folder.glob(f"*{PACK_SUFFIX}"))
    packs = []
    for count, path in enumerate(paths, start=1):
        try:
            packs.append(_read_pack(path, site, sample, workers))
        except RoboIRGError as error:
            packs.append(PackedRun(_name(path), (), (), None, str(error)))
        if progress is not None:
            progress(count, len(paths))
    return tuple(packs)


def _read_pack(path: Path, site: Path, sample: float | None, workers: int) -> PackedRun:
    """Read one pack.

    Raises:
        RoboIRGError: it cannot be read, or its name is refused.
    """
    if not _NAME.fullmatch(path.name) or path.is_symlink():
        raise InvalidValueError(
            "a pack is a file, not a link, and its name has small letters, digits, dots, hyphens "
            "and underscores alone"
        )
    if sample is None:
        check = read_check(path, site)
    else:
        check = check_pack(path, site, sample=sample, workers=workers)
    if check is not None and not check.records:  # it could not even be opened
        return PackedRun(_name(path), (), (), check)
    with opened_run(path) as run:
        results, plans, why = read_results(run), read_plans(run), find_refusal(run)
    planned = [job for plan in plans for job in plan.drawable_jobs()]
    return PackedRun(_name(path), results, planned, check, why)


def write_board(runs: Sequence[PackedRun], folder: Path) -> Path:
    """Write the site of packed runs into a folder; return its first page."""
    for run in runs:
        write_atomically(folder / ENTRIES / f"{run.name}.html", render_entry(run))
    write_atomically(folder / "rules.html", _render("rules", plans=ranked_plans()))
    write_atomically(folder / BOARD_FILE, render_board(runs))
    return folder / BOARD_FILE


def render_board(runs: Sequence[PackedRun]) -> str:
    """Return the page that ranks packed runs."""
    rows = board_rows(runs)
    public = {(name, False) for row in rows for name in row.rates}
    private = {(name, True) for row in rows if row.private for name in row.private.rates}
    columns = sorted(public | private, key=lambda one: (setting_sort_key(one[0]), one[1]))
    return _render(
        "board",
        columns=columns,
        entries={run.name for run in runs},
        rows=[(row, [_cell(_rate(row, *column)) for column in columns]) for row in rows],
        conditions=sorted({row.conditions for row in rows}),
        unranked=[(run.name, why) for run in runs if (why := run.why_unranked)],
    )


def render_entry(run: PackedRun) -> str:
    """Return the page of one packed run."""
    return _render(
        "entry",
        top="../",
        run=run,
        file=f"{run.name}{PACK_SUFFIX}",
        facts=entry_facts(run),
        tables=entry_tables(run),
    )


def _render(name: str, *, top: str = "", **content: object) -> str:
    check_report_support()
    environment = template_environment("roboirg.apps.leaderboard")
    template = environment.get_template(f"{name}.html.j2")
    return template.render(version=__version__, top=top, **content)


def _rate(row: BoardRow, setting: str, is_private: bool) -> BoardRate | None:
    shown = row.private if is_private else row
    return None if shown is None else shown.rates.get(setting)


def _cell(rate: BoardRate | None) -> _Cell:
    if rate is None:
        return _Cell("–", -1.0)
    notes = []
    if rate.tasks < rate.of:
        notes.append(f"{rate.tasks} of {rate.of} tasks")
    if not rate.is_complete:
        notes.append("incomplete")
    interval = "" if rate.interval is None else "–".join(f"{end:.1f}" for end in rate.interval)
    return _Cell(f"{rate.percent:.1f}", rate.percent, interval, ", ".join(notes), rate.is_top)


def _name(path: Path) -> str:
    return printable(path.name.removesuffix(PACK_SUFFIX))
