"""Lines of a records file: damaged ones, results, keys, and very many of them."""

from __future__ import annotations

import msgspec
import pytest
from msgspec.structs import replace
from run_fakes import fake_run, small_plan

from roboirg.core.environment_options import EnvironmentOptions
from roboirg.core.policy_ref import unknown_policy
from roboirg.records.record import Job, Summary
from roboirg.records.record_codec import StoreError, identity_key, read_summary
from roboirg.records.store import (
    RECORDS_FILE,
    RecordStore,
    StoredRun,
    read_records,
    read_results,
)


def folder_with_lines(folder, *lines):
    (folder / RECORDS_FILE).write_bytes(b"".join(lines))
    return folder


def test_a_damaged_line_loses_only_its_episode_and_is_reported(tmp_path, caplog):
    fake_run(tmp_path)
    lines = (tmp_path / RECORDS_FILE).read_bytes().splitlines(keepends=True)
    folder_with_lines(tmp_path, *lines[:2], lines[2][:40] + b"\x00\xff\n", *lines[3:])
    with RecordStore(tmp_path) as store:
        assert (len(store.stored), store.torn) == (7, b"")

    (warning,) = caplog.messages
    assert warning.startswith(f"{tmp_path / RECORDS_FILE} has 1 damaged line, the first is line 3;")

    summary = fake_run(tmp_path)
    assert summary.played == 1

    records = read_records(tmp_path)
    index = StoredRun(tmp_path, read_summary)
    assert len(records) == 8
    # Whole records are found behind the damage, too.
    assert tuple(index.records(index.newest)) == records


def test_a_last_line_that_was_cut_off_is_reported_and_the_next_run_repairs_it(tmp_path, caplog):
    """Of 8 records the last was cut after 40 bytes."""
    fake_run(tmp_path)
    lines = (tmp_path / RECORDS_FILE).read_bytes().splitlines(keepends=True)
    folder_with_lines(tmp_path, *lines[:-1], lines[-1][:40])
    run = StoredRun(tmp_path, read_summary)

    assert len(run.newest) == 7

    (warning,) = caplog.messages
    assert "ends in an unfinished line" in warning
    with pytest.raises(StoreError, match="ends in an unfinished line"):
        run.file.refuse_damage()

    fake_run(tmp_path)
    StoredRun(tmp_path, read_summary).file.refuse_damage()


def test_results_have_the_fields_of_records_without_what_happened_in_the_episode(tmp_path):
    """They are read faster; would find a field that differs."""
    fake_run(tmp_path)
    records = read_records(tmp_path)

    results = read_results(tmp_path)

    for record, result in zip(records, results, strict=True):
        named = {name: getattr(record, name) for name in Summary.__struct_fields__}
        assert msgspec.structs.asdict(result) == named
        assert (result.slug, result.options) == (record.slug, record.options)


def test_episodes_are_the_same_only_if_all_options_agree_wherever_policy_and_words_lie():
    """A run skips what it has played; would find an option that this comparison forgets."""
    job = small_plan().jobs()[0]
    not_counted = {"ref", "wordings_file"}
    assert len(identity_key(job)) == len(set(Job.__struct_fields__) - not_counted)
    assert identity_key(job.with_options(stages=(1, 5))) != identity_key(job)

    others = {"demonstration_frames": 4, "actions": "ee_pose", "meshes": "light"}
    for name, value in others.items():
        other = replace(job, environment=EnvironmentOptions(**{name: value}))
        assert identity_key(other) != identity_key(job)
    assert identity_key(replace(job, ref=unknown_policy("openpi://elsewhere"))) == identity_key(job)
