from __future__ import annotations

import os
from pathlib import Path

import pytest
from evaluation_fakes import FakePlay, small_plan
from flat_jobs import with_version
from msgspec.structs import replace

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.records.episode_log import EpisodeLog, log_path
from roboirg.evaluation.records.merging import merge_runs
from roboirg.evaluation.records.record import Record
from roboirg.evaluation.records.record_codec import StoreError, identity_key
from roboirg.evaluation.records.run_files import PLAN_FILE, earlier_plans
from roboirg.evaluation.records.store import RecordStore, read_records
from roboirg.evaluation.run.executor import InProcess
from roboirg.evaluation.run.runner import run_plan


def fill(folder: Path, *records: Record) -> Path:
    with RecordStore(folder) as store:
        for record in records:
            store.append(record)
    return folder


def some(count: int = 4) -> list[Record]:
    return [FakePlay()(job) for job in small_plan(count).jobs()]


def test_two_halves_make_the_whole(tmp_path: Path) -> None:
    whole = tmp_path / "whole"
    run_plan(small_plan(), whole, FakePlay(), InProcess())
    records = read_records(whole)
    parts = [fill(tmp_path / "a", *records[:5]), fill(tmp_path / "b", *records[3:])]
    merged = merge_runs(parts, tmp_path / "out")
    assert (merged.added, merged.duplicates, merged.conflicts) == (8, 2, ())
    assert read_records(tmp_path / "out") == records
    again = merge_runs(parts, tmp_path / "out")
    assert (again.added, again.duplicates) == (0, 10)
    merge_runs([*parts, whole], tmp_path / "out")
    (plan,) = earlier_plans(tmp_path / "out")  # or nobody could count what is missing
    assert plan.read_bytes() == (whole / PLAN_FILE).read_bytes()


def test_a_verdict_beats_an_error_and_the_first_of_two_alike_a_later_one(tmp_path: Path) -> None:
    one, two, three, four, *_ = (replace(record, server_version="8") for record in some())
    two = replace(two, code="old")
    # Another policy has versions of its own, another split seeds of its own.
    elsewhere = {"arm": "silent", "code": "older", "split": "val", "episode": 0, "seed": 5}
    silent = replace(with_version(three, "old"), policy="other", server_version="9", **elsewhere)
    lost = {"outcome": "error", "error": "connection", "server_version": None}
    other = {"success": "failure", "failure": "success"}[two.outcome]
    cause = None if other == "success" else "it fell"
    disputed = replace(two, outcome=other, cause=cause)
    broken = replace(four, outcome="error", error="connection", cause="connection: refused")
    sources = [
        (replace(one, **lost), two, broken),
        (one, disputed, silent, replace(broken, cause="connection: lost")),
        (replace(two, **lost),),
    ]
    folders = [fill(tmp_path / str(number), *run) for number, run in enumerate(sources)]
    merged = merge_runs(folders, tmp_path / "out")
    assert read_records(tmp_path / "out") == (one, two, broken, silent)
    assert [(identity_key(conflict), conflict.outcome) for conflict in merged.conflicts] == [
        (identity_key(two), other)
    ]
    assert (merged.added, merged.duplicates) == (4, 4)
    assert [warning.partition(".")[0] for warning in merged.warnings] == [
        f"Mixed states of the package's code: {one.code}, old"  # of the told ones
    ]


def test_videos_and_actions_are_copied(tmp_path: Path) -> None:
    record = replace(some()[0], video="videos/x.mp4", action_log="ab" * 32)
    lost = replace(some()[1], video="videos/gone.mp4")
    source = fill(tmp_path / "a", record, lost)
    names = ["videos/x.mp4", "videos/x.jpg", f"actions/ab/{'ab' * 32}.npz"]
    for name in names:
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        (source / name).write_text(name)
    merge_runs([source], tmp_path / "out")
    assert [(tmp_path / "out" / name).read_text() for name in names] == names
    assert [record.video for record in read_records(tmp_path / "out")] == ["videos/x.mp4", None]


def test_logs_are_copied_with_the_records_that_are_kept(tmp_path: Path) -> None:
    one, two, *_ = some()
    error = replace(one, outcome="error", error="connection")
    sources = [fill(tmp_path / "a", error, two), fill(tmp_path / "b", one, two)]
    for source, record, words in (
        (sources[0], one, "of the error"),
        (sources[0], two, "of the first verdict"),
        (sources[1], one, "of the verdict"),
        (sources[1], two, "of the second verdict"),
    ):
        with EpisodeLog(log_path(source, record.slug)) as log:
            os.write(log.descriptor, words.encode())
    merge_runs(sources, tmp_path / "out")
    found = [log_path(tmp_path / "out", record.slug).read_text() for record in (one, two)]
    assert found == ["of the verdict", "of the first verdict"]
    assert log_path(sources[0], one.slug).read_text() == "of the error"


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("language_version", "0.9", "language version of language 3 is 0.9 in the first"),
        ("environment_version", 7, "environment version is 7 in the first"),
        (
            "words",
            "PickXtimes/test@0a",
            "words version of PickXtimes/test in language 3 is PickXtimes/test@0a",
        ),
        ("policy_version", "old", "policy version of random is old in the first"),
        (
            "server_version",
            "8",
            "server version of random is 8 in the first and none in the second",
        ),
        ("seed", 5, "seed of PickXtimes test 0 is 5 in the first"),
    ],
)
def test_versions_are_not_mixed(tmp_path: Path, field: str, value: object, words: str) -> None:
    record = replace(some()[0], words="PickXtimes/test@1b")
    is_policy = field == "policy_version"
    odd = with_version(record, "old") if is_policy else replace(record, **{field: value})
    one, other = fill(tmp_path / "a", record), fill(tmp_path / "b", odd)
    for folders, out in (([one, other], tmp_path / "out"), ([other], one)):
        with pytest.raises(StoreError, match=f"cannot be merged: the {words}"):
            merge_runs(folders, out)
    assert not (tmp_path / "out").exists()


def test_a_run_is_not_merged_into_itself(tmp_path: Path) -> None:
    folder = fill(tmp_path / "a", *some())
    with pytest.raises(InvalidValueError, match="is one of the runs"):
        merge_runs([folder], tmp_path / "b/../a")
