"""The frame of results: its columns, and which results belong to the same policy run."""

from __future__ import annotations

from pathlib import Path

import pytest
from flat_jobs import frame_of, make_result, make_results
from made_records import make_record
from page_text import store

import roboirg
from roboirg.analysis.results.frame import COLUMNS, make_frame
from roboirg.analysis.results.reading import record_columns, with_columns
from roboirg.analysis.results.run_cells import cells_of
from roboirg.analysis.results.sources import opened_sources
from roboirg.core.versions import Versions
from roboirg.records.store import iterate_records
from roboirg.runs.plan.plan_maker import make_plan

OUTCOMES = ("success", "failure", "error")


@pytest.fixture(scope="module")
def run_with_wins_losses_and_errors(tmp_path_factory):
    """Of each task and setting the first episode is won, the next lost; one is an error."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    plan = make_plan("oracle", tasks="PickXtimes,StopCube", settings="all", episodes="4")
    found = [
        make_record(job, OUTCOMES[job.episode], "why" if job.episode else None, video=None)
        for job in plan.jobs()
        if job.episode < 3
    ]
    return store(folder, found, plan).folder


TYPES_OF_KINDS = {
    "text": "string",
    "texts": "object",
    "number": "Int64",
    "decimal": "Float64",
    "flag": "boolean",
}
"""What pandas calls the types of columns."""


def test_each_column_of_the_results_has_the_type_it_declares(run_with_wins_losses_and_errors):
    """A column that does not say when it is missing has a value in every row."""
    found = roboirg.results(run_with_wins_losses_and_errors)

    declared = {**COLUMNS, **record_columns()}
    assert list(found) == list(declared)
    for name, column in declared.items():
        assert str(found[name].dtype) == TYPES_OF_KINDS[column.kind], name
        if not column.missing:
            assert found[name].notna().all(), name


def test_the_results_have_a_row_for_each_played_episode_and_values_where_they_apply(
    run_with_wins_losses_and_errors,
):
    """In each task and setting the run has a success, a failure, and an error (episodes 0 to 2).

    PickXtimes was played in five settings, StopCube in four, as it has no spatial one. The fourth
    episode of each is planned and has no row. An error has no success, true or false, but its kind;
    only the setting *reasoning* has a pattern of reasoning.
    """
    found = roboirg.results(run_with_wins_losses_and_errors)

    is_error = found["outcome"] == "error"
    assert len(found) == (5 + 4) * 3
    assert (found["success"].isna() == is_error).all()
    assert (found["error"].notna() == is_error).all()
    assert (found["pattern"].notna() == (found["setting"] == "reasoning")).all()


def test_the_results_say_of_what_suite_a_task_is_and_that_the_oracle_is_privileged(
    run_with_wins_losses_and_errors,
):
    """The run has the policy *oracle*, which reads the simulator, and two tasks of counting."""
    found = roboirg.results(run_with_wins_losses_and_errors)

    assert found["privileged"].all()
    assert set(found["suite"]) == {"counting"}


def test_the_column_words_counts_the_words_of_all_turns_of_an_instruction(
    run_with_wins_losses_and_errors,
):
    """The sum over the run is compared with a count of the words in its records."""
    words = 0
    for record in iterate_records(run_with_wins_losses_and_errors):
        for turn in record.instruction:
            words += len(turn.text.split())

    found = roboirg.results(run_with_wins_losses_and_errors)

    assert found["words"].sum() == words


def test_policies_are_named_without_version_and_ordered_as_planned():
    """Policies a and b played in one version each, b first. `names` has what tables call them.

    Only a policy with several versions needs them in its name. Without a plan, the names are in
    alphabetical order, or in `names_as_played` as the results come.
    """
    played = [
        make_result(policy="b", policy_version="version 7"),
        make_result(policy="a", policy_version="version 8"),
    ]

    without_plan = frame_of(played)
    with_plan = frame_of(played, planned=[result.identity for result in played])

    assert list(without_plan.names.values()) == ["a", "b"]
    assert list(without_plan.names_as_played.values()) == ["b", "a"]
    assert list(with_plan.names.values()) == ["b", "a"]


def test_rows_are_sorted_by_task_then_episode_then_seed():
    """In the order of the benchmark; unknown tasks come last."""
    rows = [
        ("StopCube", 0, 0),
        ("StopCube", 0, 1),
        ("StopCube", 1, 0),
        ("BinFill", 2, 0),
        ("Another", 0, 0),
    ]
    found = []
    for task, episode, seed in reversed(rows):
        found.append(make_result("success", episode, task=task, policy_seed=seed))

    frame = frame_of(found)

    assert [*zip(frame["task"], frame["episode"], frame["policy_seed"], strict=True)] == rows


def test_a_planned_episode_without_result_is_missing_for_the_first_version_that_played():
    """A policy played an episode as version b and one as a; the plan had three."""
    played = [
        make_result("success", 0, policy_version="b"),
        make_result("success", 1, policy_version="a"),
    ]
    planned = [make_result("success", 2).identity]

    cells = cells_of(frame_of(played, planned=planned))

    missing = {key.policy_run.versions.policy_version: cell.missing for key, cell in cells.items()}
    assert missing == {"a": 0, "b": 1}


def test_results_in_two_runs_in_any_order_are_the_same_table_as_one_run_in_order():
    """A letter is an episode: 1 won, 0 lost, ! an error. One run played the whole plan in order.

    Or run a played direct, and run b explicit, both backwards: the two complete each other. Episode
    9 is planned in explicit, too; nobody played it. Explicit comes first in both tables.
    """
    explicit = make_results("10!1", "explicit")
    direct = make_results("0011", "direct")
    unplayed = make_result(episode=9)
    planned = [result.identity for result in [*explicit, *direct, unplayed]]

    whole = make_frame([("whole", [*explicit, *direct])], planned)
    parts = make_frame([("a", direct[::-1]), ("b", explicit[::-1])], planned)

    for name in ("run", "outcome", "options", "task", "episode"):
        assert list(parts[name]) == list(whole[name]), name
    counts = [cell.counts for cell in cells_of(parts).values()]
    assert counts == [cell.counts for cell in cells_of(whole).values()]
    assert [cell.missing for cell in counts] == [1, 0]


def test_an_episode_played_in_two_runs_counts_in_each_under_a_name_of_its_own():
    """Won in run a and lost in run b: 1 and 0. Would find a mean of both under one name."""
    won = make_result("success", 0, started_at="first")
    lost = make_result("failure", 0, started_at="second")

    twice = make_frame([("a", [won]), ("none", []), ("b", [lost])])

    assert list(twice.names.values()) == ["listener, a", "listener, b"]
    assert [cell.rate for cell in cells_of(twice).values()] == [1, 0]


def test_an_added_column_has_the_value_of_each_row_although_records_come_in_another_order():
    """Two runs tried the same episode; the records are told apart by when they began."""
    won = make_result("success", 0, started_at="first")
    lost = make_result("failure", 0, started_at="second")
    frame = make_frame([("a", [won]), ("b", [lost])])

    found = with_columns(frame, [lost, won], {"ended": lambda record: record.outcome})

    assert list(found["ended"]) == ["success", "failure"]


def test_added_columns_tell_equal_values_of_different_types_apart():
    """1 == True; would find the flag stored as the number."""
    result = make_result("success")
    reads = {"number": lambda _: 1, "flag": lambda _: True}

    found = with_columns(frame_of([result]), [result], reads)

    assert found["flag"][0] is True
    assert found["number"][0] is not True


def test_a_planned_policy_without_a_result_has_a_row_with_its_missing_episode():
    """The plan of the run *mine* has one episode of the policy *late*, and nothing was played.

    So the versions of the policy and of all else (`Versions()`) are not known yet.
    """
    planned = make_result(policy="late").identity

    ((key, cell),) = cells_of(make_frame([], [planned], run_name="mine")).items()

    late = key.policy_run
    assert (late.policy, late.versions, late.run) == ("late", Versions(), "mine")
    assert cell.missing == 1


def test_the_documentation_lists_every_column_of_the_results():
    """As rows of a table: name, kind, meaning, and when it is missing."""
    page = (Path(__file__).parents[2] / "docs" / "report.md").read_text(encoding="utf-8")

    for column in (*COLUMNS.values(), *record_columns().values()):
        missing = column.missing or "never"
        row = f"| `{column.name}` | {column.kind} | {column.meaning} | {missing} |"
        assert row in page


def test_a_run_that_is_named_several_times_is_opened_once_with_all_wanted_policies(
    tmp_path, monkeypatch
):
    """A source is FOLDER or FOLDER:POLICY; a folder alone wants all of its policies (None).

    Two spellings of a path are one folder; of "c:d:e" the folder is "c:d", as that exists.
    """
    monkeypatch.chdir(tmp_path)
    for name in ("a", "b", "c", "c:d"):
        Path(name).mkdir()
    given = ["a:x", "b:y", "./a", "b:z:Z", f"../{tmp_path.name}/b:y", "c:d:e", "c:e"]

    with opened_sources(given) as found:
        assert [(str(source.path), source.policies) for source in found] == [
            ("a", None), ("b", ("y", "z:Z")), ("c:d", ("e",)), ("c", ("e",)),
        ]  # fmt: skip
