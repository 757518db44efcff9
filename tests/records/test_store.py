import errno
import functools
import math
import os
import resource
import tempfile
from dataclasses import replace as replace_field
from pathlib import Path
from unittest.mock import patch

import pytest
from flat_jobs import with_version
from hypothesis import given, settings
from hypothesis import strategies as st
from made_records import fill
from msgspec.structs import replace
from run_fakes import FakePlay, fake_record, fake_run, small_plan

from roboirg.core.environment_options import EnvironmentOptions
from roboirg.core.errors import RoboIRGError
from roboirg.core.versions import Versions
from roboirg.policies.remote.endpoints import Endpoint
from roboirg.policies.remote.server_lock import lock_server
from roboirg.records.line_file import LOCK_FILE
from roboirg.records.record_codec import StoreError, encode
from roboirg.records.run_files import PLAN_FILE
from roboirg.records.store import (
    RECORDS_FILE,
    TORN_FILE,
    RecordStore,
    check_same,
    iterate_records,
    read_index,
    read_records,
    read_results,
)
from roboirg.runs.plan.stored_plans import write_plan
from roboirg.runs.run.executor import InProcess
from roboirg.runs.run.runner import check_run, run_plan
from roboirg.util.atomic_write import locked, write_atomically


@pytest.mark.parametrize("field", Versions._fields[1:])
def test_a_run_is_refused_if_any_of_its_versions_differs(field):
    """Versions are those of the language, the environment, the server and so on. One of them was
    *a* when the run began, and is *b* now.
    """
    differences = Versions(**{field: "a"}).differences(Versions(**{field: "b"}))

    sentence = f"^x whose {field.replace('_', ' ')} is a, but now it is b; choose another --out.$"
    with pytest.raises(StoreError, match=sentence):
        check_same("x", differences)


@pytest.mark.parametrize("field", Versions._fields[1:])
def test_an_unknown_version_differs_from_none(field):
    assert not Versions(**{field: "a"}).differences(Versions())


@functools.cache
def eight_records():
    """Return the records of four episodes in explicit and in direct."""
    return tuple(fake_record(job) for job in small_plan(4).jobs())


@given(data=st.data())
@settings(max_examples=40, deadline=None)
def test_a_file_of_records_cut_anywhere_loses_only_the_line_that_was_cut(data):
    """A crash leaves the first lines of a file of records, and a part of the next line.

    All whole records are read; one is whole as soon as its last brace is there, as only the newline
    is missing. Once the file is opened to be written, it has their lines again; what is left of the
    line that was cut is moved to a file of its own.
    """
    lines = [encode(record) for record in eight_records()]
    whole_lines = lines[: data.draw(st.integers(0, 7), label="whole lines")]
    next_line = lines[len(whole_lines)]
    bytes_left = st.integers(0, len(next_line)) | st.just(len(next_line))
    torn = next_line[: data.draw(bytes_left, label="bytes left of the next line")]
    kept = [*whole_lines, torn]

    with tempfile.TemporaryDirectory() as name:
        path = Path(name, RECORDS_FILE)
        path.write_bytes(b"\n".join(kept))
        if torn == next_line:
            torn = b""
        else:
            kept.pop()
        found = list(map(encode, iterate_records(path.parent)))
        with RecordStore(path.parent) as store:
            assert store.torn == torn

        assert found == kept
        assert path.read_bytes() == b"".join(line + b"\n" for line in kept)
        if torn:
            assert path.with_name(TORN_FILE).read_bytes() == torn + b"\n"


def test_an_error_before_a_policy_declares_its_version_gets_that_of_its_verdicts(tmp_path):
    """Of a policy that declares its version late one episode was won, with version 7; another one
    ended in an error before that, so that its version is unknown.

    Both are results of the same policy, so the error is read as one of version 7 and counts there.
    """
    first, second, *_ = eight_records()
    won = with_version(first, "7")
    failed = replace(with_version(second, "unknown"), outcome="error", error="policy")
    fill(tmp_path, won, failed)

    results = read_results(tmp_path)

    assert [result.policy_version for result in results] == ["7", "7"]


def test_an_error_of_another_policy_of_the_same_name_stays_of_unknown_version(tmp_path):
    """One policy won an episode with version 7. Another one of the same name, which is made of
    other parts (`makeup`), ended in an error before it declared its version.

    The version 7 of the one says nothing of the other.
    """
    first, second, *_ = eight_records()
    won = with_version(first, "7")
    another = replace_field(won.ref, version="unknown", makeup=(("policy", "another"),))
    failed = replace(second, ref=another, outcome="error", error="policy")
    fill(tmp_path, won, failed)

    results = read_results(tmp_path)

    assert [result.policy_version for result in results] == ["7", "unknown"]


