from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest
from flat_jobs import with_version
from made_records import fill
from msgspec.structs import replace
from run_fakes import FakePlay, fake_run, small_plan

from roboirg.core.errors import InvalidValueError
from roboirg.records.episode_log import log_path
from roboirg.records.merging import merge_runs
from roboirg.records.record import Record
from roboirg.records.record_codec import StoreError, identity_key
from roboirg.records.run_files import PLAN_FILE, earlier_plans
from roboirg.records.store import read_records


def some(count: int = 4) -> list[Record]:
    return [FakePlay()(job) for job in small_plan(count).jobs()]


def test_two_halves_make_the_whole(tmp_path: Path) -> None:
    whole = tmp_path / "whole"
    fake_run(whole)
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
    two = replace(two, verdict_code="old")
    # Another policy has versions of its own, another split seeds of its own.
    elsewhere = {"arm": "silent", "verdict_code": "older", "split": "val", "episode": 0, "seed": 5}
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
    assert [warning.partition(".")[0] for warning in merged.warnings] == [  # of the told ones
        f"Mixed states of the code that decides verdicts: {one.verdict_code}, old"
    ]


def test_videos_actions_and_logs_are_copied_with_the_records_that_are_kept(tmp_path: Path) -> None:
    one, two, *_ = some()
    one = replace(one, video="videos/x.mp4", action_log="ab" * 32)
    two = replace(two, video="videos/gone.mp4")
    error = replace(one, outcome="error", error="connection")
    sources = [fill(tmp_path / "a", error, two), fill(tmp_path / "b", one, two)]
    logs = [str(log_path(Path(), record.slug)) for record in (one, two)]
    films = ["videos/x.mp4", "videos/x.jpg", f"actions/ab/{'ab' * 32}.npz"]
    for source in sources:
        for name in (*logs, *films):
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_text(source.name)
    out = tmp_path / "out"
    merge_runs(sources, out)
    # The verdict of the second run is kept in place of the error, and the first of two verdicts.
    assert [(out / name).read_text() for name in (*logs, *films)] == ["b", "a", "b", "b", "b"]
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
def test_versions_are_not_mixed(tmp_path: Path, field: str, value: object, words: str) -> None:
    record = replace(some()[0], words="PickXtimes/test@1b")
    odd = replace(record, **{field: value})
    one, other = fill(tmp_path / "a", record), fill(tmp_path / "b", odd)
    for folders, out in (([one, other], tmp_path / "out"), ([other], one)):
        with pytest.raises(StoreError, match=f"{words}.* cannot be merged"):
            merge_runs(folders, out)
    assert not (tmp_path / "out").exists()


def test_a_run_is_not_merged_into_itself(tmp_path: Path) -> None:
    folder = fill(tmp_path / "a", *some())
    with pytest.raises(InvalidValueError, match="is one of the runs"):
        merge_runs([folder], tmp_path / "b/../a")


def test_runs_with_two_wording_files_can_be_merged(tmp_path: Path) -> None:
    """Their words differ, as they should."""
    usual = some()[0]
    records = []
    for name in ("0a", "1b"):
        options = dataclasses.replace(usual.options, wordings=f"mine@{name}")
        records.append(replace(usual, options=options, words=f"PickXtimes/test@{name}"))
    folders = [fill(tmp_path / record.words[-2:], record) for record in records]
    assert merge_runs(folders, tmp_path / "out").added == len(records)
