"""One self-contained HTML page with every episode: instruction, events, verdict."""

from __future__ import annotations

import base64
import contextlib
import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.page.columns import make_filters, make_numbers
from roboirg.evaluation.analysis.page.details import EpisodeDetails
from roboirg.evaluation.analysis.page.episodes import JsonObject, PageEpisodes
from roboirg.evaluation.analysis.page.matrix import make_matrix
from roboirg.evaluation.analysis.page.run_warnings import comparisons, facts_of, run_warnings
from roboirg.evaluation.analysis.results.frame import Frame
from roboirg.evaluation.analysis.results.reading import with_words
from roboirg.evaluation.analysis.stats.breakdowns import BREAKDOWNS
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.arm_table import make_arm_table
from roboirg.evaluation.analysis.tables.diagnostic_tables import (
    make_breakdown_table,
    make_failure_table,
)
from roboirg.evaluation.analysis.tables.table import Table
from roboirg.evaluation.plan.sources import Source
from roboirg.evaluation.records.film import FRAME_RATE, FRAME_STEPS, LAST_FRAME_REPEATS
from roboirg.evaluation.records.packs import PACK_SUFFIX
from roboirg.evaluation.records.record import Record
from roboirg.language.settings import EXPLICIT, all_settings
from roboirg.util.atomic_write import replacing
from roboirg.util.freed_memory import paused_collection
from roboirg.util.web.page_templates import check_page_support, template_environment

REPORT_FILE = "report.html"
MAX_EMBEDDED_BYTES = 20_000_000
"""Larger videos, taken together, stay next to the page."""
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

Progress = Callable[[int, int], None]
"""Called after each episode: how many are done, and how many there are."""


@paused_collection()
def write_report(
    source: Source,
    *,
    against: Source | None = None,
    out: Path | None = None,
    videos: bool = True,
    served: bool = False,
    progress: Progress | None = None,
) -> Path:
    """Write the page of a run atomically and return its path.

    Args:
        source: the run.
        against: another run, to compare with episode by episode.
        out: file to write; without it, ``report.html`` (or ``report-POLICY.html``) in the run's
            folder, or a page next to its pack, with the pack's name.
        videos: whether to show the videos: in the page, or of more than `MAX_EMBEDDED_BYTES` next
            to it. Those of a pack cannot be next to it, as the files are gone when it is closed.
        served: whether the page is for a server of the run's folder: it is written there and links
            to all videos.
        progress: called after each episode.
    """
    check_page_support("The report")
    path = source.folder / REPORT_FILE if served else out or _usual_path(source)
    sources = [source] if against is None else [source, against]
    runs = {one.name: one for one in sources}
    if len(runs) < len(sources):
        runs = {str(one.path): one for one in sources}
    if len(runs) < len(sources):
        raise InvalidValueError(f"{source.path} is on both sides; name another run or policy.")
    episodes = PageEpisodes.of(runs, videos=videos)
    size = sum(path.stat().st_size for path in _media(episodes).values())
    gone = [one.unpacked for one in sources if one.unpacked is not None and not served]
    details = EpisodeDetails(path.parent, not served and size <= MAX_EMBEDDED_BYTES, gone)
    pieces = _render(episodes, details, progress)
    with replacing(path) as part, part.open("w", encoding="utf-8") as file:
        file.writelines(pieces)
    return path


def _usual_path(source: Source) -> Path:
    """Return where the page goes: into the run's folder, or next to its pack."""
    if source.unpacked:
        return source.path.with_name(f"{source.path.name.removesuffix(PACK_SUFFIX)}.html")
    name = re.sub(r"\W+", "-", "-".join(("report", *(source.policies or ()))))
    return source.folder / f"{name}.html"


def _render(
    episodes: PageEpisodes, details: EpisodeDetails, progress: Progress | None
) -> Iterator[str]:
    """Return the page in pieces, as a large one takes memory; the details are made for it."""
    template = template_environment("roboirg.evaluation.analysis.page").get_template(
        f"{REPORT_FILE}.j2"
    )
    frame = with_words(episodes.data.frame, _add_all(details, episodes, progress))
    data = json.dumps(
        _data(episodes, details), ensure_ascii=False, separators=(",", ":"), allow_nan=False
    )
    lines = "\n".join(details.lines)
    details.lines.clear()
    return template.generate(
        styles=STYLES,
        scripts=SCRIPTS,
        name=" against ".join(episodes.runs),
        facts=facts_of(episodes),
        warnings=run_warnings(episodes),
        breakdowns=_breakdown_tables(frame),
        failures=_tables_with_rows(lambda: make_failure_table(episodes.data, means=True)),
        links_videos=details.links_videos,
        media=((name, _data_uri(path)) for name, path in _media(episodes).items())
        if details.embeds
        else (),
        data=_safe(data),
        details=_safe(lines),
    )


def _media(episodes: PageEpisodes) -> dict[str, Path]:
    """Return the files of all videos by the names that the page's script knows them by."""
    return {
        f"{kind}-{one.key}": path
        for one in episodes.all
        for kind, path in (("film", one.film), ("poster", one.poster))
        if path is not None
    }


def _add_all(
    details: EpisodeDetails, episodes: PageEpisodes, progress: Progress | None
) -> Iterator[Record]:
    """Add the details of all episodes, and yield their whole records, each read once."""
    for done, (one, record) in enumerate(zip(episodes.all, episodes.whole(), strict=True), 1):
        details.add(one, record)
        yield record
        if progress is not None:
            progress(done, len(episodes.all))


def _data(episodes: PageEpisodes, details: EpisodeDetails) -> JsonObject:
    filters = make_filters(episodes)
    numbers = make_numbers(episodes)
    policies = [one.policy for one in episodes.names]
    twins = (place for place, one in enumerate(policies) if place and one == policies[0])
    return {
        "choices": [
            {"name": name, "label": one.label, "values": one.values, "groups": one.groups}
            for name, one in filters.items()
        ],
        "columns": {**numbers, **{name: one.column for name, one in filters.items()}},
        "strings": list(details.strings),
        "words": details.words,
        "matrix": make_matrix(episodes),
        "comparisons": comparisons(episodes),
        # At first a policy is compared with itself in the other run, or else with the next one.
        "sides": [0, next(twins, min(1, len(policies) - 1))],
        "reference": EXPLICIT,
        "framed": [name for name, one in all_settings().items() if "frame" in one.reads],
        "film": {"every": FRAME_STEPS, "rate": FRAME_RATE, "repeats": LAST_FRAME_REPEATS},
    }


def _breakdown_tables(frame: Frame) -> list[Table]:
    """Return the tables of control arms, and of gaps by kind of instruction, that have rows."""
    tables = _tables_with_rows(lambda: make_arm_table(RunData(frame)))  # no scene may have two arms
    tables += [make_breakdown_table(one, frame) for one in BREAKDOWNS.values()]
    return [table for table in tables if table.rows]


def _tables_with_rows(make: Callable[[], Table]) -> list[Table]:
    """Return the table that is made; none if it would have no rows."""
    with contextlib.suppress(InvalidValueError):
        return [make()]
    return []


def _data_uri(path: Path) -> str:
    kind = "video/mp4" if path.suffix == ".mp4" else "image/jpeg"
    return f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"


def _safe(text: str) -> str:
    """Escape JSON for a script element: no text in it ends the element."""
    return text.replace("<", "\\u003c")