def test_unfinished_lines_of_several_crashes_are_all_kept_in_a_file_of_their_own(tmp_path):
    """Twice a crash cuts off a record in its line, and the file of records is opened again to be
    written. Both unfinished lines are moved to TORN_FILE, and no record is left.
    """
    for torn in (b'{"policy": "a', b'{"policy": "b'):
        with (tmp_path / RECORDS_FILE).open("ab") as file:
            file.write(torn)
        RecordStore(tmp_path).close()
    assert (tmp_path / TORN_FILE).read_bytes() == b'{"policy": "a\n{"policy": "b\n'
    assert (tmp_path / RECORDS_FILE).read_bytes() == b""


def test_a_second_run_in_the_same_folder_is_refused_with_the_process_of_the_first(tmp_path):
    """A store locks its folder. Once the first store is closed, another may open the folder."""
    first = RecordStore(tmp_path)

    with pytest.raises(StoreError, match=rf"being written by .*process {os.getpid()}\)"):
        RecordStore(tmp_path)

    first.close()
    RecordStore(tmp_path).close()


def test_a_lock_that_a_killed_run_left_refuses_nobody(tmp_path):
    """The number is that of a process."""
    (tmp_path / LOCK_FILE).write_text("12345678901234\n")
    RecordStore(tmp_path).close()


@pytest.mark.parametrize(
    "take",
    [
        RecordStore,
        lambda folder: locked(folder / ".lock", "").__enter__(),
        lambda folder: lock_server([Endpoint("h", 1)], wait=0, folder=folder),
    ],
)
def test_a_file_system_without_locks_is_reported_with_the_advice_to_use_a_local_disk(
    tmp_path, take
):
    """Three places take a lock; the call for it is replaced by one that fails with ENOLCK."""
    with (
        patch("fcntl.flock", side_effect=OSError(errno.ENOLCK, "No locks available")),
        pytest.raises(RoboIRGError, match=r"Cannot lock .*lock \(No locks .* local disk\.$"),
    ):
        take(tmp_path)


def test_records_of_a_newer_format_are_refused_and_stay_as_they_are(tmp_path):
    """And the lock of the folder is given back, so that a second attempt says the same."""
    path = fill(tmp_path, *eight_records()) / RECORDS_FILE
    newer = path.read_bytes().replace(b'"schema_version":1', b'"schema_version":7', 1)
    path.write_bytes(newer)

    sentence = r"line 1 has schema version 7, .* reads only version 1;"
    for _ in range(2):
        with pytest.raises(StoreError, match=sentence):
            RecordStore(tmp_path)

    assert path.read_bytes() == newer


@pytest.mark.parametrize("read", [read_records, read_results, read_index])
@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        (b'{"schema_version":1,"policy":3}', r"line 1 is not a record: Expected `str`.*policy"),
        (b"[]", "line 1 has schema version None"),
    ],
)
def test_a_line_that_is_no_record_is_reported_with_its_number(tmp_path, read, line, sentence):
    """A file of one line: a record whose policy is a number, or a list."""
    (tmp_path / RECORDS_FILE).write_bytes(line + b"\n")

    with pytest.raises(StoreError, match=sentence):
        read(tmp_path)


@pytest.mark.parametrize(
    "fields",
    [{"steps": 2**63}, {"duration_s": math.nan}, {"usage": {"cost_usd": math.inf}},
     {"environment": EnvironmentOptions(max_steps=10**22)}],
    ids=["steps", "duration", "cost", "step limit"],
)  # fmt: skip
def test_a_record_with_a_number_that_could_not_be_read_back_is_not_written(tmp_path, fields):
    """Numbers beyond 64 bits, NaN and infinity have no place in JSON, or are not read back as they
    were. The file stays empty.
    """
    record = replace(eight_records()[0], **fields)

    with RecordStore(tmp_path) as store, pytest.raises(StoreError, match=r"is not a record"):
        store.append(record)

    assert (tmp_path / RECORDS_FILE).read_bytes() == b""


def test_of_two_records_of_an_episode_the_newer_is_read(tmp_path):
    """The newer one of the first episode stands last in the file, with 1234 steps."""
    first, *others = eight_records()
    newer = replace(first, steps=1234)

    fill(tmp_path, first, *others, newer)

    assert read_records(tmp_path) == (newer, *others)  # where the older one stood


def test_a_folder_without_records_is_reported_in_one_sentence(tmp_path):
    with pytest.raises(StoreError, match="There are no records in"):
        read_records(tmp_path / "nowhere")


def test_atomic_writing_replaces_a_file_and_leaves_no_temporary_one(tmp_path):
    (tmp_path / "x.txt").write_text("old")

    write_atomically(tmp_path / "x.txt", "new")

    assert [path.name for path in tmp_path.iterdir()] == ["x.txt"]
    assert (tmp_path / "x.txt").read_text() == "new"


