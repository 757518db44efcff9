"""Which rates can be compared with the published ones, and what the tables say of the others."""

from __future__ import annotations

import csv
import io

import pytest
from msgspec.structs import replace
from rich.console import Console

from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.policy_ref import unknown_policy
from roboirg.evaluation.analysis.comparability import IMPLICIT, REAL, differences_of, merged
from roboirg.evaluation.analysis.published import MAX_STEPS
from roboirg.evaluation.analysis.stats.cells import gather
from roboirg.evaluation.analysis.tables.paper_tables import make_table
from roboirg.evaluation.analysis.tables.rendering import FORMATS
from roboirg.evaluation.analysis.tables.run_tables import make_run_tables, print_run_tables

WORDS = "robomme@1a2b3c4d"
TASKS = ("PickXtimes", "StopCube")


def play(result, episodes=range(50), tasks=TASKS[:1], settings=("explicit",), **fields) -> list:
    usual = {"wordings": WORDS, "environment_version": ENVIRONMENT_VERSION} | fields
    return [
        result(
            "failure" if episode % 5 == 0 else "success", episode, task=task, setting=one, **usual
        )
        for task in tasks
        for one in settings
        for episode in episodes
    ]


def differences(results, planned=()) -> tuple[str, ...] | None:
    ((key, cell),) = gather([("run", results)], planned).items()
    return differences_of(key, cell)


def printed(results) -> str:
    """The tables of a run as words between single blanks."""
    console = Console(file=io.StringIO(), width=100)
    print_run_tables(make_run_tables(results), console)
    return " ".join(console.file.getvalue().split())  # type: ignore[attr-defined]


def lines(table) -> dict[tuple[str, str, str], dict[str, str]]:
    found = csv.DictReader(io.StringIO(FORMATS["csv"].draw(table)))
    return {(one["source"], one["group"], one["column"]): one for one in found}


@pytest.mark.parametrize(
    "fields", [{}, {"privileged": True}, {"policy_seed": 7}, {"demonstration_frames": "all"}]
)
def test_robommes_episodes_in_its_words_are_comparable(result, fields) -> None:
    assert differences(play(result, **fields)) == ()


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"wordings": None}, "our own words"),
        ({"wordings": "mine@1a2b3c4d"}, "the words of mine@1a2b3c4d"),
        ({"wordings": "robomme2@1a2b3c4d"}, "the words of robomme2@1a2b3c4d"),
        ({"episodes": range(4)}, "4 of 50 episodes"),
        ({"episodes": [*range(49), 50]}, "49 of 50 episodes"),
        ({"split": "val"}, "split val"),
        ({"split": "random"}, "split random"),
        ({"max_steps": 1500}, f"1500 steps instead of {MAX_STEPS}"),
        ({"meshes": "light"}, "light meshes"),
        ({"demonstration_frames": "none"}, "frames of the video: none"),
        ({"environment_version": 99}, "environment version 99"),
    ],
)
def test_each_difference_is_named(result, fields, expected) -> None:
    assert differences(play(result, **fields)) == (expected,)


def test_errors_and_unplayed_trials_are_named(result) -> None:
    several = [*play(result), *play(result, policy_seed=1)]
    planned = [one.identity for one in several]
    third = replace(several[60], outcome="error", error="policy")
    rest = [*several[:60], third, *several[63:]]
    assert differences(rest, planned) == ("1 error", "2 trials still to be played")


def test_a_trial_is_played_wherever_policy_and_wordings_come_from(result) -> None:
    played = play(result)
    elsewhere = {"ref": unknown_policy("openpi://other:1"), "wordings_file": "elsewhere.toml"}
    planned = [replace(one.identity, **elsewhere) for one in played]
    assert differences(played, planned) == ()


def test_other_settings_other_robots_and_other_tasks_are_not_comparable(result) -> None:
    assert differences(play(result, settings=("direct",))) == IMPLICIT
    assert differences(play(result, tasks=("PutInBox",))) == REAL
    assert differences(play(result, tasks=("Outside",))) is None
    planned = [one.identity for one in play(result)]
    assert differences([], planned) is None


