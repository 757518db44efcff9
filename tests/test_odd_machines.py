"""What is odd about some machines: no home, no /dev/shm, proxies, narrow encodings."""

import io
import os
import sys

import pytest

from roboirg import main as cli
from roboirg.cli import doctor
from roboirg.cli.doctor import Check
from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.policies.vlm.models import ModelOptions, make_model
from roboirg.runs.play.watchdog import Watchdog
from roboirg.util.child_process import ChildProcess
from roboirg.util.proxies import proxy_of
from roboirg.util.user_folders import temporary_folder, user_folder


@pytest.fixture
def environment_without_proxies(monkeypatch):
    """The environment, without proxies."""
    for name in [name for name in os.environ if name.lower().endswith("_proxy")]:
        monkeypatch.delenv(name)
    return monkeypatch


@pytest.fixture
def _environment_with_proxies(environment_without_proxies):
    environment_without_proxies.setenv("http_proxy", "http://user:secret@proxy:9")
    environment_without_proxies.setenv("HTTPS_PROXY", "proxy:8")
    environment_without_proxies.setenv("ALL_PROXY", "https://[::1]:7")
    environment_without_proxies.setenv("NO_PROXY", ".lab,10.0.0.1,fd00::1")


@pytest.mark.usefixtures("_environment_with_proxies")
@pytest.mark.parametrize(
    ("url", "proxy"),
    [
        ("http://models.org/v1", "http://proxy:9 of http_proxy"),
        ("https://models.org", "http://proxy:8 of HTTPS_PROXY"),
        ("ftp://models.org", "https://[::1]:7 of ALL_PROXY"),
        ("http://localhost.org", "http://proxy:9 of http_proxy"),
    ],
)
def test_the_proxy_of_an_address_is_named_with_its_variable_and_without_its_password(url, proxy):
    """Only what NO_PROXY lists, .lab, 10.0.0.1 and fd00::1, and this machine have none."""
    assert proxy_of(url).words == f" through the proxy {proxy}"


THIS_MACHINE = ["localhost", "127.1.2.3", "[::1]", "localhost.", "[::ffff:127.0.0.1]", "[::]"]
LISTED_IN_NO_PROXY = ["a.lab", "10.0.0.1", "[fd00::1]"]


@pytest.mark.usefixtures("_environment_with_proxies")
@pytest.mark.parametrize("host", THIS_MACHINE + LISTED_IN_NO_PROXY)
def test_this_machine_and_what_no_proxy_lists_have_no_proxy(host):
    assert proxy_of(f"http://{host}:80/v1").words == ""


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ("socks5://u:secret@h:1", "socks5://h:1"),
        ("socks://u:secret@h:1", "socks://h:1"),
        ("http://u:secret@h:1x", "http://h:1x"),
        ("http://u:sec/ret@h:1", "http://h:1"),
        ("http://u:sec\nret@h:1", "http://h:1"),
    ],
)
def test_a_proxy_that_cannot_be_used_is_refused_without_printing_its_password(
    environment_without_proxies, given, shown
):
    """A proxy for SOCKS needs a package, which cannot be imported here; others have a port that is
    no number, or a password that ends the address. A model behind it is refused."""
    environment_without_proxies.setenv("ALL_PROXY", given)
    environment_without_proxies.setitem(sys.modules, "socksio", None)

    with pytest.raises(MissingDependencyError, match=f"proxy {shown} of ALL_PROXY cannot be used"):
        make_model(ModelOptions(model="m", base_url="http://models.org/v1"))


def test_a_proxy_that_cannot_be_used_is_no_hindrance_to_a_model_on_this_machine(
    environment_without_proxies,
):
    environment_without_proxies.setenv("ALL_PROXY", "http://h:1x")

    make_model(ModelOptions(model="m", base_url="http://127.0.0.1:8/v1"))


def no_such_user(uid):
    raise KeyError(uid)


