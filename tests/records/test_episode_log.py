"""What is printed in an episode goes to its log, from real processes with real descriptors."""

import os
import signal
import subprocess
import sys
import time

import pytest

from roboirg.records.episode_log import EpisodeLog, log_path, logged_output, logged_slugs

LONG_WAIT_S = 300.0
PROGRAM_THAT_PRINTS = """
import ctypes, logging, os, subprocess, sys, warnings
from pathlib import Path
from roboirg.records.episode_log import logged_output
print("before")
with logged_output(Path(sys.argv[1])):
    print("by print")
    print("on stderr", file=sys.stderr)
    logging.getLogger("policy").warning("by logging")
    warnings.warn("by warnings")
    os.write(1, b"by descriptor\\n")
    libc = ctypes.CDLL(None)
    libc.puts(b"by C")
    libc.fflush(None)
    subprocess.run(["echo", "by a child"])
    os.write(2, b"\\xff not text\\n")
print("after")
"""
PROGRAM_THAT_PRINTS_TOO_MUCH = """
import sys
from pathlib import Path
from roboirg.records.episode_log import logged_output
with logged_output(Path(sys.argv[1]), 10_000):
    print("first words")
    for number in range(30_000):
        print(f"line {number}")
    print("last words")
"""
PROGRAM_THAT_IS_KILLED = """
import os, signal, sys
from pathlib import Path
from roboirg.records.episode_log import logged_output
with logged_output(Path(sys.argv[1])):
    print("my last words")
    os.kill(os.getpid(), signal.SIGKILL)
"""
PROGRAM_THAT_CLOSES_ITS_OUTPUT = """
import os, sys
from pathlib import Path
from roboirg.records.episode_log import logged_output
with logged_output(Path(sys.argv[1])):
    print("hello")
    os.close(1)
    sys.stderr.close()
print("after")
"""


def finished_program(code, path):
    """Run Python code in a process of its own with a path as its argument, to its end."""
    return subprocess.run(
        [sys.executable, "-c", code, str(path)],
        capture_output=True,
        timeout=LONG_WAIT_S,
        check=False,
    )


def test_all_ways_to_print_end_in_the_log_and_not_on_the_terminal(tmp_path):
    """The program prints with Python, with C, through a descriptor and through a child process, on
    stdout and on stderr. What it prints before and after the episode stays on the terminal.
    """
    log = tmp_path / "logs" / "a.txt"

    done = finished_program(PROGRAM_THAT_PRINTS, log)

    assert (done.returncode, done.stdout, done.stderr) == (0, b"before\nafter\n", b"")
    printed = log.read_bytes()
    for words in (b"by print", b"on stderr", b"by logging", b"by warnings", b"by descriptor",
                  b"by C", b"by a child", b"\xff not text"):  # fmt: skip
        assert words in printed
    assert b"before" not in printed
    assert b"after" not in printed


def test_a_log_that_would_be_too_long_keeps_its_begin_and_its_end(tmp_path):
    """A program prints 30,000 lines between its first and last words; the limit is 10,000 bytes.

    The middle is replaced by one note.
    """
    assert finished_program(PROGRAM_THAT_PRINTS_TOO_MUCH, tmp_path / "a.txt").returncode == 0

    text = (tmp_path / "a.txt").read_text()
    assert len(text) <= 10_000
    assert text.startswith("first words\nline 0\n")
    assert text.endswith("line 29999\nlast words\n")
    assert text.count("\n[roboirg: the middle of this log is left out]\n") == 1


def test_the_last_words_of_a_killed_process_are_in_its_log(tmp_path):
    """The program prints one line and kills itself, so nothing could be written at its end."""
    done = finished_program(PROGRAM_THAT_IS_KILLED, tmp_path / "a.txt")

    assert done.returncode == -signal.SIGKILL
    assert (tmp_path / "a.txt").read_text() == "my last words\n"


def test_a_policy_that_closes_its_output_does_not_silence_what_comes_after_it(tmp_path):
    """Within the episode *hello* goes to the log; *after* is printed when the episode has ended."""
    done = finished_program(PROGRAM_THAT_CLOSES_ITS_OUTPUT, tmp_path / "a.txt")
    assert (done.returncode, done.stdout) == (0, b"after\n")
    assert (tmp_path / "a.txt").read_text() == "hello\n"


def test_a_log_is_cut_while_its_episode_still_prints(tmp_path):
    """A million bytes are printed, and the limit of the log is 1,000 bytes.

    A thread looks at its size four times a second. Once it has replaced the middle by a note, while
    the episode goes on, the log is within its limit; what is printed later is at its end.
    """
    path = tmp_path / "a.txt"
    note = b"[roboirg: the middle of this log is left out]"
    deadline = time.monotonic() + LONG_WAIT_S

    with EpisodeLog(path, 1_000) as log:
        os.write(log.descriptor, b"x" * 1_000_000)
        while note not in path.read_bytes():
            assert time.monotonic() < deadline
            time.sleep(0.01)
        size_meanwhile = path.stat().st_size
        os.write(log.descriptor, b"the end")

    assert size_meanwhile <= 1_000
    assert path.read_bytes().endswith(b"xxx" + b"the end")


def test_an_episode_that_prints_nothing_has_no_log(tmp_path):
    with logged_output(log_path(tmp_path, "silent")):
        pass

    assert logged_slugs(tmp_path) == frozenset()


def test_an_episode_that_is_played_again_and_prints_nothing_loses_its_old_log(tmp_path):
    """The first attempt printed *words*. Their log is gone as soon as the second attempt begins."""
    path = log_path(tmp_path, "played twice")
    with EpisodeLog(path) as log:
        os.write(log.descriptor, b"words")
    assert logged_slugs(tmp_path) == {"played twice"}

    with EpisodeLog(path):
        assert logged_slugs(tmp_path) == frozenset()
    assert logged_slugs(tmp_path) == frozenset()


def test_a_log_that_cannot_be_written_is_reported_in_one_sentence(tmp_path):
    (tmp_path / "logs").write_text("a file")
    with pytest.raises(Exception, match=r"^Cannot write the log .*a\.txt: "):
        EpisodeLog(log_path(tmp_path, "a"))
