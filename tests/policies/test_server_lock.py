"""One episode at a time on a stateful server, across processes that may be killed."""

import multiprocessing
import os
import signal
import time

import pytest
from wire_episode import INSTRUCTION, moment, video
from wire_servers import MmeVlaServer

from roboirg.core import waiting
from roboirg.core.errors import PolicyConnectionError, PolicyTimeoutError
from roboirg.core.waiting import queued_seconds
from roboirg.policies import make_policy
from roboirg.policies.remote.endpoints import Endpoint
from roboirg.policies.remote.server_lock import lock_server

SPAWN = multiprocessing.get_context("spawn")
FIRST_SERVER = Endpoint("h", 8001)
SECOND_SERVER = Endpoint("h", 8001, "/two")


def hold_lock(folder, endpoint, ready, seconds):
    with lock_server([endpoint], wait=5, folder=folder).file:
        ready.set()
        time.sleep(seconds)


@pytest.fixture
def process_with_first_server(tmp_path):
    """Another process that has the first server."""
    ready = SPAWN.Event()
    process = SPAWN.Process(target=hold_lock, args=(tmp_path, FIRST_SERVER, ready, 3_600))
    process.start()
    assert ready.wait(300)
    yield process
    process.kill()
    process.join()


def test_a_busy_server_is_waited_for_replaced_by_a_free_one_or_inherited(
    process_with_first_server, tmp_path, monkeypatch
):
    """Another process holds the first server; in the end it is killed and leaves it."""
    reported = []
    monkeypatch.setattr(waiting, "_listeners", [reported.append])
    before = queued_seconds()

    # The second server is free: nothing is waited for.
    lock_server([SECOND_SERVER], wait=5, folder=tmp_path).file.close()
    assert (reported, queued_seconds()) == ([], before)

    # The first one is busy: waiting is reported and counted, and ends in an error.
    start = time.monotonic()
    with (
        waiting.waiting("its turn in a test"),
        pytest.raises(PolicyTimeoutError, match=r"Other episodes used h:8001 for 0\.2 s"),
    ):
        lock_server([FIRST_SERVER], wait=0.2, folder=tmp_path)
    assert 0.2 <= time.monotonic() - start < 300

    (outer, wait, again, end) = reported
    assert (wait.what, wait.is_queue, again, end) == ("a free server: h:8001", True, outer, None)
    assert queued_seconds() - before >= 0.2

    monkeypatch.setattr(os, "getpid", lambda: 1)  # it begins with the second, then the first
    lock = lock_server([SECOND_SERVER, FIRST_SERVER], wait=0, folder=tmp_path)
    assert lock.endpoint == SECOND_SERVER
    with pytest.raises(PolicyTimeoutError, match="used h:8001/two, h:8001 for"):
        lock_server([SECOND_SERVER, FIRST_SERVER], wait=0, folder=tmp_path, shared=True)

    os.kill(process_with_first_server.pid, signal.SIGKILL)
    again = lock_server([SECOND_SERVER, FIRST_SERVER], wait=300, folder=tmp_path)
    assert again.endpoint == FIRST_SERVER

    lock.file.close()
    again.file.close()


def test_a_shared_lock_of_a_server_allows_more_shared_ones_and_no_other(tmp_path):
    locks = [lock_server([FIRST_SERVER], wait=0, folder=tmp_path, shared=True) for _ in range(3)]
    with pytest.raises(PolicyConnectionError):
        lock_server([FIRST_SERVER], wait=0, folder=tmp_path)

    for lock in locks:
        lock.file.close()
    lock_server([FIRST_SERVER], wait=0, folder=tmp_path).file.close()


def test_localhost_and_127_0_0_1_are_locked_as_the_same_server(tmp_path):
    lock = lock_server([Endpoint("localhost", 1)], wait=0, folder=tmp_path)
    with pytest.raises(PolicyConnectionError):
        lock_server([Endpoint("127.0.0.1", 1)], wait=0, folder=tmp_path)

    lock_server([Endpoint("localhost", 1, "/a/b")], wait=0, folder=tmp_path).file.close()
    lock.file.close()


def test_a_second_policy_of_the_same_thread_is_refused_instead_of_waiting_for_ever():
    with MmeVlaServer() as server:
        first, second = (make_policy(f"mme-vla://{server.place}", 0) for _ in range(2))
        first.reset(INSTRUCTION, video(0))
        with pytest.raises(PolicyConnectionError, match=r"Another policy .*; close\(\) it"):
            second.reset(INSTRUCTION, video(0))

        first.close()
        second.reset(INSTRUCTION, video(0))
        del second  # forgotten, not closed
        first.reset(INSTRUCTION, video(0))
        first.close()


def play(url, length):
    """Episodes whose every answer has to be that of a server that saw nothing else."""
    policy = make_policy(url, 0)
    for _ in range(3):
        policy.reset(INSTRUCTION, video(length))
        for step in range(12):
            history = () if step == 0 else (moment(length + step),)
            rows = policy.act(moment(length + step, history=history))
            assert rows[0, [0, 1, 3]].tolist() == [length + 1 + step, length, step + 1]
        policy.close()


def test_two_processes_that_share_a_stateful_server_get_correct_replies():
    with MmeVlaServer(delay=0.002) as server:
        url = f"mme-vla://{server.place}?part=2"
        players = [SPAWN.Process(target=play, args=(url, length)) for length in (3, 8)]
        for player in players:
            player.start()

        for player in players:
            player.join()

        assert [player.exitcode for player in players] == [0, 0]
        assert server.connections == 6
