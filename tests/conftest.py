"""Shared by all tests: Hypothesis's profile, no cache but a test's own, Ctrl-C, a browser."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

# Examples are derived from the test, not from the clock: CI finds what a laptop finds.
settings.register_profile(
    "roboirg", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("roboirg")

# What an earlier version left in the user's cache must not decide a test.
os.environ["ROBOIRG_CACHE"] = "off"

# A shell starts background jobs with SIGINT ignored, which programs under test would inherit.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

OpenPage = Callable[..., AbstractContextManager[Any]]

WAIT_S = 300.0
"""Time limit of every wait for a browser, a server or a process, long enough for a busy machine."""
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


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
