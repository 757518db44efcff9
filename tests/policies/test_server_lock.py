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


@pytest.fixture
def lock(tmp_path):
    """Return what locks the first free one of servers, and waits for none unless it is told to."""
    return lambda *servers, wait=0, **options: lock_server(
        servers, wait=wait, folder=tmp_path, **options
    )


@pytest.fixture
def reported(monkeypatch):
    """The list of waits that were reported, each with what is waited for."""
    found = []
    monkeypatch.setattr(waiting, "_listeners", [found.append])
    return found


@pytest.mark.usefixtures("process_with_first_server")
def test_a_free_server_is_not_waited_for(lock, reported):
    """Another process (the fixture) has the first server; the second one is free.

    So its lock is got without a report that someone waits (`reported` is empty) and without a
    second of waiting time.
    """
    before = queued_seconds()

    lock(SECOND_SERVER, wait=5).file.close()

    assert reported == []
    assert queued_seconds() == before


@pytest.mark.usefixtures("process_with_first_server")
def test_waiting_for_a_busy_server_ends_in_an_error(lock):
    """Another process (the fixture) has locked h:8001, the first server, for an hour."""
    with pytest.raises(PolicyTimeoutError, match=r"Other episodes used h:8001 for 0\.2 s"):
        lock(FIRST_SERVER, wait=0.2)


@pytest.mark.usefixtures("process_with_first_server")
def test_the_wait_for_a_busy_server_counts_as_time_in_a_queue(lock):
    """Another process (the fixture) has locked the first server; this one waits 0.2 s for it."""
    before = queued_seconds()

    with pytest.raises(PolicyTimeoutError):
        lock(FIRST_SERVER, wait=0.2)

    assert queued_seconds() - before >= 0.2


@pytest.mark.usefixtures("process_with_first_server")
def test_the_wait_for_a_busy_server_is_reported_within_what_was_waited_for(lock, reported):
    """Another process (the fixture) has locked h:8001, the first server.

    `reported` has what this process waits for, whenever that changes: its turn, then the server,
    then its turn again, then nothing.
    """
    with waiting.waiting("its turn"), pytest.raises(PolicyTimeoutError):
        lock(FIRST_SERVER, wait=0.2)

    turn, server, turn_again, nothing = reported
    assert [wait.what for wait in (turn, server, turn_again)] == [
        "its turn",
        "a free server: h:8001",
        "its turn",
    ]
    assert server.is_queue
    assert nothing is None


@pytest.mark.usefixtures("process_with_first_server")
def test_of_two_servers_the_free_one_is_taken(lock):
    """Another process (the fixture) has the first server; both are asked for, without a wait."""
    held = lock(FIRST_SERVER, SECOND_SERVER)

    assert held.endpoint == SECOND_SERVER
    held.file.close()


@pytest.mark.usefixtures("process_with_first_server")
def test_if_all_servers_are_busy_the_error_names_them(lock):
    """Another process (the fixture) has the first server, and this test locks the second, `/two`.

    So both are asked for in vain, also by who would share a server.
    """
    held = lock(SECOND_SERVER)

    with pytest.raises(PolicyTimeoutError, match=r"Other episodes used .*h:8001/two"):
        lock(SECOND_SERVER, FIRST_SERVER, shared=True)

    held.file.close()


def test_the_server_of_a_process_that_was_killed_becomes_free(process_with_first_server, lock):
    """The process of the fixture has the first server, and dies without giving it back.

    The kernel then ends its lock, so that the server is got well before the 300 s are over.
    """
    os.kill(process_with_first_server.pid, signal.SIGKILL)

    held = lock(FIRST_SERVER, wait=300)

    assert held.endpoint == FIRST_SERVER
    held.file.close()


def test_a_shared_lock_of_a_server_allows_more_shared_ones_and_no_other(lock):
    """Three share the server, and then no one can have it alone; once all gave it back, one can."""
    held = [lock(FIRST_SERVER, shared=True) for _ in range(3)]
    with pytest.raises(PolicyConnectionError):
        lock(FIRST_SERVER)

    for each in held:
        each.file.close()
    lock(FIRST_SERVER).file.close()


def test_localhost_and_127_0_0_1_are_locked_as_the_same_server(lock):
    """Both names stand for this machine: who has port 1 of the one has it of the other."""
    held = lock(Endpoint("localhost", 1))

    with pytest.raises(PolicyConnectionError):
        lock(Endpoint("127.0.0.1", 1))

    held.file.close()


def test_two_paths_of_one_address_are_two_servers(lock):
    """Both servers have the address h:8001, but the second one has the path `/two`.

    While the first is locked, the second can be locked without a wait.
    """
    held = lock(FIRST_SERVER)

    lock(SECOND_SERVER).file.close()

    held.file.close()


def test_a_second_policy_of_the_same_thread_is_refused_instead_of_waiting_for_ever():
    """A server plays one episode at a time, and here the only thread that could end it waits.

    So the second policy gets an error that says what to do; once the first is closed, it can play.
    """
    with MmeVlaServer() as server:
        first = make_policy(f"mme-vla://{server.place}", 0)
        second = make_policy(f"mme-vla://{server.place}", 0)
        first.reset(INSTRUCTION, video(0))

        with pytest.raises(PolicyConnectionError, match=r"Another policy .*; close\(\) it"):
            second.reset(INSTRUCTION, video(0))

        first.close()
        second.reset(INSTRUCTION, video(0))
        second.close()


def test_a_policy_that_is_forgotten_without_being_closed_leaves_its_server():
    """Python deletes the policy, and with it its hold on the server: another one can play there."""
    with MmeVlaServer() as server:
        forgotten = make_policy(f"mme-vla://{server.place}", 0)
        forgotten.reset(INSTRUCTION, video(0))
        del forgotten

        policy = make_policy(f"mme-vla://{server.place}", 0)
        policy.reset(INSTRUCTION, video(0))
        policy.close()


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
    """Each process plays three episodes, in turns, of videos of 3 and of 8 frames.

    The server answers with the number of frames that it was shown, and each process (`play`)
    checks that these are its own episode's alone: it ends with 0 if so. Each of 2 · 3 episodes
    connects anew.
    """
    with MmeVlaServer(delay=0.002) as server:
        url = f"mme-vla://{server.place}?part=2"
        players = [SPAWN.Process(target=play, args=(url, length)) for length in (3, 8)]
        for player in players:
            player.start()

        for player in players:
            player.join()

        assert [player.exitcode for player in players] == [0, 0]
        assert server.connections == 6
