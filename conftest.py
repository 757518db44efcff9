"""Shared by all tests: Hypothesis's profile, caches that start empty, Ctrl-C, a browser."""

from __future__ import annotations

import functools
import gc
import importlib.metadata
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers

# Examples are derived from the test, not from the clock: CI finds what a laptop finds.
settings.register_profile(
    "roboirg", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("roboirg")

# What a session compiles is kept, even where the environment asks for no bytecode: both workers
# and the hundreds of processes that tests start would compile the same modules.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# One thread draws and calculates, as in the worker processes of a run: several workers test side
# by side, and threads that wait for each other take more time than they save.
for name in ("LP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")

# Hypothesis draws from the constants of all modules that are loaded: reading those takes seconds,
# and the examples would depend on the tests before.
providers._get_local_constants = providers.Constants

# A shell starts background jobs with SIGINT ignored, which programs under test would inherit.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

_read_entry_points = importlib.metadata.entry_points


@functools.cache
def _entry_points_on(path: tuple[str, ...], **wanted: str) -> importlib.metadata.EntryPoints:
    return _read_entry_points(**wanted)


# A look at every installed package takes 10 ms, and each name that no policy has causes one.
importlib.metadata.entry_points = lambda **wanted: _entry_points_on(tuple(sys.path), **wanted)

_BEGAN = pytest.StashKey[float]()

OpenPage = Callable[..., AbstractContextManager[Any]]

WAIT_S = 300.0
"""Time limit of every wait for a browser, a server or a process, long enough for a busy machine."""
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def pytest_configure(config: pytest.Config) -> None:
    """Give the processes of a session one cache.

    It starts empty: what an earlier version left must not decide a test.
    """
    if not hasattr(config, "workerinput"):  # pytest-xdist's workers inherit it
        folder = tempfile.TemporaryDirectory(prefix="roboirg-tests-", ignore_cleanup_errors=True)
        os.environ["ROBOIRG_CACHE"] = folder.name
        config.add_cleanup(folder.cleanup)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Bring files with slow tests to the front.

    They take the longest. One that began last would leave all workers but its own without work.
    """
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow)


def _processor_s() -> float:
    """Seconds of this process and of those of its children that have ended."""
    return sum(os.times()[:4])


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Measure each test's processor time, with fixtures and what its children took."""
    item.stash[_BEGAN] = _processor_s()
    return (yield)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_teardown(item: pytest.Item) -> Iterator[None]:
    yield
    item.user_properties.append(("processor", f"{_processor_s() - item.stash[_BEGAN]:.3f}"))


def pytest_collection_finish() -> None:
    """Spare the garbage collector what stays until the end: all tests and their modules."""
    gc.freeze()


@pytest.fixture
def without_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    """For what must be made twice to be compared, or from nothing."""
    monkeypatch.setenv("ROBOIRG_CACHE", "off")


@pytest.fixture(scope="session")
def wait_s() -> float:
    return WAIT_S


def starts(browser: str) -> bool:
    """Whether a browser is more than Ubuntu's advice to install it by snap."""
    return subprocess.run([browser, "--version"], capture_output=True, check=False).returncode == 0


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    reason = "no browser: pip install playwright, and a Chromium (Debian's package chromium)"
    playwright = pytest.importorskip("playwright.sync_api", reason=reason)
    path = next(filter(starts, filter(None, map(shutil.which, BROWSERS))), None)
    try:
        driver = playwright.sync_playwright().start()
    except Exception:  # Playwright's program needs libraries that come with Debian's Chromium
        if path is not None:
            raise
        pytest.skip(reason)
    with ExitStack() as stack:
        stack.callback(driver.stop)
        if path is None and not Path(driver.chromium.executable_path).exists():
            pytest.skip(reason)
        # Chromium refuses its sandbox to root, the user of most containers.
        arguments = ["--no-sandbox"] if os.geteuid() == 0 else []
        chromium = driver.chromium.launch(
            executable_path=path, args=arguments, timeout=1000 * WAIT_S
        )
        stack.callback(chromium.close)
        yield chromium


@pytest.fixture
def open_page(browser: Any) -> OpenPage:
    """Open a page that must log no error or warning and load nothing from elsewhere."""

    @contextmanager
    def open_address(address: str, **options: Any) -> Iterator[Any]:
        context = browser.new_context(**{"viewport": {"width": 1280, "height": 900}, **options})
        page = context.new_page()
        page.set_default_timeout(1000 * WAIT_S)
        wrong: list[str] = []
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on(
            "console", lambda entry: entry.type in ("error", "warning") and wrong.append(entry.text)
        )
        page.on("request", lambda asked: asked.url.startswith(("file:", "data:", "http://127.0.0.1"))
                or wrong.append(asked.url))  # fmt: skip
        page.goto(address)
        yield page
        context.close()
        assert wrong == []

    return open_address


class EndedCommand(NamedTuple):
    """Exit code of a command, and what it printed as output and as errors."""

    code: int
    out: str
    err: str


@pytest.fixture
def roboirg(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., EndedCommand]:
    """The command, in this process: from its words to how it ended."""
    from roboirg import main as cli

    def call(*words: object) -> EndedCommand:
        monkeypatch.setattr(sys, "argv", ["roboirg", *map(str, words)])
        with pytest.raises(SystemExit) as left:
            cli.main()
        return EndedCommand(int(left.value.code or 0), *capsys.readouterr())

    return call


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands start no worker processes."""
    monkeypatch.setenv("ROBOIRG_WORKERS", "0")
