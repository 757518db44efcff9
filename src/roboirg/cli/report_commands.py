"""The commands that show results: ``report``, ``tables``, ``figures``, ``compare``."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from roboirg.cli.names import known_names
from roboirg.core.errors import InvalidValueError, known_name

if TYPE_CHECKING:
    from roboirg.analysis.measures.breakdowns import Breakdown
    from roboirg.analysis.measures.comparison import Comparison
    from roboirg.analysis.measures.run_data import RunData
    from roboirg.analysis.results.frame import Frame
    from roboirg.analysis.tables.table import Table

# Heavy modules are imported inside the commands, so that --help answers at once.

_ALL = "all"
"""Stands for every name."""
_COVERAGE = "coverage"
"""The table that needs no run."""

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
    from roboirg.analysis.page.report import write_report
    from roboirg.analysis.results.sources import opened_sources
    from roboirg.cli.progress_bar import progress_bar
    from roboirg.cli.run_commands import print_tables_of
    from roboirg.records.packs import MEDIA_FOLDERS

    if serve and (against or out):
        raise InvalidValueError(
            "--serve shows one run, in its folder; it excludes --against and --out."
        )
    others = [] if against is None else [against]
    with (
        opened_sources([run], MEDIA_FOLDERS) as (source,),
        opened_sources(others, MEDIA_FOLDERS) as other_sources,
    ):
        other = other_sources[0] if other_sources else None
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
    """Serve the page of a run with its videos on this machine until Ctrl-C."""
    from roboirg.analysis.page.page_server import run_server
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
            help="{roboirg.analysis.figures:figure_kinds}, several separated by commas, or all "
            "that apply."
        ),
    ] = _ALL,
    published: Annotated[bool, typer.Option(help="Add the paper's values.")] = False,
) -> None:
    """Draw the figures of one or several runs as PNG, SVG and PDF, for light and dark pages.

    Example: roboirg figures runs/first --out figures
    """
    from roboirg.analysis.figures import figure_kinds, write_figures
    from roboirg.analysis.figures.figure_style import check_figure_support
    from roboirg.analysis.measures.run_data import RunData
    from roboirg.analysis.results.reading import read_frame
    from roboirg.analysis.results.sources import opened_sources

    check_figure_support()
    if not runs and not published:
        raise InvalidValueError("Figures need a run; give its folder, a pack, or --published.")
    names = known_names("figure", which, tuple(figure_kinds()))
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
            "runs alone: {roboirg.analysis.tables.diagnostic_tables:described_tables}."
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
    from roboirg.analysis.measures.run_data import RunData
    from roboirg.analysis.results.reading import read_frame
    from roboirg.analysis.results.sources import opened_sources
    from roboirg.analysis.tables.rendering import get_format
    from roboirg.cli.run_commands import warn_of_mixtures
    from roboirg.util.atomic_write import write_atomically
    from roboirg.util.freed_memory import paused_collection

    # The options are checked first, as reading takes long.
    output = get_format(format)
    choice = _TableChoice(which, by, published, floors)
    choice.check(runs or [])
    with paused_collection(), opened_sources(runs or []) as sources:
        records = itertools.chain.from_iterable(source.records() for source in sources)
        data = RunData(read_frame(sources, words=by is not None), records)
        made = choice.tables(data)
    if output.is_for_programs:
        warn_of_mixtures(data.frame)
    if out is None:
        _print_tables(made, format)
        return
    for table in made:
        path = out / f"{table.key}{output.suffix}"
        write_atomically(path, output.draw(table))
        typer.echo(path)


def _print_tables(tables: Sequence[Table], format: str) -> None:  # noqa: A002
    """Print tables: in colors, as one document for a program, or one after the other.

    Args:
        tables: to print.
        format: ``terminal``, or the name of a format of files, such as ``csv``.
    """
    from rich.console import Console

    from roboirg.analysis.tables.rendering import get_format
    from roboirg.analysis.tables.rendering.terminal import print_tables

    output = get_format(format)
    if format == "terminal":
        print_tables(tables, Console())
    elif output.is_for_programs:
        typer.echo(output.draw(*tables), nl=False)
    else:
        typer.echo("\n".join(map(output.draw, tables)), nl=False)


def compare(
    first: Annotated[
        str, typer.Argument(help="A run's folder, a pack, or RUN:policy.", metavar="A")
    ],
    second: Annotated[
        str | None,
        typer.Argument(
            help="Another one, or another policy of the same run. Without it the settings of A are "
            "compared with explicit.",
            metavar="B",
        ),
    ] = None,
    by: By = None,
) -> None:
    """Compare two policies on the same episodes and say where one is clearly better.

    Example: roboirg compare runs/first runs/second --by pattern
    """
    from roboirg.analysis.measures.comparison import compare as compare_frames
    from roboirg.analysis.results.reading import read_frame
    from roboirg.analysis.results.sources import opened_sources
    from roboirg.cli.run_commands import warn_of_mixtures

    breakdowns = _breakdowns(by)
    needs_words = bool(breakdowns)
    if second is None:
        _print_settings(first, by)
        return
    with opened_sources([first]) as sources, opened_sources([second]) as other_sources:
        frame = read_frame(sources, words=needs_words)
        other_frame = read_frame(other_sources, words=needs_words)
    comparison = compare_frames(frame, other_frame, breakdowns)
    warn_of_mixtures(frame, other_frame)

    name = comparison.first.marked_policy
    other_name = comparison.second.marked_policy
    if name == other_name:  # the same policy in two runs
        name = f"{name} ({first})"
        other_name = f"{other_name} ({second})"
    _print_lines(_comparison_lines(comparison, (frame, other_frame), (name, other_name)))


def _print_settings(run: str, by: str | None) -> None:
    """Print how the settings of a policy differ from explicit.

    Args:
        run: as typed, of one policy.
        by: as typed; breakdowns are of two policies.
    """
    from roboirg.analysis.measures.comparison import compare_settings
    from roboirg.analysis.measures.comparison_text import sentences
    from roboirg.analysis.results.reading import read_frame
    from roboirg.analysis.results.sources import opened_sources
    from roboirg.cli.run_commands import warn_of_mixtures

    if by is not None:
        raise InvalidValueError("--by compares two policies; name the second, too.")
    with opened_sources([run]) as sources:
        frame = read_frame(sources)
    comparison = compare_settings(frame)
    warn_of_mixtures(frame)
    policy = comparison.first.marked_policy
    _print_lines(sentences(comparison, policy, policy))


def _print_lines(lines: Iterable[str]) -> None:
    """Print lines of text as wide as the terminal allows."""
    from rich.console import Console
    from rich.text import Text

    from roboirg.util.console_width import widen

    console = Console()
    widen(console)
    for line in lines:
        console.print(Text(line), highlight=False)


def _comparison_lines(
    comparison: Comparison, frames: tuple[Frame, Frame], names: tuple[str, str]
) -> list[str]:
    """Return a comparison of two policies in sentences; frames and names are theirs, in order."""
    from roboirg.analysis.measures.comparison_text import sentences
    from roboirg.analysis.measures.headline import headline_notes
    from roboirg.analysis.results.run_cells import cells_of
    from roboirg.analysis.tables.arm_table import language_use_sentences

    first, second = frames
    name, other_name = names
    return [
        *sentences(comparison, name, other_name),
        *headline_notes(cells_of(first), {comparison.first: name}),
        *headline_notes(cells_of(second), {comparison.second: other_name}),
        *language_use_sentences(first, second, names),
    ]


class _TableChoice(NamedTuple):
    """The tables that the command is to make.

    Attributes:
        which: a name, or all tables of the paper.
        by: kinds of words, each a table of its own; None for the tables of `which`.
        published: whether to add the paper's rows.
        floors: names of expected successes to add; None for none.
    """

    which: str
    by: str | None
    published: bool
    floors: str | None

    def check(self, runs: Sequence[str]) -> None:
        """Raise if the options exclude each other, before any record is read.

        Diagnostic tables (such as ``failures``) and those by kind of words (``--by``) show runs
        alone, so they take neither published values nor floors.
        """
        from roboirg.analysis.tables.diagnostic_tables import diagnostic_tables
        from roboirg.analysis.tables.paper_tables import WHICH

        known_name("table", self.which, (*WHICH, *diagnostic_tables(), _ALL))
        is_broken_down = self.by is not None
        if is_broken_down or self.which in diagnostic_tables():
            names_both = is_broken_down and self.which != _ALL  # --by and a table
            if names_both or self.published or self.floors:
                raise InvalidValueError(
                    f"--by, and --which {', '.join(diagnostic_tables())}, show runs alone; each "
                    "excludes the other, --published and --floors."
                )
        if not runs and not self.published and self.which != _COVERAGE:
            raise InvalidValueError("Tables need a run; give its folder, a pack, or --published.")

    def tables(self, data: RunData) -> list[Table]:
        """Return the tables, with notes about what differs between the results.

        ``--by`` chooses tables by kind of words, a diagnostic name one table, all else the paper's.
        """
        from roboirg.analysis.tables.diagnostic_tables import diagnostic_tables
        from roboirg.analysis.tables.table_notes import with_mixtures

        if self.by is not None:
            made = _breakdown_tables(data, self.by)
        elif self.which in diagnostic_tables():
            made = [diagnostic_tables()[self.which].make(data)]
        else:
            made = self._paper_tables(data)
        return with_mixtures(made, data.frame)

    def _paper_tables(self, data: RunData) -> list[Table]:
        """Return one table of the paper, or with ``all`` each for which there are results.

        With the published values, the tables that have some are always among them.
        """
        from roboirg.analysis.published import RATE_TABLES
        from roboirg.analysis.tables.paper_tables import WHICH, is_informative, make_table

        floors: Sequence[str] = ()
        if self.floors is not None:
            # Imported here because it brings the reader's patterns, which no other table needs.
            from roboirg.analysis.measures.chance import FLOORS

            floors = known_names("floor", self.floors, FLOORS)
        make = functools.partial(make_table, data=data, published=self.published, floors=floors)
        if self.which != _ALL:
            table = make(self.which)
            if self.which != _COVERAGE and not table.rows:
                raise InvalidValueError(
                    f"The runs have no results for the table {self.which!r}; --which all shows "
                    "what they have."
                )
            return [table]

        made = []
        for name in WHICH:
            is_of_paper = name in RATE_TABLES or name == _COVERAGE
            if (self.published and is_of_paper) or is_informative(name, data):
                made.append(make(name))
        return made


def _breakdown_tables(data: RunData, by: str) -> list[Table]:
    """Return the tables of gaps by kind of words that the runs have results for.

    Args:
        data: of the runs.
        by: names of breakdowns, such as ``"pattern,slots"``, or ``"all"``.

    Raises:
        InvalidValueError: there are none.
    """
    from roboirg.analysis.tables.diagnostic_tables import make_breakdown_table

    made = []
    for breakdown in _breakdowns(by):
        table = make_breakdown_table(breakdown, data.frame)
        if table.rows:
            made.append(table)
    if not made:
        raise InvalidValueError(
            f"The runs have no instruction to break down by {by}; they need an implicit setting."
        )
    return made


def _breakdowns(by: str | None) -> tuple[Breakdown, ...]:
    """Return the breakdowns with the names in a text such as ``pattern,slots``; none for None."""
    from roboirg.analysis.measures.breakdowns import BREAKDOWNS

    if by is None:
        return ()
    names = known_names("breakdown", by, tuple(BREAKDOWNS))
    return tuple(BREAKDOWNS[name] for name in names)
