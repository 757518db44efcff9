"""The pages of the paper's experiment show its episodes, which can be played again."""

import pytest
import write_paper_results as written
from played_again import assert_holds_here

from roboirg.evaluation.analysis.results.option_labels import staged_options
from roboirg.evaluation.analysis.stats.cells import cells_of
from roboirg.language.settings import plain_settings, settings_of
from roboirg.tasks import all_tasks, get_task
from roboirg_learn.policy.paper_experiment import CONTEXT, MAIN, SYSTEMS, row_name

EPISODES = 50
HINT = "python scripts/write_paper_results.py"


def test_the_pages_have_the_tables_of_the_packs():
    assert written.RATES.read_text(encoding="utf-8") == written.rates_page(), HINT
    assert written.TABLES.read_text(encoding="utf-8") == written.tables_page(), HINT


def test_the_rows_of_the_main_table_are_whole():
    found = {
        (key.policy_run.policy, key.task, key.options.setting)
        for key in cells_of(written.played()[MAIN])
        if key.options.form == "implicit"
    }
    rows = {row for row, _, _ in found}
    assert rows == {row_name(memory) for memory in SYSTEMS}
    assert found == {
        (row, task, setting)
        for row in rows
        for task in all_tasks()
        for setting in plain_settings()
        if setting in settings_of(get_task(task))
    }


@pytest.mark.skipif(CONTEXT not in written.PACKS, reason="it has not been played")
def test_the_context_has_all_stages():
    stages = {one.stages for one in staged_options()}
    by_row: dict[str, set] = {}
    for key in cells_of(written.played()[CONTEXT]):
        by_row.setdefault(key.policy_run.policy, set()).add(key.options.stages)
    assert len(by_row) > 1
    assert all(found == stages for found in by_row.values())


@pytest.mark.parametrize("part", written.PACKS)
def test_no_episode_is_missing(part):
    for key, cell in cells_of(written.played()[part]).items():
        assert (len(cell.verdicts), cell.errors, cell.missing) == (EPISODES, 0, 0), key


@pytest.mark.sim
@pytest.mark.slow
@pytest.mark.parametrize("part", written.PACKS)
def test_a_pack_holds_when_some_of_it_is_played_again(part):
    assert_holds_here(written.PACKS[part], sample=0.001)


def test_the_readme_has_the_rates_of_the_rows_that_were_played():
    readme = (written.ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    rows = written.RATES.read_text(encoding="utf-8").splitlines()
    own = {row.split(" | ")[0].strip("| "): row for row in rows if row.startswith("| small-")}
    assert own
    for name, row in own.items():
        (line,) = [one for one in readme if f"`{name}`" in one and one.startswith("|")]
        assert line.endswith(
            f" | explicit | test | 1 | {row.split(' | ', 1)[1].replace(' to ', '–')}"
        )
