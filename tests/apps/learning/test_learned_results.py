"""The table of the learned policy is that of its episodes, and they can be played again."""

import re

import pytest
import write_learned_table

from roboirg.apps.leaderboard.packing import opened_run
from roboirg.apps.leaderboard.run_verification import verify_run
from roboirg.tasks import all_tasks


def test_the_documentation_has_the_table_of_the_pack():
    page = write_learned_table.PAGE.read_text(encoding="utf-8")
    assert write_learned_table.TABLE.search(page)
    assert page == write_learned_table.page_text(), "python scripts/write_learned_table.py"


def test_the_readme_has_the_rates_of_the_pack():
    last = write_learned_table.table().splitlines()[-1]
    with_memory, without = re.findall(r"\((\d+)%\)", last)
    readme = (write_learned_table.ROOT / "README.md").read_text(encoding="utf-8")
    words = " ".join(readme.split())
    assert f"solves {with_memory} % of the 550 validation episodes" in words
    assert f"and {without} % without memory." in words


def test_the_pack_has_whole_rows_without_errors():
    cells = write_learned_table.played()
    rows = {row for row, _ in cells}
    assert rows == {write_learned_table.MEMORY, write_learned_table.WITHOUT}
    for task in all_tasks():
        memory, without = (cells[row, task] for row in sorted(rows, reverse=True))
        assert memory.trials == without.trials == 50
        assert not memory.errors + without.errors + memory.missing + without.missing
        assert without.verdicts.keys() == memory.verdicts.keys()


@pytest.mark.sim
@pytest.mark.slow
def test_the_pack_holds_when_some_of_it_is_played_again():
    with opened_run(write_learned_table.PACK) as run:
        found = verify_run(run, sample=0.01)
    assert found.holds, (found.checks, found.missing, found.doubled)
