"""One self-contained HTML page that shows every episode: what was said, done and judged."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboirg.analysis.page.columns import Columns, make_columns
from roboirg.analysis.page.entries import EpisodeEntries, Run, make_entries
from roboirg.analysis.page.films import EpisodeVideos
from roboirg.analysis.page.matrix import make_matrix
from roboirg.analysis.page.run_warnings import comparisons, facts_of, run_warnings
from roboirg.core.errors import MissingDependencyError
from roboirg.evaluation.video_writer import LAST_FRAME_REPEATS, VideoOptions
from roboirg.records.record import Job, Record
from roboirg.records.store import read_records, write_atomically

if TYPE_CHECKING:
    import jinja2

REPORT_FILE = "report.html"
FILMING = VideoOptions()
"""As `roboirg run` films, so that the page finds the moment of an event in a film."""
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
"""Parts of the style sheet and of the script, in their order."""


def write_report(
    folder: Path,
    *,
    planned: Sequence[Job] = (),
    videos: bool = True,
    against: Path | None = None,
    planned_against: Sequence[Job] = (),
) -> Path:
    """Write ``report.html`` into a run's folder, whole or not at all.

    Args:
        folder: of the run.
        planned: jobs that should be there; the page says which cells lack some.
        videos: put the films into the page.
        against: folder of a run to compare with, episode by episode.
        planned_against: jobs that should be there.

    Returns:
        The path of the page.

    Raises:
        StoreError: there are no records, or they cannot be read.
        MissingDependencyError: Jinja is not installed.
    """
    check_report_support()
    path = folder / REPORT_FILE
    runs = [_run(folder, planned, videos=videos)]
    if against is not None:
        link = f"{os.path.relpath(against, folder)}/"
        runs.append(_run(against, planned_against, videos=videos, link=link))
    write_atomically(path, render_runs(_distinct(runs, folder, against)))
    return path


def make_view(folder: Path, planned: Sequence[Job] = ()) -> str:
    """The page about a run as it is served: its films stay beside it.

    Args:
        folder: of the run.
        planned: jobs that should be there.

    Raises:
        StoreError: there are no records, or they cannot be read.
        MissingDependencyError: Jinja is not installed.
    """
    check_report_support()
    return render_runs([_run(folder, planned, videos=True)], embed=False)


def render(
    records: Sequence[Record],
    folder: Path | None = None,
    planned: Sequence[Job] = (),
    *,
    name: str = "",
) -> str:
    """The page about one run as text.

    Args:
        records: one for each identity.
        folder: where the films are; None leaves them out. More than
            `roboirg.analysis.page.films.MOST_FILM_BYTES` of them are linked to, by their paths in
            it, rather than embedded.
        planned: jobs that should be there.
        name: of the run.

    Raises:
        MissingDependencyError: Jinja is not installed.
    """
    return render_runs([Run(name, records, folder, planned)])


def render_runs(runs: Sequence[Run], *, embed: bool = True) -> str:
    """The page about one run, or two of them held against each other.

    Args:
        runs: one or two.
        embed: put films into the page, if they are not too much together.

    Raises:
        MissingDependencyError: Jinja is not installed.
    """
    template = _environment().get_template(TEMPLATE)
    entries = make_entries(runs)
    films = EpisodeVideos.of(entries.all, embed=embed)
    columns = make_columns(entries, films)
    return template.render(
        styles=STYLES,
        scripts=SCRIPTS,
        name=" against ".join(run.name for run in runs),
        count=len(entries.all),
        facts=facts_of(runs),
        notices=run_warnings(entries),
        films_are_beside=films.count > 0 and not films.embeds,
        films=columns.films,
        data=_json(_data(entries, columns)),
        details="\n".join(map(_safe, columns.details)),
    )


def check_report_support() -> None:
    """Complain now if the page cannot be made.

    Raises:
        MissingDependencyError: Jinja is not installed.
    """
    try:
        import jinja2  # noqa: F401 - an extra
    except ImportError as error:
        raise MissingDependencyError(
            f"The report needs Jinja, which is not installed ({error}); run: "
            "pip install 'roboirgbench[report]'"
        ) from error


def _data(entries: EpisodeEntries, columns: Columns) -> dict[str, Any]:
    return {
        "choices": [choice._asdict() for choice in columns.choices],
        "columns": columns.columns,
        "strings": columns.strings.texts,
        "words": columns.words,
        "matrix": make_matrix(entries),
        "comparisons": comparisons(entries),
        "sides": _sides(entries),
        "film": {"every": FILMING.every, "rate": FILMING.rate, "repeats": LAST_FRAME_REPEATS},
    }


def _sides(entries: EpisodeEntries) -> list[int]:
    """Whom to hold against each other first: a policy and itself in the other run, or the next."""
    names = list(entries.names)
    twins = [place for place, who in enumerate(names) if place and who.policy == names[0].policy]
    return [0, twins[0] if twins else min(1, len(names) - 1)]


def _json(value: object) -> str:
    return _safe(json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False))


def _safe(text: str) -> str:
    """JSON that can stand in a script element: no text in it ends the element."""
    return text.replace("<", "\\u003c")


def _environment() -> jinja2.Environment:
    check_report_support()
    import jinja2

    return jinja2.Environment(
        loader=jinja2.PackageLoader("roboirg.analysis.page"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )


def _run(folder: Path, planned: Sequence[Job], *, videos: bool, link: str = "") -> Run:
    media = folder if videos else None
    return Run(folder.resolve().name, read_records(folder), media, planned, link)


def _distinct(runs: Sequence[Run], *folders: Path | None) -> list[Run]:
    """The runs under different names."""
    if len({run.name for run in runs}) == len(runs):
        return list(runs)
    return [
        Run(str(folder), run.records, run.folder, run.planned, run.link)
        for run, folder in zip(runs, [one for one in folders if one is not None], strict=True)
    ]
