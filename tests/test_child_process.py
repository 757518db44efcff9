"""Child processes: what they say, how they ended, and that nothing of them is left."""

from __future__ import annotations

import errno
import os
import resource
import signal
import subprocess
import sys
import time
from multiprocessing.context import SpawnProcess
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

import pytest

from roboirg.core.errors import RoboIRGError
from roboirg.util.child_process import ChildExit, ChildProcess, serve
from roboirg.util.parallel_map import parallel_map
from roboirg.util.process_guard import descendants


def answer_messages(connection):
    serve(connection, obey_message)


def obey_message(message):
    if message == "leave":
        os._exit(3)
    if message == "ignore":
        time.sleep(3600)
    if message == "group":
        return subprocess.Popen(["sleep", "3600"]).pid
    return os.getpid(), signal.getsignal(signal.SIGINT)


def is_alive(pid):
    try:
        return "(sleep) Z" not in Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False


def wait_for(what):
    deadline = time.monotonic() + 60
    while not what() and time.monotonic() < deadline:
        time.sleep(0.02)
    return what()


def test_a_child_answers_and_exits_when_its_channel_is_closed():
    """Asked "who", the child answers its process number and how it treats Ctrl-C, which it must
    ignore: its parent handles it."""
    child = ChildProcess.spawn(answer_messages)
    child.send("who")

    assert child.receive() == (child.pid, signal.SIG_IGN)
    assert child.exit is None
    assert child.close() == ChildExit(0) == child.exit


def test_a_child_that_ended_is_reported_with_its_exit_code():
    """Told "leave", a child ends with exit code 3."""
    child = ChildProcess.spawn(answer_messages)
    child.send("leave")

    ended = child.receive()

    assert (str(ended), ended.was_killed) == ("the process ended with exit code 3", False)


def test_a_child_that_was_killed_is_reported_with_its_signal():
    """Also when it is asked something more."""
    child = ChildProcess.spawn(answer_messages)
    os.kill(child.pid, signal.SIGKILL)
    child.send("who")

    ended = child.receive()

    assert (str(ended), ended.was_killed) == ("the process died of signal 9 (Killed)", True)
    child.send("who")
    assert isinstance(child.receive(), ChildExit)


def test_closing_does_not_wait_for_a_child_that_the_kernel_cannot_end():
    """As one that hangs in a driver: `join` must get a limit, or all workers would stop.

    Here `join` is `abs`, which fails without an argument.
    """
    stuck = SimpleNamespace(exitcode=None, kill=str, pid=2**30, join=abs, close=str)
    assert ChildProcess(stuck, stuck).close() == ChildExit(None)


@pytest.fixture
def _few_open_files():
    """This process may have 64 open files, and raise that; the limit is put back in the end."""
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (64, limits[1]))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, limits)


@pytest.mark.usefixtures("_few_open_files")
def test_a_child_that_cannot_start_is_reported_with_what_would_help():
    """Starting a process is replaced by a failure, as where too many files are open. The limit of
    open files, 64 here, has been raised before that, so what is left is to use fewer workers."""
    too_many = OSError(errno.EMFILE, "Too many files")

    with (
        patch.object(SpawnProcess, "start", side_effect=too_many),
        pytest.raises(RoboIRGError, match=r"be started: Too many files; use fewer workers, or"),
    ):
        ChildProcess.spawn(answer_messages)

    most_open_files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    assert most_open_files >= 1_024


def test_a_process_that_a_child_has_started_ends_with_the_child():
    """Told "group", a child starts a process and answers its number; told "ignore", it hangs."""
    child = ChildProcess.spawn(answer_messages)
    child.send("group")
    grandchild = child.receive()
    assert is_alive(grandchild)

    child.send("ignore")
    child.end()
    assert child.exit == ChildExit(-signal.SIGKILL)
    assert wait_for(lambda: not is_alive(grandchild))


END_DESCENDANTS_SEEN_AT_THE_SECOND_LOOK = """
import os, subprocess
from roboirg.util import process_guard
child = subprocess.Popen(["sleep", "3600"], stdout=subprocess.DEVNULL, start_new_session=True)
find = process_guard.descendants
looks = []

def nothing_at_first(pid):
    looks.append(pid)
    return find(pid) if len(looks) > 1 else []

process_guard.descendants = nothing_at_first
process_guard._end_descendants(2**30)
print(child.pid)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_the_guard_of_a_child_looks_again_until_no_descendant_is_left():
    """Its first look finds none, as if a process had just forked; the second finds `sleep`."""
    ended = subprocess.run(
        [sys.executable, "-c", END_DESCENDANTS_SEEN_AT_THE_SECOND_LOOK],
        stdout=subprocess.PIPE,
        check=True,
    )

    assert not is_alive(int(ended.stdout))


GIVE_ITSELF_A_NAME_AND_WAIT = r"""
import ctypes
PR_SET_NAME = 15
name = b"\xff) R 1\n(\xfe"
ctypes.CDLL(None).prctl(PR_SET_NAME, name)
print("named", flush=True)
input()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_descendants_are_found_although_their_names_contain_brackets_and_line_ends():
    """Linux lists a process in /proc/PID/stat as "PID (NAME) STATE PARENT", and a program may
    choose its name. This one looks like the end of the brackets, with 1 as the parent, and has a
    line end and bytes that are no text; the child must be found below this process all the same."""
    command = [sys.executable, "-c", GIVE_ITSELF_A_NAME_AND_WAIT]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe) as child:
        assert child.stdout.readline() == b"named\n"

        found = descendants(os.getpid())

        child.kill()
    assert child.pid in found


def test_children_do_not_outlive_a_parent_that_is_killed(tmp_path):
    """A script starts a child, prints the child's process number, and waits for it, while the child
    hangs. The script is killed, so it cannot clean up."""
    script = tmp_path / "parent.py"
    script.write_text(
        f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "import test_child_process as own\n"
        "if __name__ == '__main__':\n"
        "    child = own.ChildProcess.spawn(own.answer_messages)\n"
        "    child.send('who'); print(child.receive()[0], flush=True)\n"
        "    child.send('ignore'); child.receive()\n"
    )

    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        assert is_alive(pid)
        parent.kill()

    assert wait_for(lambda: not is_alive(pid))


def square_root_but_for_7_and_9(number):
    if number == 7:
        raise ValueError("seven")
    if number == 9:
        os._exit(4)
    return number**0.5


def test_a_parallel_map_yields_each_item_with_its_result():
    found = parallel_map(square_root_but_for_7_and_9, [0, 1, 4, 16], 3)

    assert dict(found) == {0: 0.0, 1: 1.0, 4: 2.0, 16: 4.0}


def test_a_parallel_map_names_the_item_at_which_a_process_died():
    """The function ends its process with exit code 4 at the item 9."""
    with pytest.raises(RoboIRGError, match="died at 9: the process ended with exit code 4"):
        list(parallel_map(square_root_but_for_7_and_9, [9], 2))


def test_a_parallel_map_raises_an_exception_with_a_note_of_where_it_was_raised():
    """The function raises the exception at the item 7, in another process, whose traceback would be
    lost."""
    with pytest.raises(ValueError, match="seven") as caught:
        list(parallel_map(square_root_but_for_7_and_9, [7], 1))

    assert "in square_root_but_for_7_and_9" in caught.value.__notes__[0]


def test_a_parallel_map_that_is_closed_early_ends_its_processes():
    """Two of three sleep for an hour, so the test would not end."""
    found = parallel_map(time.sleep, [0.0, 3600.0, 3600.0], 2)
    assert next(found) == (0.0, None)

    found.close()
