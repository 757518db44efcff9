"""The commands that show results: ``report``, ``tables``, ``figures``, ``compare``."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboirg.cli.names import known_names
from roboirg.core.errors import InvalidValueError, UnknownNameError

if TYPE_CHECKING:
    from roboirg.evaluation.analysis.stats.breakdowns import Breakdown, Labels
    from roboirg.evaluation.analysis.stats.cells import Cells
    from roboirg.evaluation.analysis.tables.rendering import Format
    from roboirg.evaluation.analysis.tables.table import Table
    from roboirg.evaluation.records.record import Job, Summary

# Heavy modules are imported inside the commands, so that --help answers at once.

_ALL = "all"

By = Annotated[
    str | None,
    typer.Option(
        help="Break gaps down by pattern, expression, slots, rival, difficulty (several separated "
        "by commas), or all."
    ),
]


def report(
    folder: Annotated[str, typer.Argument(help="The --out folder of a run.", metavar="RUN")],
    against: Annotated[
        str | None, typer.Option(help="Another run, to compare with episode by episode.")
    ] = None,
    videos: Annotated[bool, typer.Option(help="Embed the videos in the page.")] = True,
    serve: Annotated[
        bool,
        typer.Option("--serve", help="Serve page and videos until Ctrl-C; write no file."),
    ] = False,
    port: Annotated[
        int, typer.Option(help="Port on loopback for --serve; 0 chooses a free one.")
    ] = 0,
) -> None:
    """Print the table of a run and write RUN/report.html, one self-contained page.

    Example: roboirg report runs/first
    """
    from roboirg.cli import run_commands
    from roboirg.cli.progress_bar import progress_bar
    from roboirg.evaluation.analysis.page.report import check_report_support, write_report

    path, other = run_commands.folder_of(folder), None if against is None else Path(against)
    if serve:
        _serve(path, port, against)
        return
    check_report_support()
    planned = run_commands.planned_jobs(path)
    with progress_bar("episodes of the page") as progress:
        page = write_report(
            path,
            planned=planned,
            videos=videos,
            against=other,
            planned_against=() if other is None else run_commands.planned_jobs(other),
            progress=progress,
        )
    run_commands.print_tables_of(path, planned)
    typer.echo(page)


def _serve(folder: Path, port: int, against: str | None) -> None:
    """Serve the page of a run with its videos on this machine."""
    from roboirg.cli import run_commands
    from roboirg.cli.progress_bar import progress_bar
    from roboirg.evaluation.analysis.page.page_server import PageServer
    from roboirg.evaluation.analysis.page.report import make_view

    if against is not None:
        raise InvalidValueError(f"--serve shows one run; leave out --against {against}.")

    def make_page() -> str:
        with progress_bar("episodes of the page") as progress:
            return make_view(folder, run_commands.planned_jobs(folder), progress)

    with PageServer(folder, make_page, port) as server:
        # Problems of the run are errors here, not in the browser.
        server.page()
        typer.echo(f"{server.address}  Press Ctrl-C to stop.")
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            typer.echo("", err=True)


def figures(
    out: Annotated[Path, typer.Option(help="Folder for the figures; created if missing.")],
    runs: Annotated[
        list[str] | None,
        typer.Argument(help="The --out folders of runs; optional with --published.", metavar="RUN"),
    ] = None,
    which: Annotated[
        str,
        typer.Option(
            help="gaps, forms, expressions, context, failures, arms, strips (a "
            "failure in pictures), several separated by commas, or all that apply."
        ),
    ] = _ALL,
    published: Annotated[bool, typer.Option(help="Add the paper's values.")] = False,
) -> None:
    """Draw the figures of one or several runs as PNG, SVG and PDF, for light and dark pages.

    Example: roboirg figures runs/first --out figures
    """
    from roboirg.evaluation.analysis.figures import FIGURES, write_figures
    from roboirg.evaluation.analysis.figures.figure_style import check_figure_support
    from roboirg.evaluation.analysis.stats.run_data import RunData

    check_figure_support()
    if not runs and not published:
        raise InvalidValueError("Figures need a run; give its folder, or --published.")
    names = FIGURES if which == _ALL else tuple(word.strip() for word in which.split(","))
    content = RunData.of(*_runs(runs or []))
    folders = [Path(run) for run in runs or []]
    for path in write_figures(content, out, names, published=published, runs=folders):
        typer.echo(path)


def tables(
    runs: Annotated[
        list[str] | None,
        typer.Argument(help="The --out folders of runs; optional with --published.", metavar="RUN"),
    ] = None,
    which: Annotated[
        str,
        typer.Option(
            help="main, planner, context, real, harder, other, coverage, or all that apply; or of "
            "runs alone: forms, failures, subgoals (of planners), heard (how many prompts were "
            "cut), arms (what control arms show), facts (what a methods section needs)."
        ),
    ] = _ALL,
    format: Annotated[  # noqa: A002
        str, typer.Option(help="terminal, markdown, latex, latex-pieces (narrow), csv or json.")
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
    """Print the paper's tables, failures, or gaps by kind of words, for one or several runs.

    Example: roboirg tables runs/first --which main --published
    """
    from roboirg.evaluation.analysis.stats.cells import gather
    from roboirg.evaluation.analysis.tables.diagnostic_tables import (
        DIAGNOSTIC_TABLES,
        RECORD_TABLES,
    )
    from roboirg.evaluation.analysis.tables.rendering import get_format

    output = get_format(format)
    if which in (*DIAGNOSTIC_TABLES, *RECORD_TABLES):
        if published or floors or by is not None:
            raise InvalidValueError(f"--which {which} excludes --published, --floors and --by.")
        found = [_diagnostic_table(which, runs or [])]
    elif by is None:
        found = _tables(which, gather(*_runs(runs or [])), published=published, floors=floors)
    elif published or floors or which != _ALL:
        raise InvalidValueError(
            "--by prints tables of its own; it cannot be combined with --which, --published or "
            "--floors."
        )
    else:
        found = _breakdown_tables(runs or [], by)
    if out is not None:
        _write(found, out, output)
    elif format == "terminal":
        _print(found)
    else:
        typer.echo("\n".join(output.draw(table) for table in found), nl=False)


def compare(
    first: Annotated[str, typer.Argument(help="A run's folder, or RUN:policy.", metavar="A")],
    second: Annotated[
        str,
        typer.Argument(help="Another run's folder or RUN:policy, or the same run.", metavar="B"),
    ],
    by: By = None,
) -> None:
    """Compare two policies on the same episodes and say where one is clearly better.

    Example: roboirg compare runs/first runs/second --by pattern
    """
    from rich.console import Console
    from rich.text import Text

    from roboirg.evaluation.analysis.stats.cells import gather
    from roboirg.evaluation.analysis.stats.comparison import compare as compare_cells
    from roboirg.evaluation.analysis.stats.comparison_text import sentences
    from roboirg.evaluation.analysis.stats.headline import headline_notes
    from roboirg.evaluation.analysis.stats.run_data import RunData
    from roboirg.evaluation.analysis.tables.arm_table import language_use_sentences
    from roboirg.util.console_width import widen

    sides = _one_policy(first), _one_policy(second)
    ours, theirs = (gather(*each) for each in sides)
    breakdowns = _breakdowns(by)
    labels = _labels(breakdowns, [_split(first)[0], _split(second)[0]])
    titled = {one.title: labels[one.name] for one in breakdowns}
    found = compare_cells(ours, theirs, titled)
    names = [found.first.marked_policy, found.second.marked_policy]
    if names[0] == names[1]:
        names = [f"{names[0]} ({first})", f"{names[1]} ({second})"]
    console = Console()
    widen(console)
    first_data, second_data = (RunData.of(*each) for each in sides)
    for sentence in (
        *sentences(found, names[0], names[1]),
        *headline_notes(ours, {found.first: names[0]}),
        *headline_notes(theirs, {found.second: names[1]}),
        *language_use_sentences(first_data, second_data, (names[0], names[1])),
    ):
        console.print(Text(sentence), highlight=False)


def _tables(which: str, cells: Cells, *, published: bool, floors: str | None) -> list[Table]:
    from roboirg.evaluation.analysis.published import RATE_TABLES
    from roboirg.evaluation.analysis.stats.chance import FLOORS
    from roboirg.evaluation.analysis.tables.diagnostic_tables import (
        DIAGNOSTIC_TABLES,
        RECORD_TABLES,
    )
    from roboirg.evaluation.analysis.tables.paper_tables import WHICH, is_informative, make_table

    if which == _ALL:
        shown = (*RATE_TABLES, "coverage") if published else ()
        wanted: list[str] = [one for one in WHICH if one in shown or is_informative(one, cells)]
    elif which in WHICH:
        wanted = [which]
    else:
        raise UnknownNameError("table", which, (*WHICH, *DIAGNOSTIC_TABLES, *RECORD_TABLES, _ALL))
    if which != "coverage" and not published and not cells:
        raise InvalidValueError("Tables need a run; give its folder, or --published.")
    added = () if floors is None else known_names("floor", floors, FLOORS)
    found = [make_table(one, cells, published=published, floors=added) for one in wanted]
    if which not in (_ALL, "coverage") and not found[0].rows:
        raise InvalidValueError(
            f"The runs have no results for the table {which!r}; --which all shows what they have."
        )
    return found


def _breakdown_tables(runs: list[str], by: str) -> list[Table]:
    from roboirg.evaluation.analysis.stats.cells import gather
    from roboirg.evaluation.analysis.tables.breakdown_table import make_breakdown_table

    if not runs:
        raise InvalidValueError("--by needs a run; give its folder.")
    breakdowns, cells = _breakdowns(by), gather(*_runs(runs))
    labels = _labels(breakdowns, runs)
    found = [make_breakdown_table(one, cells, labels[one.name]) for one in breakdowns]
    if not any(table.rows for table in found):
        raise InvalidValueError(
            f"The runs have no instruction to break down by {by}; they need an implicit setting."
        )
    return [table for table in found if table.rows]


def _diagnostic_table(which: str, runs: list[str]) -> Table:
    from roboirg.evaluation.analysis.stats.run_data import RunData
    from roboirg.evaluation.analysis.tables.diagnostic_tables import (
        DIAGNOSTIC_TABLES,
        RECORD_TABLES,
    )
    from roboirg.evaluation.records.store import iterate_records

    if not runs:
        raise InvalidValueError(f"The table {which!r} needs a run; give its folder.")
    data = RunData.of(*_runs(runs))
    if which in DIAGNOSTIC_TABLES:
        return DIAGNOSTIC_TABLES[which](data)
    return RECORD_TABLES[which](
        data,
        ((run, record) for run in dict.fromkeys(runs) for record in iterate_records(Path(run))),
    )


def _breakdowns(by: str | None) -> tuple[Breakdown, ...]:
    from roboirg.evaluation.analysis.stats.breakdowns import BREAKDOWNS, find_breakdowns

    if by is None:
        return ()
    return find_breakdowns(BREAKDOWNS if by == _ALL else [word.strip() for word in by.split(",")])


def _labels(breakdowns: tuple[Breakdown, ...], runs: list[str]) -> dict[str, Labels]:
    """Return the labels of the instructions of runs, whose records are read one by one."""
    from roboirg.evaluation.analysis.stats.breakdowns import label_instructions
    from roboirg.evaluation.records.store import iterate_records

    if not breakdowns:
        return {}
    folders = map(Path, dict.fromkeys(runs))
    records = itertools.chain.from_iterable(map(iterate_records, folders))
    return label_instructions(breakdowns, records)


def _print(found: list[Table]) -> None:
    from rich.console import Console

    from roboirg.evaluation.analysis.tables.rendering.terminal import renderable

    console = Console()
    for table in found:
        console.print(renderable(table, console), highlight=False)


def _write(found: list[Table], folder: Path, output: Format) -> None:
    from roboirg.util.atomic_write import write_atomically

    for table in found:
        path = folder / f"{table.key}{output.suffix}"
        write_atomically(path, output.draw(table))
        typer.echo(path)


def _runs(runs: list[str]) -> tuple[list[tuple[str, Sequence[Summary]]], list[Job]]:
    """Return the results of runs, each with its folder, and the jobs of their plans."""
    from roboirg.cli.run_commands import planned_jobs
    from roboirg.evaluation.records.store import read_results

    folders = [Path(run) for run in runs]
    planned = [job for folder in folders for job in planned_jobs(folder)]
    results: list[tuple[str, Sequence[Summary]]] = [
        (str(folder), read_results(folder)) for folder in folders
    ]
    return results, planned


def _one_policy(text: str) -> tuple[list[tuple[str, Sequence[Summary]]], list[Job]]:
    """Return the results and planned jobs of a run's folder or of RUN:policy.

    Names of policies may contain colons.
    """
    folder, policy = _split(text)
    runs, planned = _runs([folder])
    if policy is None:
        return runs, planned
    names = list(dict.fromkeys(one.policy for one in (*planned, *runs[0][1])))
    if policy not in names:
        raise UnknownNameError(f"policy in {folder}", policy, names)
    own: list[tuple[str, Sequence[Summary]]] = [
        (name, [one for one in results if one.policy == policy]) for name, results in runs
    ]
    return own, [job for job in planned if job.policy == policy]


def _split(text: str) -> tuple[str, str | None]:
    if Path(text).is_dir():
        return text, None
    for place, sign in enumerate(text):
        if sign == ":" and Path(text[:place]).is_dir():
            return text[:place], text[place + 1 :]
    folder, _, policy = text.partition(":")
    return folder, policy or None