@pytest.fixture
def victim(tmp_path):
    """A file of somebody else, next to the folder `run`."""
    path = tmp_path / "victim"
    path.write_text("mine")
    (tmp_path / "run").mkdir()
    return path


@pytest.fixture
def limit_file_sizes():
    """Return what limits the size of files, in bytes, as a full disk does."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_full_disk_ends_the_run_in_one_sentence_and_loses_no_earlier_record(
    tmp_path, limit_file_sizes
):
    """Files may have the size of three records and 100 bytes, as on a full disk.

    The kernel takes a part of the fourth record and refuses the rest. That part is removed again.
    """
    three_records = fill(tmp_path / "whole", *eight_records()[:3]) / RECORDS_FILE
    folder = tmp_path / "run"
    limit_file_sizes(three_records.stat().st_size + 100)

    with pytest.raises(StoreError, match=rf"^Cannot write to {folder}.*: File too large\.$"):
        run_plan(
            small_plan(), folder, lambda job: replace(FakePlay()(job), started_at=""), InProcess()
        )

    with RecordStore(folder) as store:
        assert (len(store.stored), store.torn) == (3, b"")


@pytest.mark.parametrize(
    "begin",
    [RecordStore, lambda folder: check_run(small_plan(), folder)],
    ids=["stored", "checked"],
)
@pytest.mark.parametrize("name", [LOCK_FILE, RECORDS_FILE, "videos/a.jpg"])
def test_a_run_writes_nothing_through_a_link_in_its_folder(tmp_path, victim, name, begin):
    """Each name is one that a run writes to; here it links to a file of somebody else."""
    link = tmp_path / "run" / name
    link.parent.mkdir(exist_ok=True)
    link.symlink_to(victim)

    with pytest.raises(RoboIRGError, match=f"{link} is a symbolic link, and a run writes"):
        begin(tmp_path / "run")

    assert victim.read_text() == "mine"


@pytest.mark.parametrize("name", [LOCK_FILE, RECORDS_FILE, "models.sqlite"])
def test_a_run_changes_no_file_that_has_another_name_elsewhere(tmp_path, victim, name):
    """A file of the run is a hard link to a file of somebody else: to write into the one would
    change the other.
    """
    (tmp_path / "run" / name).hardlink_to(victim)

    with pytest.raises(RoboIRGError, match=f"{name} has another name elsewhere"):
        RecordStore(tmp_path / "run")

    assert victim.read_text() == "mine"


@pytest.mark.parametrize("name", ["records.torn", "logs/a.txt"])
def test_a_run_does_not_start_where_a_pipe_would_block_it(tmp_path, name):
    """A file to write to is a named pipe, where a writer waits until somebody reads. The
    unfinished record in the folder would be moved to records.torn.
    """
    path = tmp_path / "run" / name
    path.parent.mkdir(parents=True)
    (tmp_path / "run" / RECORDS_FILE).write_text('{"a')
    os.mkfifo(path)

    with pytest.raises(RoboIRGError, match=f"{name} is neither a file nor a folder"):
        RecordStore(tmp_path / "run")


def test_a_plan_may_be_a_hard_link_as_it_is_replaced(tmp_path, victim):
    """Writing the plan makes a new file of that name; the other name keeps the old content."""
    (tmp_path / "run" / PLAN_FILE).hardlink_to(victim)

    with RecordStore(tmp_path / "run"):
        write_plan(small_plan(), tmp_path / "run")

    assert victim.read_text() == "mine"


def test_a_folder_of_videos_on_another_disk_is_refused_at_the_start(tmp_path):
    """The folder `videos` of the run is a link to a folder elsewhere. Nothing is recorded."""
    (tmp_path / "disk").mkdir()
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "videos").symlink_to(tmp_path / "disk")

    with pytest.raises(RoboIRGError, match="make the folder of the run itself the link"):
        fake_run(tmp_path / "run")
    assert not (tmp_path / "run" / RECORDS_FILE).exists()


def test_a_folder_of_a_run_may_be_a_link(tmp_path):
    (tmp_path / "disk").mkdir()
    (tmp_path / "run").symlink_to(tmp_path / "disk")

    fill(tmp_path / "run", *eight_records())

    assert read_records(tmp_path / "disk") == eight_records()


def test_a_lock_that_is_a_link_is_refused(tmp_path, victim):
    (tmp_path / "lock").symlink_to(victim)
    refused = pytest.raises(RoboIRGError, match=f"Cannot write {tmp_path / 'lock'}")

    with refused, locked(tmp_path / "lock", "taken"):
        pass