def test_an_average_differs_in_what_any_of_its_cells_does() -> None:
    assert merged([(), ()]) == ()
    assert merged([("a",), (), ("b", "a")]) == ("a", "b")
    assert merged([("a",), None]) is None


def test_every_format_marks_the_cells_and_says_what_differs(result) -> None:
    results = play(result, settings=("explicit", "direct"))
    results += play(result, range(4), TASKS[1:])
    table = make_table("main", gather([("run", results)]), published=True)
    for name, unlike in (("terminal", "≠"), ("markdown", "≠"), ("latex", r"$\neq$")):
        # LaTeX may break its lines after more signs than spaces.
        text = " ".join(FORMATS[name].draw(table).replace(r"\allowbreak{}", "").split())
        assert "= comparable with the published rate: RoboMME's test episodes" in text
        different = f"{unlike} not comparable with the published rate: 4 of 50 episodes (StopCube)"
        assert different in text
        assert "Implicit settings are not comparable with the published rates" in text
    assert "| 80.00 = |" in FORMATS["markdown"].draw(table)
    assert r"80.00\textsuperscript{=}" in FORMATS["latex"].draw(table)
    found = lines(table)
    picks, stops = (found["ours", "explicit", task] for task in TASKS)
    assert (picks["comparable"], picks["differences"]) == ("yes", "")
    assert (stops["comparable"], stops["differences"]) == ("no", "4 of 50 episodes")
    direct = found["ours", "direct", "PickXtimes"]
    assert (direct["comparable"], direct["differences"]) == ("no", IMPLICIT[0])
    assert found["ours", "explicit", "Avg"]["comparable"] == ""  # most tasks were not played
    assert found["published", "explicit", "PickXtimes"]["comparable"] == ""


def test_without_published_rows_there_is_nothing_to_compare(result) -> None:
    table = make_table("main", gather([("run", play(result))]))
    assert "comparable" not in " ".join(table.notes)
    assert {entry.signs for row in table.rows for entry in row.entries} == {"", "*"}


def test_differences_are_listed_by_policy_if_they_are_not_the_same(result) -> None:
    ours = play(result, wordings=None)
    same = make_table(
        "main", gather([("r", [*ours, *play(result, wordings=None, policy="b")])]), published=True
    )
    assert "≠ not comparable with the published rate: our own words." in same.notes
    table = make_table(
        "main", gather([("r", [*ours, *play(result, policy="b", max_steps=9)])]), published=True
    )
    assert (
        "≠ not comparable with the published rate (listener, max steps 1300, our own words): "
        "our own words." in table.notes
    )


def test_the_table_of_a_run_marks_its_explicit_rates(result) -> None:
    comparable = printed(play(result, tasks=TASKS, settings=("explicit", "direct")))
    assert comparable.count("│ 80 = │ 80 (±0) │") == len(TASKS)
    assert "in the words of robomme@1a2b3c4d, with at most 1300 steps. n = 50" in comparable
    assert "not comparable" not in comparable
    ours = printed(play(result, tasks=TASKS, wordings=None))
    assert ours.count("│ 80 ≠ │") == len(TASKS)
    assert "≠ not comparable with the published rate: our own words." in ours
    assert "Played on the test split, in our own words" in ours
    both = printed([*play(result), *play(result, range(4), TASKS[1:])])
    assert "│ 80 = │" in both
    assert "│ 75 ≠ │" in both
    assert "┃ direct ┃" in printed(play(result, settings=("direct",)))


def test_imported_words_have_the_columns_of_our_own(result) -> None:
    """The wording file is a condition; it is no option that would hide a result from a table."""
    cells = gather([("run", play(result, settings=("explicit", "direct")))])
    assert {key.options for key in cells} == {
        InstructionOptions("explicit"),
        InstructionOptions("direct"),
    }
    (table,) = make_run_tables(play(result, settings=("explicit", "direct"))).values()
    assert len(table.columns) == 2
