"""The floors of the file and of the documentation are those of the words of today."""

import measure_floors
import pytest

from roboirg.analysis.measures import measured_floors as stored
from roboirg.analysis.measures.measured_floors import FloorKey, read_floors
from roboirg.core.instruction_options import InstructionOptions
from roboirg.shortcuts.shortcut_tables import shortcut_rows
from roboirg.tasks import all_tasks

AGAIN = "measure them anew: python scripts/measure_floors.py"


def test_the_documentation_has_the_tables_of_the_file():
    """A floor is the success of a policy that ignores something, such as chance."""
    page = measure_floors.PAGE.read_text(encoding="utf-8")
    assert page == measure_floors.page_text(), "python scripts/measure_floors.py --tables"


@pytest.fixture(scope="module")
def measured():
    """Floors of one task, measured anew; the learners learn from less than those of the file."""
    pytest.importorskip("sklearn")
    rows = measure_floors.measure(("StopCube",), scenes=4, learning=0)
    return rows, read_floors(measure_floors.file_text(rows))


def test_floors_are_read_as_they_were_written(measured):
    """The floors of one task, StopCube, are measured, written as text and read back: the same
    shares to four decimals."""
    rows, read = measured

    assert next(iter(read)) == FloorKey("random", "direct")
    for row in rows:
        floor = read[FloorKey(*row.group)]
        assert (floor.count, floor.excess) == (row.count, pytest.approx(row.excess, abs=1e-4))
        for name in ("chance", "majority", "text-only", "scene-only", "union"):
            assert floor.shares[name] == pytest.approx(row.shares[name], abs=1e-4)


def test_the_file_holds_what_is_measured(measured):
    """The floors of one task are measured anew and compared with those of the shipped file: counts,
    chance and rules exactly; learners, who learn from fewer scenes here, within 25 points."""
    _, read = measured
    kept = stored.measured_floors(measure_floors.LANGUAGE_VERSION)
    assert kept is not None, AGAIN

    for key, floor in read.items():
        if key.task and key.split == stored.TEST:
            assert floor.count == kept[key].count, AGAIN
            assert floor.shares["chance"] == kept[key].shares["chance"], AGAIN
            assert floor.shares["rules"] == kept[key].shares["rules"], AGAIN
            for learner in ("text-only", "scene-only"):
                share = kept[key].shares[learner].slots
                assert floor.shares[learner].slots == pytest.approx(share, abs=0.25), AGAIN


def rule_table(by):
    """Return the cells of a table of docs/floors.md, by row and column."""
    lines = measure_floors.PAGE.read_text(encoding="utf-8").splitlines()
    (start,) = [place for place, line in enumerate(lines) if line.startswith(f"| | {by} |")]
    rows = []
    for line in lines[start : lines.index("", start)]:
        rows.append([cell.strip(" `") for cell in line.strip("|").split("|")])
    heads, _, *rows = rows
    return {(row[0], head): cell for row in rows for head, cell in zip(heads, row, strict=True)}


@pytest.mark.parametrize(
    ("by", "setting", "grouping", "options", "end"),
    [
        ("direct", "spatial", None, {}, ""),
        ("direct", "contextual", None, {"distractor": "competing"}, ", competing"),
        ("color exclusion", "reasoning", "pattern", {}, ""),
    ],
)
def test_the_rules_are_those_of_the_documentation(by, setting, grouping, options, end):
    """A cell of the table has the shares of slots and of goals in percent, as "40 / 25"; rows are
    rules, and the name of a column is what the row is grouped by, and `end`. Every cell of such
    a column is computed anew."""
    table = rule_table(by)
    names = {row for row, _ in table} & {"chance", *measure_floors.SURFACE_RULES}
    assert {"chance", "surface"} <= names

    chosen = InstructionOptions(**options)
    for row in shortcut_rows(tuple(all_tasks()), ("test",), (setting,), chosen, by=grouping):
        for name in names:
            share = row.shares[name]
            cell = table[name, row.group[-1] + end]
            assert cell == f"{100 * share.slots:.0f} / {100 * share.goals:.0f}", name
