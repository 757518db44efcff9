"""Which rates can be compared with the published ones, and what the tables say of the others."""

from __future__ import annotations

import dataclasses

import pytest
from msgspec.structs import replace

from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.policy_ref import unknown_policy
from roboirg.evaluation.analysis.comparability import IMPLICIT, REAL, differences_of
from roboirg.evaluation.analysis.published import MAX_STEPS
from roboirg.evaluation.analysis.results.frame import make_frame
from roboirg.evaluation.analysis.stats.cells import cells_of
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.paper_tables import make_table
from roboirg.evaluation.analysis.tables.rendering import FORMATS
from roboirg.evaluation.analysis.tables.run_tables import make_run_tables

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


def frame_of(*results):
    return make_frame([("run", [one for own in results for one in own])])


def data_of(*results):
    return RunData(frame_of(*results))


def differences(results, planned=()) -> tuple[str, ...] | None:
    ((key, cell),) = cells_of(make_frame([("run", results)], planned)).items()
    return differences_of(key, cell)


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({}, ()),
        ({"privileged": True}, ()),
        ({"policy_seed": 7}, ()),
        ({"demonstration_frames": "all"}, ()),
        ({"wordings": None}, ("our own words",)),
        ({"wordings": "mine@1a2b3c4d"}, ("the words of mine@1a2b3c4d",)),
        ({"wordings": "robomme2@1a2b3c4d"}, ("the words of robomme2@1a2b3c4d",)),
        ({"episodes": range(4)}, ("4 of 50 episodes",)),
        ({"episodes": [*range(49), 50]}, ("49 of 50 episodes",)),
        ({"split": "val"}, ("split val",)),
        ({"split": "random"}, ("split random",)),
        ({"max_steps": 1500}, (f"1500 steps instead of {MAX_STEPS}",)),
        ({"meshes": "light"}, ("light meshes",)),
        ({"demonstration_frames": "none"}, ("frames of the video: none",)),
        ({"environment_version": 99}, ("environment version 99",)),
    ],
)
def test_what_differs_from_robommes_episodes_in_its_words_is_named(
    result, fields, expected
) -> None:
    assert differences(play(result, **fields)) == expected


def test_errors_and_unplayed_trials_are_named(result) -> None:
    several = [*play(result), *play(result, policy_seed=1)]
    # A trial is played wherever policy and wordings come from.
    elsewhere = {"ref": unknown_policy("openpi://other:1"), "wordings_file": "elsewhere.toml"}
    planned = [replace(one.identity, **elsewhere) for one in several]
    assert differences(several, planned) == ()
    third = replace(several[60], outcome="error", error="policy")
    rest = [*several[:60], third, *several[63:]]
    assert differences(rest, planned) == ("1 error", "2 trials still to be played")


def test_other_settings_other_robots_and_other_tasks_are_not_comparable(result) -> None:
    assert differences(play(result, settings=("direct",))) == IMPLICIT
    assert differences(play(result, tasks=("PutInBox",))) == REAL
    assert differences(play(result, tasks=("Outside",))) is None
    planned = [one.identity for one in play(result)]
    assert differences([], planned) is None


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_marks_the_cells_and_says_what_differs(result, snapshot, name) -> None:
    """Of two tasks, one with too few episodes, in explicit and in a setting of other words."""
    results = play(result, settings=("explicit", "direct"))
    table = make_table("main", data_of(results, play(result, range(4), TASKS[1:])), published=True)
    ours = [row for row in table.rows if row.source == "ours" or row.name == "MemER"]
    assert FORMATS[name].draw(dataclasses.replace(table, rows=tuple(ours))) == snapshot


def test_without_published_rates_nothing_is_marked_but_the_best(result) -> None:
    plain = make_table("main", data_of(play(result, settings=("explicit", "direct"))))
    assert "comparable" not in " ".join(plain.notes)
    assert {entry.signs for row in plain.rows for entry in row.entries} == {"", "*"}


def test_differences_are_listed_by_policy_if_they_are_not_the_same(result) -> None:
    ours = play(result, wordings=None)
    different = "≠ not comparable with the published rate"
    same = make_table(
        "main", data_of(ours, play(result, wordings=None, policy="b")), published=True
    )
    assert f"{different}: our own words." in same.notes
    table = make_table("main", data_of(ours, play(result, policy="b", max_steps=9)), published=True)
    assert f"{different} (listener, max steps 1300, our own words): our own words." in table.notes


@pytest.mark.parametrize(
    ("fields", "signs", "note"),
    [
        ({}, ("80 =", "75 ≠"), "4 of 50 episodes (StopCube)."),
        ({"wordings": None}, ("80 ≠", "75 ≠"), "our own words; 4 of 50 episodes (StopCube)."),
    ],
)
def test_the_table_of_a_run_marks_its_explicit_column(result, fields, signs, note) -> None:
    settings = ("explicit", "direct")
    results = [
        *play(result, settings=settings, **fields),
        *play(result, range(4), TASKS[1:], settings, **fields),
    ]
    (table,) = make_run_tables(frame_of(results))
    assert [str(row.entries[0]) for row in table.rows[:2]] == list(signs)
    assert not any(row.entries[1].signs for row in table.rows)
    assert f"≠ not comparable with the published rate: {note}" in table.notes
