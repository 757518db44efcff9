"""Which rates can be compared with the published ones, and what the tables say of the others."""

from __future__ import annotations

import dataclasses

import pytest
from flat_jobs import frame_of, make_result
from msgspec.structs import replace

from roboirg.analysis.comparability import IMPLICIT, REAL, differences_of
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.published import PUBLISHED_MAX_STEPS
from roboirg.analysis.results.run_cells import cells_of
from roboirg.analysis.tables.paper_tables import make_table
from roboirg.analysis.tables.rendering import FORMATS
from roboirg.analysis.tables.run_tables import make_run_tables
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.policy_ref import unknown_policy

WORDS = "robomme@1a2b3c4d"
TASKS = ("PickXtimes", "StopCube")


def play(episodes=range(50), tasks=TASKS[:1], settings=("explicit",), **fields) -> list:
    usual = {"wordings": WORDS, "environment_version": ENVIRONMENT_VERSION} | fields
    return [
        make_result(
            "failure" if episode % 5 == 0 else "success",
            episode,
            task=task,
            setting=setting,
            **usual,
        )
        for task in tasks
        for setting in settings
        for episode in episodes
    ]


def data_of(*results):
    return RunData(frame_of(*results))


def differences(results, planned=()) -> tuple[str, ...] | None:
    ((key, cell),) = cells_of(frame_of(results, planned=planned)).items()
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
        ({"max_steps": 1500}, (f"1500 steps instead of {PUBLISHED_MAX_STEPS}",)),
        ({"meshes": "light"}, ("light meshes",)),
        ({"demonstration_frames": "none"}, ("frames of the video: none",)),
        ({"environment_version": 99}, ("environment version 99",)),
    ],
)
def test_what_differs_from_robommes_episodes_in_its_words_is_named(fields, expected):
    assert differences(play(**fields)) == expected


def test_errors_and_unplayed_trials_are_named():
    several = [*play(), *play(policy_seed=1)]
    # A trial is played wherever policy and wordings come from.
    elsewhere = {"ref": unknown_policy("openpi://other:1"), "wordings_file": "elsewhere.toml"}
    planned = [replace(result.identity, **elsewhere) for result in several]
    assert differences(several, planned) == ()

    third = replace(several[60], outcome="error", error="policy")
    rest = [*several[:60], third, *several[63:]]
    assert differences(rest, planned) == ("1 error", "2 trials still to be played")


def test_other_settings_other_robots_and_other_tasks_are_not_comparable():
    assert differences(play(settings=("direct",))) == IMPLICIT
    assert differences(play(tasks=("PutInBox",))) == REAL
    assert differences(play(tasks=("Outside",))) is None

    planned = [result.identity for result in play()]
    assert differences([], planned) is None


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_marks_the_cells_and_says_what_differs(snapshot, name):
    """Of two tasks, one with too few episodes, in explicit and in a setting of other words."""
    results = play(settings=("explicit", "direct"))
    table = make_table("main", data_of(results, play(range(4), TASKS[1:])), published=True)

    ours = [row for row in table.rows if row.source == "ours" or row.name == "MemER"]

    assert FORMATS[name].draw(dataclasses.replace(table, rows=tuple(ours))) == snapshot


def test_without_published_rates_nothing_is_marked_but_the_best():
    plain = make_table("main", data_of(play(settings=("explicit", "direct"))))
    assert "comparable" not in " ".join(plain.notes)
    assert {entry.signs for row in plain.rows for entry in row.entries} == {"", "*"}


def test_differences_are_listed_by_policy_if_they_are_not_the_same():
    ours = play(wordings=None)
    different = "≠ not comparable with the published rate"
    same = make_table("main", data_of(ours, play(wordings=None, policy="b")), published=True)
    assert f"{different}: our own words." in same.notes

    table = make_table("main", data_of(ours, play(policy="b", max_steps=9)), published=True)
    assert f"{different} (listener, max steps 1300, our own words): our own words." in table.notes


def test_the_table_of_a_run_marks_its_explicit_column():
    settings = ("explicit", "direct")
    (table,) = make_run_tables(
        frame_of(play(settings=settings), play(range(4), TASKS[1:], settings))
    )

    assert [str(row.entries[0]) for row in table.rows[:2]] == ["80 =", "75 ≠"]
    assert not any(row.entries[1].signs for row in table.rows)
    assert "≠ not comparable with the published rate: 4 of 50 episodes (StopCube)." in table.notes
