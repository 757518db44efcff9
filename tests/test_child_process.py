"""Child processes: what they say, how they ended, and that nothing of them is left."""

from __future__ import annotations

import errno
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

import pytest

from roboirg.core.errors import RoboIRGError
from roboirg.util.child_process import ChildExit, ChildProcess, serve
from roboirg.util.parallel_map import parallel_map
from roboirg.util.process_guard import descendants


def answer(connection: Connection) -> None:
    serve(connection, obey)


def obey(message: str) -> object:
    if message == "leave":
        os._exit(3)
    if message == "ignore":
        time.sleep(3600)
    if message == "group":
        return subprocess.Popen(["sleep", "3600"]).pid
    return os.getpid(), signal.getsignal(signal.SIGINT)


def is_alive(pid: int) -> bool:
    try:
        return "(sleep) Z" not in Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False


def wait_for(what: Callable[[], bool]) -> bool:
    deadline = time.monotonic() + 60
    while not what() and time.monotonic() < deadline:
        time.sleep(0.02)
    return what()


def test_a_child_answers_and_exits_when_its_channel_is_closed():
    child = ChildProcess.spawn(answer)
    child.send("who")

    assert child.receive() == (child.pid, signal.SIG_IGN)
    assert child.exit is None
    assert child.close() == ChildExit(0) == child.exit


@pytest.mark.parametrize(
    ("message", "words", "was_killed"),
    [
        ("leave", "the process ended with exit code 3", False),
        ("kill", "the process died of signal 9 (Killed)", True),
    ],
)
def test_how_a_child_ended_is_told(message, words, was_killed):
    child = ChildProcess.spawn(answer)
    child.send("who")
    child.receive()
    if message == "kill":
        os.kill(child.pid, signal.SIGKILL)
    child.send(message)
    ended = child.receive()

    assert (str(ended), ended.was_killed) == (words, was_killed)

    child.send("who")
    assert isinstance(child.receive(), ChildExit)


def test_a_child_that_the_kernel_does_not_end_is_left():
    """`join` needs a limit here, as `abs` does: waiting for a driver would stop all workers."""
    stuck = SimpleNamespace(exitcode=None, kill=str, pid=2**30, join=abs, close=str)
    assert ChildProcess(stuck, stuck).close() == ChildExit(None)  # type: ignore[arg-type]


def test_where_no_process_can_start_one_sentence_says_what_would_help():
    """The usual limit of open files is raised before that."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (64, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))
    with (
        patch.object(SpawnProcess, "start", side_effect=OSError(errno.EMFILE, "Too many files")),
        pytest.raises(RoboIRGError, match=r"be started: Too many files; use fewer workers, or"),
    ):
        ChildProcess.spawn(answer)
    assert resource.getrlimit(resource.RLIMIT_NOFILE)[0] >= 1_024


def test_what_a_child_has_started_ends_with_it():
    child = ChildProcess.spawn(answer)
    child.send("group")
    grandchild = child.receive()
    assert is_alive(grandchild)

    child.send("ignore")
    child.end()
    assert child.exit == ChildExit(-signal.SIGKILL)
    assert wait_for(lambda: not is_alive(grandchild))


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_guard_ends_only_when_nothing_is_left_even_of_what_a_look_at_all_processes_misses():
    script = (
        "import subprocess\nfrom roboirg.util import process_guard\n"
        "child = subprocess.Popen(['sleep', '3600'], stdout=-3, start_new_session=True)\n"
        "looks = [process_guard.descendants, lambda pid: []]\n"
        "process_guard.descendants = lambda pid: (looks.pop() if looks[1:] else looks[0])(pid)\n"
        f"process_guard._end_descendants({2**30})\n"
        "print(child.pid)\n"
    )
    ended = subprocess.run([sys.executable, "-c", script], stdout=subprocess.PIPE, check=True)
    assert not is_alive(int(ended.stdout))


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_processes_are_found_whatever_their_names():
    name = r"b'\xff) R 1\n(\xfe'"
    script = f"import ctypes; ctypes.CDLL(None).prctl(15, {name}); print(flush=True); input()"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", script], **pipes) as child:  # type: ignore[call-overload]
        assert child.stdout.readline()
        assert child.pid in descendants(os.getpid())
        child.kill()


def test_children_do_not_outlive_a_parent_that_is_killed(tmp_path):
    script = tmp_path / "parent.py"
    script.write_text(
        f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "import test_child_process as own\n"
        "if __name__ == '__main__':\n"
        "    child = own.ChildProcess.spawn(own.answer)\n"
        "    child.send('who'); print(child.receive()[0], flush=True)\n"
        "    child.send('ignore'); child.receive()\n"
    )

    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        assert is_alive(pid)
        parent.kill()

    assert wait_for(lambda: not is_alive(pid))


def root(number: int) -> float:
    if number == 7:
        raise ValueError("seven")
    if number == 9:
        os._exit(4)
    return number**0.5


def test_a_map_names_the_item_at_which_a_process_died_and_raises_what_was_raised():
    assert dict(parallel_map(root, range(5), 3)) == {n: n**0.5 for n in range(5)}
    with pytest.raises(RoboIRGError, match="died at 9: the process ended with exit code 4"):
        list(parallel_map(root, [9], 2))
    with pytest.raises(ValueError, match="seven") as caught:
        list(parallel_map(root, [7], 1))
    assert "in root" in caught.value.__notes__[0]  # where it was raised


def test_a_map_that_is_left_ends_its_processes():
    found = parallel_map(time.sleep, [0.0, 3600.0, 3600.0], 2)
    assert next(found) == (0.0, None)
    found.close()  # type: ignore[attr-defined]
