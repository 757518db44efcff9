"""One self-contained HTML page with every episode: instruction, events, verdict."""

from __future__ import annotations

import dataclasses
import itertools
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from roboirg.evaluation.analysis.page.columns import Columns, Progress, make_columns
from roboirg.evaluation.analysis.page.entries import EpisodeEntries, Run, make_entries
from roboirg.evaluation.analysis.page.episode_videos import MAX_EMBEDDED_BYTES, EpisodeVideos
from roboirg.evaluation.analysis.page.matrix import make_matrix
from roboirg.evaluation.analysis.page.run_warnings import comparisons, facts_of, run_warnings
from roboirg.evaluation.analysis.stats.arm_figures import arm_figures
from roboirg.evaluation.analysis.stats.breakdowns import BREAKDOWNS, label_instructions
from roboirg.evaluation.analysis.stats.cells import Cells, PolicyRun
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.arm_table import make_arm_table
from roboirg.evaluation.analysis.tables.breakdown_table import make_breakdown_table
from roboirg.evaluation.analysis.tables.table import Table
from roboirg.evaluation.plan.sources import Source
from roboirg.evaluation.records.episode_log import logged_slugs
from roboirg.evaluation.records.film import (
    FRAME_RATE,
    FRAME_STEPS,
    LAST_FRAME_REPEATS,
    VIDEO_FOLDER,
)
from roboirg.evaluation.records.packs import PACK_SUFFIX
from roboirg.evaluation.records.store import read_summaries
from roboirg.language.settings import EXPLICIT, all_settings
from roboirg.util.atomic_write import write_atomically
from roboirg.util.web.page_templates import check_page_support, template_environment

REPORT_FILE = "report.html"
TEMPLATE = "report.html.j2"
STYLES = ("base", "overview", "filters", "episodes", "pairs")
SCRIPTS = (
    "dom",
    "store",
    "tip",
    "overview",
    "filters",
    "words",
    "timeline",
    "detail",
    "pager",
    "episodes",
    "pairs",
    "main",
)
"""Parts of the style sheet and of the script, in order."""


def write_report(
    source: Source,
    *,
    against: Source | None = None,
    out: Path | None = None,
    videos: bool = True,
    progress: Progress | None = None,
) -> Path:
    """Write the page of a run atomically and return its path.

    Args:
        source: the run.
        against: another run, to compare with episode by episode.
        out: file to write; without it, ``report.html`` in the run's folder, or a page next to its
            pack, with the pack's name.
        videos: whether to embed the videos.
        progress: called after each episode.
    """
    check_report_support()
    beside = source.path.with_name(f"{source.path.name.removesuffix(PACK_SUFFIX)}.html")
    path = out or (beside if source.unpacked else source.folder / REPORT_FILE)
    sources = [one for one in (source, against) if one is not None]
    runs = [_run(one, path.parent, videos=videos) for one in sources]
    if len({run.name for run in runs}) < len(runs):
        paths = (str(one.path) for one in sources)
        runs = [dataclasses.replace(run, name=one) for run, one in zip(runs, paths, strict=True)]
    write_atomically(path, render_runs(runs, progress=progress))
    return path


def make_view(source: Source, progress: Progress | None = None) -> str:
    """Return the page of a run as it is served, with links to its videos."""
    check_report_support()
    return render_runs([_run(source)], embed=False, progress=progress)


def render_runs(
    runs: Sequence[Run], *, embed: bool = True, progress: Progress | None = None
) -> str:
    """Return the page of one run, or of two to compare.

    Videos of more than `MAX_EMBEDDED_BYTES` are linked to.
    """
    check_report_support()
    template = template_environment("roboirg.evaluation.analysis.page").get_template(TEMPLATE)
    entries = make_entries(runs)
    videos = EpisodeVideos.of(entries.all, embed=embed)
    columns = make_columns(entries, videos, progress)
    return template.render(
        styles=STYLES,
        scripts=SCRIPTS,
        name=" against ".join(run.name for run in runs),
        count=len(entries.all),
        facts=facts_of(runs),
        warnings=run_warnings(entries),
        breakdowns=_breakdown_tables(runs, entries),
        videos_are_linked=videos.count > 0 and not videos.embeds,
        videos=columns.videos,
        data=_json(_data(entries, columns)),
        details="\n".join(map(_safe, columns.details)),
    )


