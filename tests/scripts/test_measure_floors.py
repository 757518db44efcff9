"""The floors of the file and of the documentation are those of the words of today."""

import itertools

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
    """Floors of StopCube, measured anew: as rows, and as read from the file made of them.

    They are measured on the test split, as those of the shipped file are, and on 4 random scenes.
    The learners learn from fewer scenes than those of the shipped file.
    """
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


PARTS_OF_STOP_CUBE = itertools.product(
    ["direct", "direct-rival", "reasoning", "contextual"], ["", "visit"]
)
each_floor_of_stop_cube = pytest.mark.parametrize(
    "key", [FloorKey("test", setting, "StopCube", slot) for setting, slot in PARTS_OF_STOP_CUBE]
)


@each_floor_of_stop_cube
def test_the_shipped_floors_that_need_no_learning_are_those_of_the_words_of_today(measured, key):
    """A floor is the success of a guess, such as by chance or by a rule that looks at words alone.

    `measured` has the floors of the task StopCube on the test split, measured anew. Nothing is
    drawn in them, so the file that is shipped has the same. The goals of the task have one slot,
    *visit*; a key without a slot is of the whole goal.
    """
    _, floors = measured

    shipped = stored.measured_floors(measure_floors.LANGUAGE_VERSION)[key]
    assert floors[key].count == shipped.count, AGAIN
    assert floors[key].shares["chance"] == shipped.shares["chance"], AGAIN
    assert floors[key].shares["rules"] == shipped.shares["rules"], AGAIN


@pytest.mark.parametrize("learner", ["text-only", "scene-only"])
@each_floor_of_stop_cube
def test_the_shipped_floors_of_learners_are_near_those_that_learn_from_fewer_scenes(
    measured, key, learner
):
    """The learners behind the shipped file saw the train split and 500 random scenes of StopCube.

    Those of `measured` saw the train split alone, so what they get right differs: by 25 points at
    most, which is little between guessing (25 %) and what words may give away (100 %).
    """
    _, floors = measured

    shipped = stored.measured_floors(measure_floors.LANGUAGE_VERSION)[key].shares[learner].slots
    assert floors[key].shares[learner].slots == pytest.approx(shipped, abs=0.25), AGAIN


def table_of_page(first_column):
    """Return the cells of a table of docs/controls.md, by column and then by row.

    The table is the one whose columns begin with this one, after that of the names of rules.
    """
    page = measure_floors.PAGE.read_text(encoding="utf-8")
    table = page[page.index(f"| | {first_column} |") :].partition("\n\n")[0]
    rows = []
    for line in table.splitlines():
        rows.append([cell.strip("| `") for cell in line.split(" | ")])
    (_, *heads), _line, *rules = rows
    columns = {head: {} for head in heads}
    for rule, *cells in rules:
        for head, cell in zip(heads, cells, strict=True):
            columns[head][rule] = cell
    return columns


def cells_of(row, rules):
    """Return how often rules are right in parts of goals and in whole goals, as "40 / 25" (%)."""
    cells = {}
    for rule in rules:
        share = row.shares[rule]
        cells[rule] = f"{100 * share.slots:.0f} / {100 * share.goals:.0f}"
    return cells


@pytest.mark.parametrize(
    ("setting", "options", "column"),
    [
        ("spatial", {}, "spatial"),
        ("contextual", {"distractor": "competing"}, "contextual, competing"),
    ],
)
def test_the_documentation_has_how_often_each_rule_is_right_in_a_setting(setting, options, column):
    """docs/controls.md has a table of rules that name a goal without understanding it.

    It has a row for each rule and a column for each setting; the first one is *direct*. All
    instructions of the test split in one setting are scored anew, which must give its column."""
    (row,) = shortcut_rows(tuple(all_tasks()), ("test",), (setting,), InstructionOptions(**options))

    rules = ("chance", "first-mention", "last-mention", "elimination", "surface")
    assert cells_of(row, rules) == table_of_page("direct")[column]


def test_the_documentation_has_how_often_each_rule_is_right_in_each_reasoning_pattern():
    """docs/controls.md has a table of rules that name a goal without understanding it.

    It has a row for each rule and a column for each pattern by which the setting *reasoning* hides
    a goal; the first is *color exclusion*. All instructions of the test split are scored anew."""
    scored = shortcut_rows(
        tuple(all_tasks()), ("test",), ("reasoning",), InstructionOptions(), by="pattern"
    )

    rules = ("chance", "first-mention", "elimination", "surface")
    measured = {}
    for row in scored:
        _setting, pattern = row.group
        measured[pattern] = cells_of(row, rules)
    assert measured == table_of_page("color exclusion")
