"""The tables of the learned policy are those of its episodes, and they can be played again."""

import numpy as np
import pytest
import write_learned_table as tables
from played_again import assert_holds_here

from roboirg.evaluation.records.packs import opened_run
from roboirg.evaluation.records.store import read_results
from roboirg.language.settings import EXPLICIT, plain_settings, settings_of
from roboirg.tasks import all_tasks, get_task
from roboirg.tasks.splits.splits import get_episode
from roboirg_learn.listener.study_report import trained_rate

ACT = tables.RESULTS / "act-val.roboirg.zip"
PICKXTIMES = tables.RESULTS / "pickxtimes-val.roboirg.zip"
ROWS = "act", "act20"
"""All 100 actions of a chunk, and 20 of them."""


def words_of(page):
    """Return a page as one line, so that no sentence is broken."""
    return " ".join(page.read_text(encoding="utf-8").split())


def test_the_documentation_has_the_tables_of_the_pack():
    page = tables.PAGE.read_text(encoding="utf-8")
    assert page == tables.page_text(), "python scripts/write_learned_table.py"


def test_the_readme_has_the_rates_of_the_pack():
    readme = (tables.ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    found = [row.split(" | ")[1:] for row in readme if row.startswith("| `recurrent`")]
    rows = tables.words_table(tables.played()).replace(" to ", "–").splitlines()[2:4]
    seeds = tables.memory_table(tables.played()).splitlines()[-1].split(" | ")[2].count(",") + 1
    assert found == [
        [words, "val", str(seeds), *row.split(" | ")[1:]]
        for words, row in zip(("explicit", "all five settings"), rows, strict=True)
    ]


def test_the_pack_has_whole_rows_without_errors():
    cells = tables.told(tables.played())
    wanted = {(row, setting) for row in tables.WORDS for setting in plain_settings()}
    wanted |= {(row, EXPLICIT) for row in (tables.FRAMES, tables.WITHOUT, tables.WORDLESS)}
    assert cells.keys() == wanted
    for (row, setting), by_task in cells.items():
        tasks = [task for task in all_tasks() if setting in settings_of(get_task(task))]
        assert sorted(by_task) == sorted(tasks), (row, setting)
        for trained in by_task.values():
            assert not any(one.errors or one.missing for one in trained.values())
            assert {len(one.verdicts) for one in trained.values()} == {50}


def test_all_rates_are_stored_by_task():
    assert tables.BY_TASK.read_text(encoding="utf-8") == tables.by_task(tables.played())


def test_the_page_has_what_memory_and_a_blind_guess_solve():
    cells = tables.told(tables.played())
    apart = 0
    for task in all_tasks():
        rates = [
            trained_rate([tables.verdicts(cells[row, EXPLICIT][task]).astype(float)])
            for row in (tables.MEMORY, tables.WITHOUT)
        ]
        low = rates[0].interval[0]
        apart += low > rates[1].interval[1] and low > tables.blind_guess(task)
    page = words_of(tables.PAGE)
    assert (apart, "In ten of eleven tasks, the interval of the policy with memory" in page) == (
        10, True,
    )  # fmt: skip
    first = cells[tables.WITHOUT, EXPLICIT]["SwingXtimes"][0].verdicts
    three = {
        trial: get_episode("SwingXtimes", "val", trial.episode).goal.number("repeats") == 3
        for trial in first
    }
    solved = [sum(first[one] for one in first if three[one] is long) for long in (False, True)]
    assert (solved, sum(three.values())) == ([25, 0], 20)
    assert "solves 25 of the 30 episodes with one or two rounds and none of the 20" in page


def test_the_page_has_why_stop_cube_fails():
    failures = [one for one in tables.failures(tables.played()) if one.task == "StopCube"]
    rests = sum(one.attribution.failure == "stopped" for one in failures)
    words = f"rests without a press until time is up in {rests} of its {len(failures)} failures"
    assert words in words_of(tables.PAGE)


def test_the_page_has_what_policies_of_one_task_and_act_solve():
    won = {}
    for pack in (PICKXTIMES, ACT):
        with opened_run(pack) as run:
            for one in read_results(run):
                won.setdefault(one.policy, []).append(one.outcome == "success")
    act, act20 = (won.pop(row) for row in ROWS)
    solved = [won[name] for name in sorted(won)]
    rate = trained_rate([np.array(solved, float)])
    mean, low, high = (round(100 * one) for one in (rate.rate, *rate.interval))
    each = "{}, {} and {}".format(*map(sum, solved))
    page = words_of(tables.PAGE)
    assert f"{each}, **{mean} % on average** ({low} to {high} %" in page
    assert f"It solves **{sum(act)} of {len(act)}**" in page
    assert "also none if 20" in page
    training = words_of(tables.ROOT / "docs" / "training.md")
    assert f"solved [{sum(act)} of {len(act)}]" in training
    assert f"solves {mean} % of the same episodes" in training
    assert (sum(act20), len(act20)) == (0, 50)


def test_trainings_count_alike_however_many_there_are():
    one, other = np.array([[1, 1, 0], [1, 0, 0], [1, 1, 0]]), np.array([[1, 0, 1], [1, 0, 0]])
    assert tables.differences(one, other).tolist() == [0, 4, -3]
    assert tables.differences(one, one).tolist() == [0, 0, 0]


@pytest.mark.sim
@pytest.mark.slow
@pytest.mark.parametrize("pack", [tables.PACK, ACT, PICKXTIMES], ids=lambda pack: pack.name)
def test_packs_hold_when_some_of_their_episodes_are_played_again(pack):
    assert_holds_here(pack, sample=0.002)
