"""One self-contained HTML page with every episode: instruction, events, verdict."""

from __future__ import annotations

import base64
import contextlib
import json
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from roboirg.analysis.measures.breakdowns import BREAKDOWNS
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.page.columns import make_filters, make_numbers
from roboirg.analysis.page.details import EpisodeDetails
from roboirg.analysis.page.episodes import JsonObject, PageEpisodes
from roboirg.analysis.page.evidence_paths import evidence_paths
from roboirg.analysis.page.matrix import make_matrix
from roboirg.analysis.page.run_warnings import comparisons, facts_of, run_warnings
from roboirg.analysis.palette import palette
from roboirg.analysis.results.frame import Frame
from roboirg.analysis.results.reading import with_words
from roboirg.analysis.results.sources import Source
from roboirg.analysis.tables.arm_table import make_arm_table
from roboirg.analysis.tables.diagnostic_tables import (
    make_breakdown_table,
    make_failure_table,
)
from roboirg.analysis.tables.table import Table
from roboirg.core.errors import InvalidValueError
from roboirg.language.settings import EXPLICIT, all_settings
from roboirg.records.film import FRAME_RATE, FRAME_STEPS, LAST_FRAME_REPEATS
from roboirg.records.packs import PACK_SUFFIX
from roboirg.records.record import Record
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
    """Write the report of a run as an HTML page and return its path.

    The file appears whole or not at all.

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
    sources = [source]
    if against is not None:
        sources.append(against)
    runs = _by_name(sources)
    episodes = PageEpisodes.of(runs, videos=videos)
    if served:
        path = source.folder / REPORT_FILE
        details = EpisodeDetails(path.parent, embeds=False)
    else:
        path = out or _usual_path(source)
        details = _details(path.parent, episodes, sources)
    pieces = _render(episodes, details, progress)
    with replacing(path) as part, part.open("w", encoding="utf-8") as file:
        file.writelines(pieces)
    return path


def _details(folder: Path, episodes: PageEpisodes, sources: Iterable[Source]) -> EpisodeDetails:
    """Return the details for a page in a folder; videos are in the page unless they are large."""
    size = sum(media.stat().st_size for media in _media(episodes).values())
    unpacked = [run.unpacked for run in sources if run.unpacked is not None]
    return EpisodeDetails(folder, embeds=size <= MAX_EMBEDDED_BYTES, temporary=unpacked)


def _by_name(sources: Sequence[Source]) -> dict[str, Source]:
    """Return the runs of a page by their names, or by their paths if their names are equal.

    Raises:
        InvalidValueError: the same run is given twice.
    """
    runs = {source.name: source for source in sources}
    if len(runs) < len(sources):
        runs = {str(source.path): source for source in sources}
    if len(runs) < len(sources):
        raise InvalidValueError(f"{sources[0].path} is on both sides; name another run or policy.")
    return runs


def _usual_path(source: Source) -> Path:
    """Return the file of a page whose place was not chosen.

    It is ``report.html`` in the run's folder, ``report-POLICY.html`` if the page is of one policy,
    or next to the file of a packed run.
    """
    if source.unpacked:
        return source.path.with_name(f"{source.path.name.removesuffix(PACK_SUFFIX)}.html")
    name = "-".join(("report", *(source.policies or ())))
    name = re.sub(r"\W+", "-", name)  # what is no letter, digit or underscore
    return source.folder / f"{name}.html"


def _render(
    episodes: PageEpisodes, details: EpisodeDetails, progress: Progress | None
) -> Iterator[str]:
    """Return the HTML of the page in pieces, because a large one takes much memory.

    Args:
        episodes: of the page.
        details: collects what the page shows of single episodes; empty at first.
        progress: called after each episode.
    """
    template = template_environment("roboirg.analysis.page").get_template(f"{REPORT_FILE}.j2")
    # Reads the whole records, so it adds the details; what comes below needs these.
    frame = with_words(episodes.data.frame, _add_all(details, episodes, progress))
    data = json.dumps(
        _data(episodes, details), ensure_ascii=False, separators=(",", ":"), allow_nan=False
    )
    lines = "\n".join(details.lines)
    details.lines.clear()  # to free the memory
    return template.generate(
        styles=STYLES,
        palette=palette(),
        scripts=SCRIPTS,
        name=" against ".join(episodes.runs),
        facts=facts_of(episodes),
        warnings=run_warnings(episodes),
        paths=list(evidence_paths(episodes.runs.values())),
        breakdowns=_breakdown_tables(frame),
        failures=_tables_with_rows(lambda: make_failure_table(episodes.data, means=True)),
        links_videos=details.links_videos,
        media=_embedded(episodes) if details.embeds else (),
        data=_safe(data),
        details=_safe(lines),
    )


def _embedded(episodes: PageEpisodes) -> Iterator[tuple[str, str]]:
    """Yield the videos by their names, each read when it is written."""
    for name, path in _media(episodes).items():
        yield name, _data_uri(path)


def _media(episodes: PageEpisodes) -> dict[str, Path]:
    """Return the files of all videos, and of the pictures shown before they are played.

    By the names that the page's script has for them: ``film-KEY`` and ``poster-KEY``.
    """
    media = {}
    for episode in episodes.all:
        if episode.film is not None:
            media[f"film-{episode.key}"] = episode.film
        if episode.poster is not None:
            media[f"poster-{episode.key}"] = episode.poster
    return media


def _add_all(
    details: EpisodeDetails, episodes: PageEpisodes, progress: Progress | None
) -> Iterator[Record]:
    """Yield the whole records of all episodes, and add each one's details in passing.

    So each record is read from the disk only once.
    """
    pairs = zip(episodes.all, episodes.whole(), strict=True)
    for done, (episode, record) in enumerate(pairs, 1):
        details.add(episode, record)
        yield record
        if progress is not None:
            progress(done, len(episodes.all))


def _data(episodes: PageEpisodes, details: EpisodeDetails) -> JsonObject:
    """Return what the page's script needs for its tables, filters and search, as a JSON object.

    Details of an episode, which are read when it is opened, are not part of it.
    """
    choices = []
    columns = dict(make_numbers(episodes))
    for name, page_filter in make_filters(episodes).items():
        choice = {"name": name, **page_filter._asdict()}
        columns[name] = choice.pop("column")
        choices.append(choice)
    # Settings that say left and right, in the frame of a viewer: the page explains the camera's.
    framed = [name for name, setting in all_settings().items() if "frame" in setting.reads]
    return {
        "choices": choices,
        "columns": columns,
        "strings": list(details.strings),
        "words": details.words,
        "matrix": make_matrix(episodes),
        "comparisons": comparisons(episodes),
        "sides": _first_sides([policy_run.policy for policy_run in episodes.names]),
        "reference": EXPLICIT,
        "framed": framed,
        "film": {"every": FRAME_STEPS, "rate": FRAME_RATE, "repeats": LAST_FRAME_REPEATS},
    }


def _first_sides(policies: Sequence[str]) -> list[int]:
    """Return the numbers of the two policies that the page compares when it is opened.

    They are the first policy and the same one in the other run, or else the next policy.
    """
    for place, policy in enumerate(policies):
        if place > 0 and policy == policies[0]:
            return [0, place]
    return [0, min(1, len(policies) - 1)]


def _breakdown_tables(frame: Frame) -> list[Table]:
    """Return the tables of control arms, and of gaps by kind of instruction, that have rows."""
    tables = _tables_with_rows(lambda: make_arm_table(RunData(frame)))  # no scene may have two arms
    tables += [make_breakdown_table(breakdown, frame) for breakdown in BREAKDOWNS.values()]
    return [table for table in tables if table.rows]


def _tables_with_rows(make: Callable[[], Table]) -> list[Table]:
    """Return the table that is made; an empty list if it cannot be made without rows."""
    with contextlib.suppress(InvalidValueError):
        return [make()]
    return []


def _data_uri(path: Path) -> str:
    """Return a file as a URL that contains it."""
    kind = "video/mp4" if path.suffix == ".mp4" else "image/jpeg"
    return f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"


def _safe(text: str) -> str:
    """Escape JSON for a script element: no text in it ends the element."""
    return text.replace("<", "\\u003c")
