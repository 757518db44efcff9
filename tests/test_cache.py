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

KEYS = ("a1", "b2", "c3")


def entries(folder):
    return sorted(path.name for path in folder.iterdir())


def test_what_is_kept_comes_back(tmp_path):
    cache = Cache(tmp_path / "deep" / "down", 1000)
    assert cache.read("a1") is None

    cache.write("a1", b"")
    cache.write("b2", bytes(range(256)))
    cache.write("b2", bytes(range(200)))
    assert (cache.read("a1"), cache.read("b2")) == (b"", bytes(range(200)))
    assert entries(tmp_path / "deep" / "down") == ["a1", "b2"]


def test_what_was_not_used_for_longest_goes_first(tmp_path):
    cache = Cache(tmp_path, 3 * 140)
    for age, key in enumerate(KEYS):
        cache.write(key, bytes(100))  # and a head of 40
        os.utime(tmp_path / key, (1000 + age, 1000 + age))
    assert cache.read("a1") == bytes(100)

    cache.write("d4", bytes(100))
    assert entries(tmp_path) == ["a1", "c3", "d4"]

    cache.write("large", bytes(1000))
    assert entries(tmp_path) == ["a1", "c3", "d4"]

    cache.write("e5", bytes(300))
    assert entries(tmp_path) == ["e5"]


DAMAGE = {
    "truncated": lambda path: path.write_bytes(path.read_bytes()[:-1]),
    "empty": lambda path: path.write_bytes(b""),
    "a bit": lambda path: path.write_bytes(path.read_bytes().replace(b"forty-t", b"forty-u")),
    "another entry": lambda path: path.with_name("b2").replace(path),
}


@pytest.mark.parametrize("harm", DAMAGE.values(), ids=DAMAGE)
def test_damage_is_logged_once_and_repaired(tmp_path, caplog, harm):
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


WRITER = """
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


def writer(folder, count, size):
    command = [sys.executable, "-c", WRITER, str(folder), str(count), str(size)]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, bufsize=1
    )
    assert process.stdout.readline() == "ready\n"
    return process


def test_two_processes_may_fill_it_at_once(tmp_path):
    processes = [writer(tmp_path, 100, 20_000) for _ in range(2)]
    for process in processes:
        _, complaints = process.communicate(timeout=600)
        assert (process.returncode, complaints) == (0, "")
    assert entries(tmp_path) == ["0", "1", "2", "3", "4"]


def test_a_kill_while_writing_leaves_no_bad_entry(tmp_path, caplog, monkeypatch):
    caught_writing = 0
    for number in range(4):
        process = writer(tmp_path, 10**9, 3_000_000)
        before = set(entries(tmp_path))
        # As soon as it writes, or a little later: in the middle of it, or between two entries.
        while not any(name.endswith(".part") for name in set(entries(tmp_path)) - before):
            assert process.poll() is None
            time.sleep(0.0002)
        time.sleep(0.0015 * number)
        os.kill(process.pid, signal.SIGKILL)
        process.communicate(timeout=600)
        assert process.returncode == -signal.SIGKILL
        parts = [name for name in entries(tmp_path) if name.endswith(".part")]
        caught_writing += len(parts) > caught_writing
        cache = Cache(tmp_path, 40_000_000)
        for key in set(entries(tmp_path)) - set(parts):
            assert set(cache.read(key)) == set(key.encode())
    assert caught_writing
    assert caplog.records == []

    # What was left unfinished is swept out in time.
    monkeypatch.setattr(cache_module, "_ABANDONED_S", -1.0)
    cache.write("0", b"0")
    assert not any(name.endswith(".part") for name in entries(tmp_path))


def test_a_disk_that_refuses_costs_one_notice(tmp_path, caplog):
    (tmp_path / "file").write_bytes(b"")
    cache = Cache(tmp_path / "file" / "below", 1000)
    cache_module._warned.clear()

    for _ in range(3):
        cache.write("a1", b"content")
        assert cache.read("a1") is None
    assert [record.levelno for record in caplog.records] == [logging.WARNING]
    assert "is unusable" in caplog.text


def test_the_environment_says_where_and_how_much(tmp_path, monkeypatch):
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
