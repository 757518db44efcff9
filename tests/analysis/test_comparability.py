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

PUBLISHED_WORDS = "robomme@1a2b3c4d"


def results_like_the_papers(
    episodes=range(50), tasks=("PickXtimes",), settings=("explicit",), **fields
):
    """Return results as the paper has them: 50 episodes of PickXtimes, 4 of 5 won."""
    usual = {"wordings": PUBLISHED_WORDS, "environment_version": ENVIRONMENT_VERSION} | fields
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


def run_data_of(*results):
    return RunData(frame_of(*results))


def named_differences(results, planned=()):
    """Return what keeps the only cell of these results from the paper's; None if it has no such."""
    ((key, cell),) = cells_of(frame_of(results, planned=planned)).items()
    return differences_of(key, cell)


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({}, ()),
        ({"privileged": True}, ()),
        ({"demonstration_frames": "all"}, ()),
        ({"wordings": None}, ("our own words",)),
        ({"wordings": "robomme2@1a2b3c4d"}, ("the words of robomme2@1a2b3c4d",)),
        ({"episodes": range(4)}, ("4 of 50 episodes",)),
        ({"episodes": [*range(49), 50]}, ("49 of 50 episodes",)),
        ({"split": "val"}, ("split val",)),
        ({"max_steps": 1500}, (f"1500 steps instead of {PUBLISHED_MAX_STEPS}",)),
        ({"meshes": "light"}, ("light meshes",)),
        ({"demonstration_frames": "none"}, ("frames of the video: none",)),
        ({"environment_version": 99}, ("environment version 99",)),
    ],
)
def test_each_difference_to_how_the_paper_played_is_named(fields, expected):
    """A rate may stand next to a published one only if episodes, words and limits are the same."""
    assert named_differences(results_like_the_papers(**fields)) == expected


def test_errors_and_planned_trials_without_a_result_are_named():
    """Planned are episodes 0 to 49 with policy seeds 0 and 1; seed 0 played all of them.

    Seed 1 played episodes 0 to 46, and 47 ended in an error; 48 and 49 are still to be played.
    Would find an incomplete rate that stands next to a published one without a sign.
    """
    seed_0 = results_like_the_papers(episodes=range(50), policy_seed=0)
    seed_1 = results_like_the_papers(episodes=range(50), policy_seed=1)
    planned = [result.identity for result in [*seed_0, *seed_1]]
    error = replace(seed_1[47], outcome="error", error="policy")

    found = named_differences([*seed_0, *seed_1[:47], error], planned)

    assert found == ("1 error", "2 trials still to be played")


def test_a_planned_trial_counts_as_played_although_policy_and_words_came_from_another_place():
    """The 50 episodes were planned for a policy on a server, with the words of a file elsewhere.

    None of them is reported as still to be played.
    """
    results = results_like_the_papers()
    elsewhere = {"ref": unknown_policy("openpi://other:1"), "wordings_file": "elsewhere.toml"}
    planned = [replace(result.identity, **elsewhere) for result in results]

    assert named_differences(results, planned) == ()


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"settings": ("direct",)}, IMPLICIT),
        ({"tasks": ("PutInBox",)}, REAL),
        ({"tasks": ("Outside",)}, None),
    ],
    ids=["implicit setting", "task of the paper's real robot", "task in no table of the paper"],
)
def test_implicit_settings_real_robots_and_unknown_tasks_have_their_own_reasons(fields, reason):
    assert named_differences(results_like_the_papers(**fields)) == reason


def test_a_cell_of_which_nothing_was_played_is_not_compared():
    planned = [result.identity for result in results_like_the_papers()]

    assert named_differences([], planned) is None


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_marks_the_cells_and_says_what_differs(snapshot, name):
    """In explicit, the rate of 50 episodes of PickXtimes can be compared with the paper's (=).

    Marked ≠ with their reasons are the rate of 4 episodes of StopCube, too few, and that of
    PickXtimes in direct, for which the paper's words are not published. The stored table has our
    rows and, of the paper's, those of MemER.
    """
    comparable = results_like_the_papers(tasks=("PickXtimes",), settings=("explicit", "direct"))
    too_few = results_like_the_papers(episodes=range(4), tasks=("StopCube",))
    table = make_table("main", run_data_of(comparable, too_few), published=True)
    shown = [row for row in table.rows if row.source == "ours" or row.name == "MemER"]

    drawn = FORMATS[name].draw(dataclasses.replace(table, rows=shown))

    assert drawn == snapshot


def test_a_table_without_published_rates_marks_the_best_rate_alone():
    """The sign of the best is *; = and ≠ would refer to rates that the table does not show."""
    data = run_data_of(results_like_the_papers(settings=("explicit", "direct")))

    table = make_table("main", data)

    signs = set()
    for row in table.rows:
        signs.update(entry.signs for entry in row.entries)
    assert signs == {"", "*"}
    assert "comparable" not in " ".join(table.notes)


@pytest.mark.parametrize(
    ("options_of_b", "named"),
    [({"wordings": None}, ""), ({"max_steps": 9}, " (listener, max steps 1300, our own words)")],
    ids=["alike", "another limit"],
)
def test_a_note_on_differences_names_the_policy_unless_all_differ_alike(options_of_b, named):
    """The listener heard our own words (`wordings` is None), not the paper's. Policy b heard them,
    too, or the paper's, with another step limit."""
    listener = results_like_the_papers(wordings=None)
    other = results_like_the_papers(policy="b", **options_of_b)

    table = make_table("main", run_data_of(listener, other), published=True)

    assert f"≠ not comparable with the published rate{named}: our own words." in table.notes


def test_in_the_terminal_only_explicit_rates_are_marked_as_comparable_or_not():
    """Of PickXtimes 40 of 50 episodes are won, as many as the paper has (=), of StopCube 3 of 4.

    In direct the same are won, a change of ±0 to explicit; no such rate can be compared, so none
    has a sign. Neither has the mean over both tasks, (80 + 75) / 2 = 77.5, rounded up.
    """
    both = ("explicit", "direct")
    whole = results_like_the_papers(range(50), tasks=("PickXtimes",), settings=both)
    partial = results_like_the_papers(range(4), tasks=("StopCube",), settings=both)

    (table,) = make_run_tables(frame_of(whole, partial))

    assert [list(map(str, row.entries)) for row in table.rows] == [
        ["80 =", "80 (±0)"],
        ["75 ≠", "75 (±0)"],
        ["78", "78 (±0)"],
    ]
    assert "≠ not comparable with the published rate: 4 of 50 episodes (StopCube)." in table.notes
