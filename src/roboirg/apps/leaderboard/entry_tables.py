"""What the page of a packed run shows: its facts, and the tables of its results."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from roboirg.apps.leaderboard.admission import with_failures
from roboirg.apps.leaderboard.board_rows import PackedRun, board_rows
from roboirg.core.errors import RoboIRGError
from roboirg.core.plain_text import counted
from roboirg.evaluation.analysis.stats.measured_floors import NAMES, TEST, FloorKey, measured_floors
from roboirg.evaluation.analysis.stats.option_labels import has_default_options
from roboirg.evaluation.analysis.stats.rates import p_text, percent, points
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.stats.run_summary import ALL, SummaryRow
from roboirg.evaluation.analysis.tables.arm_table import make_arm_table
from roboirg.evaluation.analysis.tables.diagnostic_tables import DIAGNOSTIC_TABLES
from roboirg.evaluation.analysis.tables.heard_table import make_heard_table
from roboirg.evaluation.analysis.tables.paper_tables import make_table
from roboirg.evaluation.analysis.tables.table import NOT_APPLICABLE, Column, Entry, Row, Table

_GAPS_NOTE = (
    "Success in percent, the mean over tasks; the gap to explicit is over the same episodes, in "
    "points. p-values are from the exact paired test, after Holm's correction over the settings."
)
_FLOORS_NOTE = (
    "Success on the test split without understanding, in percent: by chance after the command, "
    "by always answering the most frequent goal, by the best rule about the words, by learners "
    "that see only the words or only the scene, and by any of these."
)


def entry_facts(run: PackedRun) -> list[tuple[str, str]]:
    """Return name and value of what a reader wants to know about a run."""
    why = run.why_unranked
    facts = [("ranked", f"no: {why}" if why else "yes")]
    for row in board_rows([run]):
        if row.status == "published":
            continue
        shown = row if row.rates or row.private is None else row.private
        mark = " (privileged: reads the simulator's state)" if row.is_privileged else ""
        found = [
            ("policy", row.policy + mark),
            ("verification", f"{row.status}: {row.status_text}"),
            ("conditions", shown.conditions),
            ("episodes", f"{counted(shown.episodes, 'episode')}, {counted(row.seeds, 'seed')}"),
        ]
        facts += [one for one in found if one not in facts]
    if run.check is not None:
        facts += [("pack, SHA-256", run.check.pack), ("checked with", run.check.versions)]
    return facts


def entry_tables(run: PackedRun) -> list[tuple[str, Table | str]]:
    """Return the tables of a run, each with its title; a sentence in place of one without rows.

    As on the board, errors count as failures.
    """
    if not run.results:
        return []
    data = RunData.of([(run.name, with_failures(run.results))], run.planned)
    makers: Mapping[str, Callable[[RunData], Table]] = {
        "Rates": lambda data: make_table("main", data.cells, floors=("chance",)),
        "Gaps": _gap_table,
        "Floors": _floor_table,
        "Controls": make_arm_table,
        "Prompt audit": make_heard_table,
        "Failures": DIAGNOSTIC_TABLES["failures"],
    }
    found: list[tuple[str, Table | str]] = []
    for title, make in makers.items():
        try:
            table = make(data)
            found.append((title, table if table.rows else "The run has nothing to show here."))
        except RoboIRGError as error:
            found.append((title, str(error)))
    return found


def _gap_table(data: RunData) -> Table:
    rows = [
        Row(data.names[key.policy_run], key.options.setting, "ours", tuple(_gap_entries(one)))
        for key, one in data.told().summaries.items()
        if key.scope == ALL and one.gap is not None and has_default_options(key.options)
    ]
    columns = ("success, %", "gap", "95 % interval", "p", "episodes")
    return _table("gaps", ("policy", "setting"), columns, rows, _GAPS_NOTE)


def _gap_entries(one: SummaryRow) -> Iterator[Entry]:
    gap = one.gap
    if gap is None or one.rate is None:
        return
    ends = "" if gap.interval is None else " to ".join(points(end, 1) for end in gap.interval)
    yield Entry(percent=percent(one.rate))
    yield Entry(word=points(gap.value, 1))
    yield Entry(word=ends or NOT_APPLICABLE)
    yield Entry(word=NOT_APPLICABLE if one.p_holm is None else p_text(one.p_holm))
    yield Entry(word=str(gap.episodes))


def _floor_table(data: RunData) -> Table:
    rows = []
    versions = {one.versions.language for one in data.names if one.versions is not None}
    settings = dict.fromkeys(key.options.setting for key in data.told().cells)
    for version in sorted(versions):
        floors = measured_floors(version) or {}
        for setting in settings:
            floor = floors.get(FloorKey(TEST, setting))
            if floor is not None:
                words = [f"{100 * floor.shares[name].goals:.0f}" for name in NAMES]
                entries = tuple(Entry(word=word) for word in words)
                rows.append(Row(f"words {version}", setting, "chance", entries))
    return _table("floors", ("words", "setting"), NAMES, rows, _FLOORS_NOTE)


def _table(
    key: str, heads: tuple[str, str], columns: tuple[str, ...], rows: list[Row], note: str
) -> Table:
    return Table(
        key=key, title="", heads=heads, columns=tuple(map(Column, columns)), rows=tuple(rows),
        notes=(note,),
    )  # fmt: skip
