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
from roboirg.evaluation.analysis.page.episode_videos import EpisodeVideos
from roboirg.evaluation.analysis.page.matrix import make_matrix
from roboirg.evaluation.analysis.page.run_warnings import comparisons, facts_of, run_warnings
from roboirg.evaluation.analysis.stats.arm_figures import arm_figures
from roboirg.evaluation.analysis.stats.breakdowns import BREAKDOWNS, label_instructions
from roboirg.evaluation.analysis.stats.cells import Cells, PolicyRun
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.arm_table import make_arm_table
from roboirg.evaluation.analysis.tables.breakdown_table import make_breakdown_table
from roboirg.evaluation.analysis.tables.table import Table
from roboirg.evaluation.records.episode_log import logged_slugs
from roboirg.evaluation.records.film import FRAME_RATE, FRAME_STEPS, LAST_FRAME_REPEATS
from roboirg.evaluation.records.record import Job
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
    folder: Path,
    *,
    planned: Sequence[Job] = (),
    videos: bool = True,
    against: Path | None = None,
    planned_against: Sequence[Job] = (),
    progress: Progress | None = None,
) -> Path:
    """Write ``report.html`` into a run's folder atomically.

    Args:
        folder: of the run.
        planned: jobs that should have a record; the page marks cells that lack some.
        videos: whether to embed the videos.
        against: folder of another run, to compare with episode by episode.
        planned_against: planned jobs of the other run.
        progress: called after each episode.
    """
    check_report_support()
    path = folder / REPORT_FILE
    runs = [_run(folder, planned, videos=videos)]
    if against is not None:
        link = f"{os.path.relpath(against, folder)}/"
        runs.append(_run(against, planned_against, videos=videos, link=link))
    write_atomically(path, render_runs(_distinct(runs, folder, against), progress=progress))
    return path


def make_view(folder: Path, planned: Sequence[Job] = (), progress: Progress | None = None) -> str:
    """Return the page of a run as it is served, with links to its videos."""
    check_report_support()
    return render_runs([_run(folder, planned, videos=True)], embed=False, progress=progress)


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


def _run(folder: Path, planned: Sequence[Job], *, videos: bool, link: str = "") -> Run:
    stored = read_summaries(folder)
    media = folder if videos else None
    logs = logged_slugs(folder)
    return Run(folder.resolve().name, stored.newest, media, planned, link, stored, logs)


def _distinct(runs: Sequence[Run], *folders: Path | None) -> list[Run]:
    """Return the runs with distinct names."""
    if len({run.name for run in runs}) == len(runs):
        return list(runs)
    return [
        dataclasses.replace(run, name=str(folder))
        for run, folder in zip(runs, [one for one in folders if one is not None], strict=True)
    ]