def check_report_support() -> None:
    """Check that the page can be made."""
    check_page_support("The report")


def _data(entries: EpisodeEntries, columns: Columns) -> dict[str, Any]:
    sides, change = _sides(entries)
    return {
        "choices": [choice._asdict() for choice in columns.choices],
        "columns": columns.columns,
        "strings": columns.strings.texts,
        "words": columns.words,
        "matrix": make_matrix(entries),
        "comparisons": comparisons(entries),
        "sides": sides,
        "change": change,
        "reference": EXPLICIT,
        "framed": [name for name, one in all_settings().items() if "frame" in one.reads],
        "film": {"every": FRAME_STEPS, "rate": FRAME_RATE, "repeats": LAST_FRAME_REPEATS},
    }


def _breakdown_tables(runs: Sequence[Run], entries: EpisodeEntries) -> list[Table]:
    """Return the tables of control arms, and of gaps by kind of instruction, that have rows."""
    breakdowns = tuple(BREAKDOWNS.values())
    instructions = itertools.chain.from_iterable(run.whole(run.records) for run in runs)
    labels = label_instructions(breakdowns, instructions)
    tables = [
        make_breakdown_table(one, entries.cells, labels[one.name], entries.names)
        for one in breakdowns
    ]
    data = RunData.of([(run.name, run.records) for run in runs])
    arms = [make_arm_table(data)] if arm_figures(data) else []
    return [*arms, *(table for table in tables if table.rows)]


def _sides(entries: EpisodeEntries) -> tuple[list[int], str]:
    """Return the policies to compare first, and which of their episodes to show.

    That is a policy and itself in the other run, or else the first two whose verdicts differ.
    """
    names = list(entries.names)
    twins = [place for place, one in enumerate(names) if place and one.policy == names[0].policy]
    pairs = [(0, twins[0])] if twins else [*itertools.combinations(range(len(names)), 2)]
    for one, other in pairs:
        if _differ(entries.cells, names[one], names[other]):
            return [one, other], "changed"
    return [*pairs[0]] if pairs else [0, 0], "all"


def _differ(cells: Cells, first: PolicyRun, second: PolicyRun) -> bool:
    """Return whether one of two policies succeeded in an episode in which the other failed."""
    for key, cell in cells.items():
        other = cells.get(key._replace(policy_run=second))
        if key.policy_run == first and other is not None:
            theirs = other.verdicts
            if any(theirs.get(trial, won) != won for trial, won in cell.verdicts.items()):
                return True
    return False


def _json(value: object) -> str:
    return _safe(json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False))


def _safe(text: str) -> str:
    """Escape JSON for a script element: no text in it ends the element."""
    return text.replace("<", "\\u003c")


def _run(source: Source, place: Path | None = None, *, videos: bool = True) -> Run:
    """Return a run whose page is written to the folder `place`; None if the page is served.

    The files of a pack are gone when it is closed: a written page can embed them, not link to them.
    """
    folder = source.folder
    stored = read_summaries(folder)
    is_closed = place is not None and source.unpacked is not None
    if is_closed:
        sizes = (path.stat().st_size for path in (folder / VIDEO_FOLDER).rglob("*"))
        videos = videos and sum(sizes) <= MAX_EMBEDDED_BYTES
    link = "." if place is None else os.path.relpath(folder, place)
    return Run(
        source.name,
        tuple(source.wanted(stored.newest)),
        folder if videos else None,
        source.planned,
        "" if link == "." else f"{link}/",
        stored,
        frozenset() if is_closed else logged_slugs(folder),
    )