def test_a_user_without_a_home_gets_a_private_folder_among_the_temporary_ones(
    monkeypatch, tmp_path
):
    """As in a container that runs as a user without an entry of its own: HOME is empty, and Python
    finds no user of this number. Temporary files are in `tmp_path`; the folder there has the
    user's number in its name and can be entered by that user alone, which is mode 700."""
    monkeypatch.setenv("HOME", "")
    monkeypatch.setattr("pwd.getpwuid", no_such_user)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))

    folder = user_folder("data", below="servers")

    assert folder == tmp_path / f"roboirgbench-{os.getuid()}" / "servers"
    assert folder.parent.stat().st_mode & 0o777 == 0o700


@pytest.mark.skipif(os.getuid() != 0, reason="only root gives a link to another user")
def test_a_temporary_folder_that_another_user_made_a_link_is_refused(monkeypatch, tmp_path):
    """All users share the folder of temporary files. Another one, number 12345, has put a link
    there with the name of this user's folder, to read or change what is written to it."""
    (tmp_path / "ours").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    link = tmp_path / f"roboirgbench-{os.getuid()}"
    link.symlink_to("ours")
    os.chown(link, 12345, -1, follow_symlinks=False)

    with pytest.raises(InvalidValueError, match="belongs to another user"):
        temporary_folder()


def begin_a_phase_and_wait(connection, watchdog):
    """What the child process does: it notes the phase in which it is, and waits for its end."""
    watchdog.write("policy's act()", 1e9)
    connection.send(None)
    connection.recv()


@pytest.fixture
def _without_shared_memory(monkeypatch):
    """As without /dev/shm, where `multiprocessing` has its shared memory: making some fails."""
    monkeypatch.setattr("multiprocessing.heap.Arena", None)


@pytest.mark.usefixtures("_without_shared_memory")
@pytest.mark.parametrize("has_memory_files", [True, False])
def test_a_worker_is_watched_without_shared_memory(monkeypatch, has_memory_files):
    """A watchdog shows this process in which phase a child is. The fixture breaks the usual shared
    memory, so the phase goes through a file in memory, which `os.memfd_create` makes; Pythons that
    are built for old systems lack that function, and a temporary file takes its place."""
    if not has_memory_files:
        monkeypatch.delattr(os, "memfd_create")
    watchdog = Watchdog()

    child = ChildProcess.spawn(begin_a_phase_and_wait, watchdog)
    child.receive()
    phase = watchdog.phase
    child.end()

    assert phase == "policy's act()"


@pytest.mark.parametrize(
    ("encoding", "shown"), [("ascii", b"?"), ("latin-1", b"?"), ("utf-8", "≠".encode())]
)
def test_a_character_that_the_terminal_cannot_show_is_printed_as_a_question_mark(
    monkeypatch, encoding, shown
):
    """The command, replaced by a function that prints "≠", writes to a terminal of this encoding.
    Only UTF-8 has the character; the others must not end the command."""
    terminal = io.TextIOWrapper(io.BytesIO(), encoding)
    monkeypatch.setattr(sys, "stdout", terminal)
    monkeypatch.setattr(cli, "app", lambda **_: terminal.write("≠"))

    with pytest.raises(SystemExit):
        cli.main()

    terminal.flush()
    assert terminal.buffer.getvalue() == shown


def test_the_doctor_names_a_missing_temporary_folder(monkeypatch, tmp_path):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "gone"))

    files = doctor._check_files()[1]

    assert (files.ok, files.found) == (False, "No such file or directory")


def test_the_doctor_names_a_wrong_path_of_the_cache(monkeypatch):
    """`~nobody-here` is the home of a user that there is not. The doctor's third check of files is
    the cache."""
    monkeypatch.setenv("ROBOIRG_CACHE", "~nobody-here/x")

    cache = doctor._check_files()[2]

    reason = "ROBOIRG_CACHE is '~nobody-here/x', but there is no such home"
    assert (cache.ok, cache.found, cache.remedy) == (False, reason, "write the whole path.")


def test_the_doctor_names_proxies(environment_without_proxies):
    environment_without_proxies.setenv("http_proxy", "http://a:b@h:1")

    proxies = doctor._check_files()[-1]

    assert proxies == Check("proxies", True, "through the proxy http://h:1 of http_proxy")
