import dataclasses
import itertools
from pathlib import Path

import pytest
from flat_jobs import with_version
from made_records import fill
from msgspec.structs import replace
from run_fakes import FakePlay, fake_run, small_plan

from roboirg.core.errors import InvalidValueError
from roboirg.records.episode_log import log_path
from roboirg.records.merging import merge_runs
from roboirg.records.record_codec import StoreError, identity_key
from roboirg.records.run_files import PLAN_FILE, earlier_plans
from roboirg.records.store import read_records


def played_records(count=4):
    """Return records of so many episodes, each in explicit and in direct."""
    return [FakePlay()(job) for job in small_plan(count).jobs()]


def test_merging_two_parts_of_a_run_gives_the_whole_without_duplicates(tmp_path):
    """Of 8 records the parts have the first 5 and the last 5, so 2 twice."""
    records = tuple(played_records())
    first = fill(tmp_path / "a", *records[:5])
    last = fill(tmp_path / "b", *records[3:])

    merged = merge_runs([first, last], tmp_path / "out")

    assert (merged.added, merged.duplicates, merged.conflicts) == (8, 2, ())
    assert read_records(tmp_path / "out") == records


def test_merging_again_into_the_same_folder_adds_nothing(tmp_path):
    part = fill(tmp_path / "a", *played_records())
    merge_runs([part], tmp_path / "out")

    again = merge_runs([part], tmp_path / "out")

    assert (again.added, again.duplicates) == (0, 8)


def test_the_plan_of_a_merged_run_is_kept(tmp_path):
    """Or nobody could count what is missing."""
    part = tmp_path / "part"
    fake_run(part)

    merge_runs([part], tmp_path / "out")

    (plan,) = earlier_plans(tmp_path / "out")
    assert plan.read_bytes() == (part / PLAN_FILE).read_bytes()


WITHOUT_CONNECTION = {"outcome": "error", "error": "connection", "server_version": None}


def test_merging_keeps_a_verdict_rather_than_an_error_and_the_first_of_two_errors(tmp_path):
    won, unplayed, *_ = played_records()
    connection = replace(unplayed, outcome="error", error="connection", cause="connection: refused")
    sources = [
        fill(tmp_path / "a", replace(won, **WITHOUT_CONNECTION), connection),
        fill(tmp_path / "b", won, replace(connection, cause="connection: lost")),
        fill(tmp_path / "c", replace(won, **WITHOUT_CONNECTION)),
    ]

    merged = merge_runs(sources, tmp_path / "out")

    assert read_records(tmp_path / "out") == (won, connection), "of two errors the first"
    assert (merged.added, merged.duplicates, merged.conflicts) == (2, 3, ())


def test_merging_keeps_the_first_of_two_verdicts_and_reports_the_other_as_a_conflict(tmp_path):
    record = played_records()[1]
    fell = replace(record, outcome="failure", cause="it fell")
    won = replace(record, outcome="success", cause=None)

    merged = merge_runs([fill(tmp_path / "a", fell), fill(tmp_path / "b", won)], tmp_path / "out")

    assert read_records(tmp_path / "out") == (fell,)
    (conflict,) = merged.conflicts
    assert (identity_key(conflict), conflict.outcome) == (identity_key(record), "success")


def test_merging_warns_of_verdicts_by_other_code_but_not_in_episodes_without_instruction(tmp_path):
    """The silent one is of another policy and split, whose versions and seeds may differ."""
    first, second, third, *_ = (replace(record, server_version="8") for record in played_records())
    second = replace(second, verdict_code="old")
    elsewhere = {"arm": "silent", "verdict_code": "older", "split": "val", "episode": 0, "seed": 5}
    silent = replace(with_version(third, "old"), policy="other", server_version="9", **elsewhere)

    merged = merge_runs(
        [fill(tmp_path / "a", first, second), fill(tmp_path / "b", silent)], tmp_path / "out"
    )

    assert read_records(tmp_path / "out") == (first, second, silent)
    assert [warning.partition(".")[0] for warning in merged.warnings] == [
        f"Mixed states of the code that decides verdicts: {first.verdict_code}, old"
    ]


def test_videos_actions_and_logs_are_copied_with_the_records_that_are_kept(tmp_path):
    first, second, *_ = played_records()
    filmed = replace(first, video="videos/x.mp4", action_log="ab" * 32)
    gone = replace(second, video="videos/gone.mp4")
    error = replace(filmed, outcome="error", error="connection")
    sources = [fill(tmp_path / "a", error, gone), fill(tmp_path / "b", filmed, gone)]
    of_first = [
        str(log_path(Path(), first.slug)),
        "videos/x.mp4",
        "videos/x.jpg",
        f"actions/ab/{'ab' * 32}.npz",
    ]
    of_second = str(log_path(Path(), second.slug))
    for source, name in itertools.product(sources, (*of_first, of_second)):
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        (source / name).write_text(source.name)
    out = tmp_path / "out"

    merge_runs(sources, out)

    # The verdict of the second run is kept in place of the error, and the first of two verdicts.
    assert [(out / name).read_text() for name in of_first] == ["b", "b", "b", "b"]
    assert (out / of_second).read_text() == "a"
    assert [record.video for record in read_records(out)] == ["videos/x.mp4", None]


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("language_version", "0.9", "episodes whose language version is 0.9, but in .* it is"),
        (
            "words",
            "PickXtimes/test@0a",
            "PickXtimes/test whose words version is PickXtimes/test@0a",
        ),
        (
            "server_version",
            "8",
            "random whose server version is 8, but in .* it is none; they",
        ),
        ("seed", 5, "PickXtimes test 0 whose seed is 5"),
    ],
)
def test_runs_of_other_words_servers_or_scenes_are_not_merged(tmp_path, field, value, words):
    """Neither into a new folder nor into one of them; nothing is written."""
    record = replace(played_records()[0], words="PickXtimes/test@1b")
    odd = replace(record, **{field: value})
    one = fill(tmp_path / "a", record)
    other = fill(tmp_path / "b", odd)

    for folders, out in (([one, other], tmp_path / "out"), ([other], one)):
        with pytest.raises(StoreError, match=f"{words}.* cannot be merged"):
            merge_runs(folders, out)
    assert not (tmp_path / "out").exists()


def test_a_run_is_not_merged_into_itself(tmp_path):
    folder = fill(tmp_path / "a", *played_records())
    with pytest.raises(InvalidValueError, match="is one of the runs"):
        merge_runs([folder], tmp_path / "b/../a")


def test_runs_with_two_wording_files_can_be_merged(tmp_path):
    """Their words differ, as they should."""
    usual = played_records()[0]
    records = []
    for name in ("0a", "1b"):
        options = dataclasses.replace(usual.options, wordings=f"mine@{name}")
        records.append(replace(usual, options=options, words=f"PickXtimes/test@{name}"))
    folders = [fill(tmp_path / record.words[-2:], record) for record in records]

    assert merge_runs(folders, tmp_path / "out").added == len(records)
