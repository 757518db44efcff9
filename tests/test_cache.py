"""The cache: what is kept comes back whole or not at all, whatever is done to it."""

import logging
import os
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
    """An entry is written twice, the second time without content, and gives that; an entry that was
    never written is None. The folder is made, and has no other file."""
    cache = Cache(tmp_path / "deep" / "down", 1000)
    cache.write("a1", b"first")

    cache.write("a1", b"")

    assert cache.read("a1") == b""
    assert cache.read("b2") is None
    assert file_names_in(tmp_path / "deep" / "down") == ["a1"]


@pytest.fixture
def full_cache(tmp_path):
    """A cache of three entries of 100 bytes, each with a head of 40, the oldest first."""
    cache = Cache(tmp_path, 420)
    for second, key in enumerate(("a1", "b2", "c3")):
        cache.write(key, bytes(100))
        os.utime(tmp_path / key, (1000 + second, 1000 + second))
    return cache


def test_a_full_cache_drops_the_entry_that_was_not_read_for_longest(full_cache, tmp_path):
    """a1 is the oldest, but was just read: b2 goes."""
    full_cache.read("a1")

    full_cache.write("d4", bytes(100))

    assert file_names_in(tmp_path) == ["a1", "c3", "d4"]


def test_a_large_entry_displaces_all_others(full_cache, tmp_path):
    """The cache takes 420 bytes and has three entries of 100, each with a head of 40. One of 300
    bytes fits only without any of them."""
    full_cache.write("d4", bytes(300))

    assert file_names_in(tmp_path) == ["d4"]


def test_what_is_larger_than_the_cache_is_not_kept_and_displaces_nothing(full_cache, tmp_path):
    """The cache takes 420 bytes, and the new entry would have 1,000."""
    full_cache.write("d4", bytes(1000))

    assert file_names_in(tmp_path) == ["a1", "b2", "c3"]


WAYS_TO_DAMAGE_AN_ENTRY = {
    "truncated": lambda path: path.write_bytes(path.read_bytes()[:-1]),
    "empty": lambda path: path.write_bytes(b""),
    "a bit": lambda path: path.write_bytes(path.read_bytes().replace(b"forty-t", b"forty-u")),
    "another entry": lambda path: path.with_name("b2").replace(path),
}


@pytest.mark.parametrize("harm", WAYS_TO_DAMAGE_AN_ENTRY.values(), ids=WAYS_TO_DAMAGE_AN_ENTRY)
def test_a_damaged_entry_is_reported_not_returned_and_can_be_written_anew(tmp_path, caplog, harm):
    """Entry a1 is cut off, emptied, changed by a letter, or replaced by the file of another entry,
    b2."""
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
    """Each of two processes writes 100 entries of 20 kB, under five names, and reads each back; a
    wrong content makes it fail."""
    processes = [process_that_fills(tmp_path, 100, 20_000) for _ in range(2)]
    for process in processes:
        _, complaints = process.communicate(timeout=600)
        assert (process.returncode, complaints) == (0, "")
    assert file_names_in(tmp_path) == ["0", "1", "2", "3", "4"]


def kill_a_writer(folder, later_s):
    """Start a process that writes entries of 3 MB to a cache, and kill it while it does.

    An entry is written under a name that ends with .part, and gets its own at the end. The process
    is killed so many seconds after a new file of that kind has appeared.
    """
    there_before = set(folder.glob("*.part"))
    process = process_that_fills(folder, count=10**9, size=3_000_000)
    while set(folder.glob("*.part")) <= there_before:
        assert process.poll() is None
        time.sleep(0.0002)
    time.sleep(later_s)
    process.kill()
    process.communicate(timeout=600)


def test_a_process_killed_while_writing_leaves_no_damaged_entry_in_the_cache(tmp_path, caplog):
    """Four processes after each other write entries named 0 to 4, each full of its own digit, and
    are killed at the beginning of a writing or up to 4.5 ms later, in the middle of it or after it.
    What ends with .part was left unfinished; what has a name of its own must be whole, so that
    reading it gives no warning."""
    for later_s in (0.0, 0.0015, 0.003, 0.0045):
        kill_a_writer(tmp_path, later_s)

    cache = Cache(tmp_path, 40_000_000)
    for name in file_names_in(tmp_path):
        if not name.endswith(".part"):
            assert set(cache.read(name)) == set(name.encode())
    assert list(tmp_path.glob("*.part"))
    assert caplog.records == []


def test_what_a_killed_process_has_left_unfinished_is_removed_in_time(tmp_path):
    """A file that ends with .part is an entry that is being written, or whose writer was killed. It
    is kept for ten minutes, longer than a writing takes; later the next writing removes it."""
    cache = Cache(tmp_path, 1000)
    (tmp_path / "a1.part").write_bytes(b"young")
    (tmp_path / "b2.part").write_bytes(b"old")
    eleven_minutes_ago = time.time() - 660
    os.utime(tmp_path / "b2.part", (eleven_minutes_ago, eleven_minutes_ago))

    cache.write("c3", b"whole")

    assert file_names_in(tmp_path) == ["a1.part", "c3"]


def test_a_cache_that_cannot_be_written_is_reported_once_and_does_without(tmp_path, caplog):
    """Its folder would have to be below a file. Three writings give one warning, and reading finds
    nothing."""
    (tmp_path / "file").write_bytes(b"")
    cache = Cache(tmp_path / "file" / "below", 1000)
    cache_module._warned.clear()

    for _ in range(3):
        cache.write("a1", b"content")
        assert cache.read("a1") is None
    assert [record.levelno for record in caplog.records] == [logging.WARNING]
    assert "is unusable" in caplog.text


@pytest.mark.parametrize(
    ("variable", "value"), [("ROBOIRG_CACHE", "off"), ("ROBOIRG_CACHE_GIB", "1e-8")]
)
def test_a_cache_that_is_off_or_too_small_keeps_nothing(monkeypatch, variable, value):
    """1e-8 GiB are ten bytes, for which the entry with its head is too large."""
    monkeypatch.setenv(variable, value)

    open_cache("actions").write("a1", b"content")

    assert open_cache("actions").read("a1") is None


def test_each_kind_of_entries_has_a_folder_below_that_of_the_variable(tmp_path, monkeypatch):
    """An entry among the actions is not among the frames, though both have the name a1."""
    monkeypatch.setenv("ROBOIRG_CACHE", str(tmp_path / "here"))

    open_cache("actions").write("a1", b"content")

    assert open_cache("actions").read("a1") == b"content"
    assert open_cache("frames").read("a1") is None


def test_the_cache_is_in_the_user_s_cache_folder_by_default(tmp_path, monkeypatch):
    monkeypatch.delenv("ROBOIRG_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))

    open_cache("frames").write("a1", b"content")

    assert (tmp_path / "roboirgbench" / "frames" / "a1").exists()


@pytest.mark.parametrize("wrong", ["0", "-1", "many", "nan", "inf"])
def test_a_size_of_the_cache_that_is_no_positive_number_is_refused(wrong, monkeypatch):
    monkeypatch.setenv("ROBOIRG_CACHE_GIB", wrong)

    with pytest.raises(InvalidValueError, match=f"ROBOIRG_CACHE_GIB is '{wrong}'"):
        open_cache("frames")
