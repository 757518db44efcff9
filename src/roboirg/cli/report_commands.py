"""The commands that show results: ``report``, ``tables``, ``figures``, ``compare``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboirg.cli.names import known_names
from roboirg.core.errors import InvalidValueError, known_name

if TYPE_CHECKING:
    from roboirg.evaluation.analysis.stats.breakdowns import Breakdown
    from roboirg.evaluation.analysis.stats.run_data import RunData
    from roboirg.evaluation.analysis.tables.table import Table
    from roboirg.evaluation.plan.sources import Source

# Heavy modules are imported inside the commands, so that --help answers at once.

_ALL = "all"

Runs = Annotated[
    list[str] | None,
    typer.Argument(
        help="Folders of runs, packs (*.roboirg.zip), or RUN:policy; optional with --published.",
        metavar="RUN",
    ),
]
By = Annotated[
    str | None,
    typer.Option(
        help="Break gaps down by pattern, expression, slots, rival, difficulty (several separated "
        "by commas), or all."
    ),
]


def report(
    run: Annotated[
        str, typer.Argument(help="The --out folder of a run, a pack, or RUN:policy.", metavar="RUN")
    ],
    against: Annotated[
        str | None,
        typer.Option(help="Another run or pack, to compare with episode by episode."),
    ] = None,
    videos: Annotated[
        bool, typer.Option(help="Show the videos, in the page or next to it.")
    ] = True,
    out: Annotated[
        Path | None,
        typer.Option(
            help="File to write.",
            show_default="report.html in the folder, PACK.html next to a pack",
        ),
    ] = None,
    serve: Annotated[
        bool,
        typer.Option("--serve", help="Serve the run's folder until Ctrl-C: page and videos."),
    ] = False,
    port: Annotated[
        int, typer.Option(help="Port on loopback for --serve; 0 chooses a free one.")
    ] = 0,
) -> None:
    """Print the table of a run and write a page about it, one self-contained file.

    Example: roboirg report runs/first
    """
    from roboirg.cli.progress_bar import progress_bar
    from roboirg.cli.run_commands import print_tables_of
    from roboirg.evaluation.analysis.page.report import write_report
    from roboirg.evaluation.plan.sources import opened_sources
    from roboirg.evaluation.records.packs import MEDIA_FOLDERS

    if serve and (against or out):
        raise InvalidValueError(
            "--serve shows one run, in its folder; it excludes --against and --out."
        )
    others = [] if against is None else [against]
    with (
        opened_sources([run], MEDIA_FOLDERS) as (source,),
        opened_sources(others, MEDIA_FOLDERS) as found,
    ):
        other = found[0] if found else None
        with progress_bar("episodes of the page") as progress:
            page = write_report(
                source, against=other, out=out, videos=videos, served=serve, progress=progress
            )
        if serve:
            _serve(page, port)
            return
        print_tables_of(source)
    typer.echo(page)


def _serve(page: Path, port: int) -> None:
    """Serve the page of a run with its videos on this machine."""
    from roboirg.evaluation.analysis.page.page_server import run_server
    from roboirg.util.web.request_origin import LOOPBACK

    with run_server(page.parent, port) as server:
        typer.echo(f"http://{LOOPBACK}:{server.port}/{page.name}  Press Ctrl-C to stop.")
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            typer.echo("", err=True)


def figures(
    out: Annotated[Path, typer.Option(help="Folder for the figures; created if missing.")],
    runs: Runs = None,
    which: Annotated[
        str,
        typer.Option(
            help="gaps, context, failures, several separated by commas, or all that apply."
        ),
    ] = _ALL,
    published: Annotated[bool, typer.Option(help="Add the paper's values.")] = False,
) -> None:
    """Draw the figures of one or several runs as PNG, SVG and PDF, for light and dark pages.

    Example: roboirg figures runs/first --out figures
    """
    from roboirg.evaluation.analysis.figures import FIGURES, write_figures
    from roboirg.evaluation.analysis.figures.figure_style import check_figure_support
    from roboirg.evaluation.analysis.results.reading import read_frame
    from roboirg.evaluation.analysis.stats.run_data import RunData
    from roboirg.evaluation.plan.sources import opened_sources

    check_figure_support()
    if not runs and not published:
        raise InvalidValueError("Figures need a run; give its folder, a pack, or --published.")
    names = known_names("figure", which, tuple(FIGURES))
    with opened_sources(runs or []) as sources:
        content = RunData(read_frame(sources))
    for path in write_figures(content, out, names, published=published):
        typer.echo(path)


def tables(
    runs: Runs = None,
    which: Annotated[
        str,
        typer.Option(
            help="main, planner, context, real, harder, other, coverage, or all that apply; or of "
            "runs alone: forms, failures (of all episodes, and in the gap to explicit), "
            "failure-names, subgoals (of planners), heard (how many prompts were cut), arms (what "
            "control arms show), facts (what a methods section needs)."
        ),
    ] = _ALL,
    format: Annotated[  # noqa: A002
        str, typer.Option(help="terminal, markdown, latex, csv or json.")
    ] = "terminal",
    published: Annotated[bool, typer.Option(help="Add the paper's rows.")] = False,
    floors: Annotated[
        str | None,
        typer.Option(
            help="Add the expected success of listeners that do not understand: chance (the "
            "forgetful listener's level), shortcuts and learners by name, several separated "
            "by commas, or all."
        ),
    ] = None,
    by: By = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for one file per table; without it, they are printed."),
    ] = None,
) -> None:
    """Print the paper's tables, failures, or gaps by kind of words, for runs and packs.

    Example: roboirg tables runs/first --which main --published
    """
    from rich.console import Console

    from roboirg.cli.run_commands import warn_of_mixtures
    from roboirg.evaluation.analysis.results.reading import read_frame
    from roboirg.evaluation.analysis.stats.run_data import RunData
    from roboirg.evaluation.analysis.tables.rendering import get_format
    from roboirg.evaluation.analysis.tables.rendering.terminal import print_tables
    from roboirg.evaluation.plan.sources import opened_sources
    from roboirg.util.atomic_write import write_atomically
    from roboirg.util.freed_memory import paused_collection

    output = get_format(format)
    _check_choice(which, by, runs or [], published=published, floors=floors)
    with paused_collection(), opened_sources(runs or []) as sources:
        data = RunData(read_frame(sources, words=by is not None))
        found = _tables(which, by, sources, data, published=published, floors=floors)
    if output.is_for_programs:
        warn_of_mixtures(data.frame)
    if out is not None:
        for table in found:
            path = out / f"{table.key}{output.suffix}"
            write_atomically(path, output.draw(table))
            typer.echo(path)
    elif format == "terminal":
        print_tables(found, Console())
    else:
        texts = [output.draw(*found)] if output.is_for_programs else map(output.draw, found)
        typer.echo("\n".join(texts), nl=False)


def compare(
    first: Annotated[
        str, typer.Argument(help="A run's folder, a pack, or RUN:policy.", metavar="A")
    ],
    second: Annotated[
        str, typer.Argument(help="Another one, or another policy of the same run.", metavar="B")
    ],
    by: By = None,
) -> None:
    """Compare two policies on the same episodes and say where one is clearly better.

    Example: roboirg compare runs/first runs/second --by pattern
    """
    from rich.console import Console
    from rich.text import Text

    from roboirg.cli.run_commands import warn_of_mixtures
    from roboirg.evaluation.analysis.results.reading import read_frame
    from roboirg.evaluation.analysis.stats.cells import cells_of
    from roboirg.evaluation.analysis.stats.comparison import compare as compare_frames
    from roboirg.evaluation.analysis.stats.comparison_text import sentences
    from roboirg.evaluation.analysis.stats.headline import headline_notes
    from roboirg.evaluation.analysis.tables.arm_table import language_use_sentences
    from roboirg.evaluation.plan.sources import opened_sources
    from roboirg.util.console_width import widen

    wanted = _breakdowns(by)
    with opened_sources([first]) as ours, opened_sources([second]) as theirs:
        frame, other = (read_frame(one, words=bool(wanted)) for one in (ours, theirs))
    found = compare_frames(frame, other, wanted)
    warn_of_mixtures(frame, other)
    names = (found.first.marked_policy, found.second.marked_policy)
    if names[0] == names[1]:
        names = (f"{names[0]} ({first})", f"{names[1]} ({second})")
    console = Console()
    widen(console)
    for sentence in (
        *sentences(found, *names),
        *headline_notes(cells_of(frame), {found.first: names[0]}),
        *headline_notes(cells_of(other), {found.second: names[1]}),
        *language_use_sentences(frame, other, names),
    ):
        console.print(Text(sentence), highlight=False)


def _check_choice(
    which: str, by: str | None, runs: Sequence[str], *, published: bool, floors: str | None
) -> None:
    """Refuse tables that do not exist or that have no such rows, before anything is read."""
    from roboirg.evaluation.analysis.tables.diagnostic_tables import DIAGNOSTIC_TABLES
    from roboirg.evaluation.analysis.tables.paper_tables import WHICH

    alone = tuple(DIAGNOSTIC_TABLES)
    known_name("table", which, (*WHICH, *alone, _ALL))
    asked = [which] * (which != _ALL) + ["--by"] * (by is not None)
    if {*alone, "--by"} & {*asked} and (published or floors or len(asked) > 1):
        raise InvalidValueError(
            f"--by, and --which {', '.join(alone)}, show runs alone; each excludes the other, "
            "--published and --floors."
        )
    if not runs and not published and which != "coverage":
        raise InvalidValueError("Tables need a run; give its folder, a pack, or --published.")


def _tables(
    which: str,
    by: str | None,
    sources: Sequence[Source],
    data: RunData,
    *,
    published: bool,
    floors: str | None,
) -> list[Table]:
    from roboirg.evaluation.analysis.tables.diagnostic_tables import DIAGNOSTIC_TABLES
    from roboirg.evaluation.analysis.tables.table_notes import with_mixtures

    if by is not None:
        found = _breakdown_tables(data, by)
    elif which in DIAGNOSTIC_TABLES:
        records = (one for source in sources for one in source.records())
        found = [DIAGNOSTIC_TABLES[which](data, records)]
    else:
        found = _paper_tables(which, data, published=published, floors=floors)
    return with_mixtures(found, data.frame)


def _paper_tables(which: str, data: RunData, *, published: bool, floors: str | None) -> list[Table]:
    from roboirg.evaluation.analysis.published import RATE_TABLES
    from roboirg.evaluation.analysis.stats.chance import FLOORS
    from roboirg.evaluation.analysis.tables.paper_tables import WHICH, is_informative, make_table

    shown = (*RATE_TABLES, "coverage") if published else ()
    asked = (
        [one for one in WHICH if one in shown or is_informative(one, data)]
        if which == _ALL
        else [which]
    )
    added = () if floors is None else known_names("floor", floors, FLOORS)
    found = [make_table(one, data, published=published, floors=added) for one in asked]
    if which not in (_ALL, "coverage") and not found[0].rows:
        raise InvalidValueError(
            f"The runs have no results for the table {which!r}; --which all shows what they have."
        )
    return found


def _breakdown_tables(data: RunData, by: str) -> list[Table]:
    from roboirg.evaluation.analysis.tables.diagnostic_tables import make_breakdown_table

    tables = (make_breakdown_table(one, data.frame) for one in _breakdowns(by))
    if not (found := [table for table in tables if table.rows]):
        raise InvalidValueError(
            f"The runs have no instruction to break down by {by}; they need an implicit setting."
        )
    return found


def _breakdowns(by: str | None) -> tuple[Breakdown, ...]:
    from roboirg.evaluation.analysis.stats.breakdowns import BREAKDOWNS

    names = () if by is None else known_names("breakdown", by, tuple(BREAKDOWNS))
    return tuple(BREAKDOWNS[name] for name in names)
