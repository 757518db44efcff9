"""Lines of a records file: damaged ones, results, keys, and very many of them."""

import msgspec
import pytest
from msgspec.structs import replace
from run_fakes import fake_record, fake_run, small_plan

from roboirg.core.environment_options import EnvironmentOptions
from roboirg.core.policy_ref import unknown_policy
from roboirg.records.record import Job, Record, Summary
from roboirg.records.record_codec import StoreError, identity_key, read_record, read_summary
from roboirg.records.store import (
    RECORDS_FILE,
    RecordStore,
    StoredRun,
    read_records,
    read_results,
)


def run_with_lines(folder, change):
    """Play 8 episodes, and change the list of lines in the file of their records."""
    fake_run(folder)
    lines = (folder / RECORDS_FILE).read_bytes().splitlines(keepends=True)
    change(lines)
    (folder / RECORDS_FILE).write_bytes(b"".join(lines))


def damage_the_third(lines):
    lines[2] = lines[2][:40] + b"\x00\xff\n"


def test_a_damaged_line_loses_only_its_episode_and_is_reported(tmp_path, caplog):
    """Of eight records, the third line is damaged; the seven others are read."""
    run_with_lines(tmp_path, damage_the_third)

    with RecordStore(tmp_path) as store:
        assert (len(store.stored), store.torn) == (7, b"")

    (warning,) = caplog.messages
    assert warning.startswith(f"{tmp_path / RECORDS_FILE} has 1 damaged line, the first is line 3;")


def test_the_episode_of_a_damaged_line_is_played_again_and_all_records_are_found(tmp_path):
    """By reading the whole file, and by an index of where in it each record begins."""
    run_with_lines(tmp_path, damage_the_third)

    summary = fake_run(tmp_path)

    assert summary.played == 1
    records = read_records(tmp_path)
    index = StoredRun(tmp_path, read_summary)
    assert len(records) == 8
    assert tuple(index.records(index.newest)) == records


def cut_the_last(lines):
    lines[-1] = lines[-1][:40]


def test_a_last_line_that_was_cut_off_is_reported(tmp_path, caplog):
    """Of 8 records 7 are left."""
    run_with_lines(tmp_path, cut_the_last)

    run = StoredRun(tmp_path, read_summary)

    assert len(run.newest) == 7
    (warning,) = caplog.messages
    assert "ends in an unfinished line" in warning


def test_the_next_run_repairs_a_last_line_that_was_cut_off(tmp_path):
    """Reading a run whose last line is unfinished is refused, until a run has gone on there."""
    run_with_lines(tmp_path, cut_the_last)
    with pytest.raises(StoreError, match="ends in an unfinished line"):
        StoredRun(tmp_path, read_summary).file.refuse_damage()

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


def test_records_with_the_same_policy_and_options_share_them_and_others_keep_their_own(tmp_path):
    """They are decoded apart; would find one that is lost, or given to another record."""
    fake_run(tmp_path, small_plan(policies=("random", "oracle")))
    lines = (tmp_path / RECORDS_FILE).read_bytes().splitlines()
    whole = [msgspec.json.decode(line, type=Record) for line in lines]

    records = read_records(tmp_path)

    assert list(records) == whole
    assert len({id(record.ref) for record in records}) == 2
    assert len({id(record.options) for record in records}) == 2


def test_a_record_without_its_environment_has_the_default_one(tmp_path):
    """Would find that a shared field is required, which old records may lack."""
    record = fake_record(small_plan().jobs()[0])
    fields = msgspec.to_builtins(record)
    del fields["environment"]

    assert read_record(msgspec.json.encode(fields), tmp_path, 1) == record


def test_episodes_are_compared_by_all_fields_of_a_job_but_where_policy_and_words_lie():
    """A run skips what it has played; would find a field that this comparison forgets."""
    job = small_plan().jobs()[0]
    assert len(identity_key(job)) == len(Job.__struct_fields__) - len(("ref", "wordings_file"))


def test_an_episode_of_a_policy_at_another_address_is_the_same():
    job = small_plan().jobs()[0]
    elsewhere = replace(job, ref=unknown_policy("openpi://elsewhere"))

    assert identity_key(elsewhere) == identity_key(job)


@pytest.mark.parametrize(
    "option", [{"demonstration_frames": 4}, {"actions": "ee_pose"}, {"meshes": "light"}]
)
def test_an_episode_with_another_option_of_the_environment_is_another_one(option):
    job = small_plan().jobs()[0]

    other = replace(job, environment=EnvironmentOptions(**option))

    assert identity_key(other) != identity_key(job)
