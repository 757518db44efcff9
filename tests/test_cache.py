"""The cache: what is kept comes back whole or not at all, whatever is done to it."""

import logging
import os
import signal
import subprocess
import sys
import time

import pytest

from roboirg.core.errors import InvalidValueError
from roboirg.util import cache as cache_module
from roboirg.util.cache import Cache, open_cache


def file_names_in(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_cache_gives_back_what_was_written_last(tmp_path):
    cache = Cache(tmp_path / "deep" / "down", 1000)
    assert cache.read("a1") is None

    cache.write("a1", b"")
    cache.write("b2", bytes(range(256)))
    cache.write("b2", bytes(range(200)))
    assert (cache.read("a1"), cache.read("b2")) == (b"", bytes(range(200)))
    assert file_names_in(tmp_path / "deep" / "down") == ["a1", "b2"]


def test_a_full_cache_drops_the_entries_that_were_not_read_for_longest(tmp_path):
    """It has room for three entries of 100 bytes, each with a head of 40."""
    cache = Cache(tmp_path, 3 * 140)
    for age, key in enumerate(("a1", "b2", "c3")):
        cache.write(key, bytes(100))
        os.utime(tmp_path / key, (1000 + age, 1000 + age))
    assert cache.read("a1") == bytes(100)

    # a1 is the oldest, but was just read: b2 goes.
    cache.write("d4", bytes(100))
    assert file_names_in(tmp_path) == ["a1", "c3", "d4"]

    # What is larger than the cache is not kept, and costs no other entry.
    cache.write("large", bytes(1000))
    assert file_names_in(tmp_path) == ["a1", "c3", "d4"]

    # 340 bytes of 420: all others go.
    cache.write("e5", bytes(300))
    assert file_names_in(tmp_path) == ["e5"]


WAYS_TO_DAMAGE_AN_ENTRY = {
    "truncated": lambda path: path.write_bytes(path.read_bytes()[:-1]),
    "empty": lambda path: path.write_bytes(b""),
    "a bit": lambda path: path.write_bytes(path.read_bytes().replace(b"forty-t", b"forty-u")),
    "another entry": lambda path: path.with_name("b2").replace(path),
}


@pytest.mark.parametrize("harm", WAYS_TO_DAMAGE_AN_ENTRY.values(), ids=WAYS_TO_DAMAGE_AN_ENTRY)
def test_a_damaged_entry_is_reported_not_returned_and_can_be_written_anew(tmp_path, caplog, harm):
    cache = Cache(tmp_path, 1000)
    cache.write("b2", b"something else")
    cache.write("a1", b"forty-two")
    harm(tmp_path / "a1")

    assert cache.read("a1") is None
    assert [record.getMessage() for record in caplog.records] == [
        f"The cache entry {tmp_path / 'a1'} is damaged and will be rebuilt."
    ]

    cache.write("a1", b"forty-two")
    assert cache.read("a1") == b"forty-two"
    assert len(caplog.records) == 1


PROGRAM_THAT_FILLS_A_CACHE = """
import sys
from pathlib import Path
from roboirg.util.cache import Cache
cache = Cache(Path(sys.argv[1]), 40_000_000)
print("ready", flush=True)
for number in range(int(sys.argv[2])):
    key = str(number % 5)
    cache.write(key, key.encode() * (int(sys.argv[3]) + number))
    content = cache.read(key)
    assert content is None or set(content) == set(key.encode())
"""


def process_that_fills(folder, count, size):
    command = [sys.executable, "-c", PROGRAM_THAT_FILLS_A_CACHE, str(folder), str(count), str(size)]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, bufsize=1
    )
    assert process.stdout.readline() == "ready\n"
    return process


def test_two_processes_may_fill_a_cache_at_once(tmp_path):
    processes = [process_that_fills(tmp_path, 100, 20_000) for _ in range(2)]
    for process in processes:
        _, complaints = process.communicate(timeout=600)
        assert (process.returncode, complaints) == (0, "")
    assert file_names_in(tmp_path) == ["0", "1", "2", "3", "4"]


def test_a_process_killed_while_writing_leaves_no_damaged_entry_in_the_cache(
    tmp_path, caplog, monkeypatch
):
    caught_writing = 0
    for number in range(4):
        process = process_that_fills(tmp_path, 10**9, 3_000_000)
        before = set(file_names_in(tmp_path))
        # As soon as it writes, or a little later: in the middle of it, or between two entries.
        while not any(name.endswith(".part") for name in set(file_names_in(tmp_path)) - before):
            assert process.poll() is None
            time.sleep(0.0002)
        time.sleep(0.0015 * number)
        os.kill(process.pid, signal.SIGKILL)
        process.communicate(timeout=600)
        assert process.returncode == -signal.SIGKILL
        parts = [name for name in file_names_in(tmp_path) if name.endswith(".part")]
        caught_writing += len(parts) > caught_writing
        cache = Cache(tmp_path, 40_000_000)
        for key in set(file_names_in(tmp_path)) - set(parts):
            assert set(cache.read(key)) == set(key.encode())
    assert caught_writing
    assert caplog.records == []

    # What was left unfinished is swept out in time.
    monkeypatch.setattr(cache_module, "_ABANDONED_S", -1.0)
    cache.write("0", b"0")
    assert not any(name.endswith(".part") for name in file_names_in(tmp_path))


def test_a_cache_that_cannot_be_written_is_reported_once_and_does_without(tmp_path, caplog):
    (tmp_path / "file").write_bytes(b"")
    cache = Cache(tmp_path / "file" / "below", 1000)
    cache_module._warned.clear()

    for _ in range(3):
        cache.write("a1", b"content")
        assert cache.read("a1") is None
    assert [record.levelno for record in caplog.records] == [logging.WARNING]
    assert "is unusable" in caplog.text


def test_environment_variables_set_the_place_and_size_of_the_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOIRG_CACHE", "off")
    open_cache("actions").write("a1", b"content")
    assert open_cache("actions").read("a1") is None

    monkeypatch.setenv("ROBOIRG_CACHE", str(tmp_path / "here"))
    open_cache("actions").write("a1", b"content")
    assert open_cache("actions").read("a1") == b"content"
    assert open_cache("frames").read("a1") is None

    monkeypatch.delenv("ROBOIRG_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    open_cache("frames").write("a1", b"content")
    assert [path.name for path in tmp_path.glob("xdg/roboirgbench/frames/*")] == ["a1"]

    monkeypatch.setenv("ROBOIRG_CACHE_GIB", "1e-8")
    open_cache("frames").write("b2", b"content")
    assert open_cache("frames").read("b2") is None
    for wrong in ("0", "-1", "many", "nan", "inf"):
        monkeypatch.setenv("ROBOIRG_CACHE_GIB", wrong)
        with pytest.raises(InvalidValueError, match=f"ROBOIRG_CACHE_GIB is '{wrong}'"):
            open_cache("frames")
