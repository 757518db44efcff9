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
    page = measure_floors.PAGE.read_text(encoding="utf-8")
    assert page == measure_floors.page_text(), "python scripts/measure_floors.py --tables"


def test_the_file_holds_what_is_measured_and_is_read_as_it_was_written():
    """Chance and rules on the test split again; the learners learn from less here."""
    pytest.importorskip("sklearn")
    rows = measure_floors.measure(("StopCube",), scenes=4, learning=0)
    found = read_floors(measure_floors.file_text(rows))
    assert next(iter(found)) == FloorKey("random", "direct")
    for row in rows:
        one = found[FloorKey(*row.group)]
        assert (one.count, one.excess) == (row.count, pytest.approx(row.excess, abs=1e-4))
        for name in ("chance", "majority", "text-only", "scene-only", "union"):
            assert one.shares[name] == pytest.approx(row.shares[name], abs=1e-4)

    kept = stored.measured_floors(measure_floors.LANGUAGE_VERSION)
    assert kept is not None, AGAIN

    own = {key: floor for key, floor in found.items() if key.task and key.split == stored.TEST}
    assert len(own) == 8
    for key, floor in own.items():
        assert floor.count == kept[key].count, AGAIN
        for name in ("chance", "rules"):
            assert floor.shares[name] == kept[key].shares[name], AGAIN
        for name in ("text-only", "scene-only"):
            again = pytest.approx(kept[key].shares[name].slots, abs=0.25)
            assert floor.shares[name].slots == again, AGAIN


def rule_table(by):
    """The cells of a table of docs/floors.md, by row and column."""
    lines = measure_floors.PAGE.read_text(encoding="utf-8").splitlines()
    start = next(place for place, line in enumerate(lines) if line.startswith(f"| | {by} |"))
    heads, _, *rows = [
        [cell.strip(" `") for cell in line.strip("|").split("|")]
        for line in lines[start : lines.index("", start)]
    ]
    return {(row[0], head): cell for row in rows for head, cell in zip(heads, row, strict=True)}


@pytest.mark.parametrize(
    ("by", "settings", "options"),
    [
        ("direct", ("spatial",), {}),
        ("direct", ("contextual",), {"distractor": "competing"}),
        ("color exclusion", ("reasoning",), {}),
    ],
)
def test_the_rules_are_those_of_the_documentation(by, settings, options):
    table = rule_table(by)
    grouping = "pattern" if by == "color exclusion" else None
    names = {row for row, _ in table} & {"chance", *measure_floors.SURFACE_RULES}
    assert {"chance", "surface"} <= names

    chosen = InstructionOptions(**options)
    for row in shortcut_rows(tuple(all_tasks()), ("test",), settings, chosen, by=grouping):
        column = row.group[-1] + (", competing" if options else "")
        for name in names:
            share = row.shares[name]
            assert table[name, column] == f"{100 * share.slots:.0f} / {100 * share.goals:.0f}"
