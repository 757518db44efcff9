"""Made-up results, without simulator, language or files; a browser; and the time limit of waits."""

from __future__ import annotations

import os
import shutil
import socket
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboirg.analysis.published import TRIALS, published_rows
from roboirg.core.instruction_options import InstructionOptions
from roboirg.records.record import Result

MakeResult = Callable[..., Result]
OpenPage = Callable[..., AbstractContextManager[Any]]

WAIT_S = 300.0
"""Time limit of every wait for a browser, a server or a process, long enough for a busy machine."""
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def make_result(outcome: str = "success", episode: int = 0, **fields: object) -> Result:
    usual = {
        "policy": "listener",
        "task": "PickXtimes",
        "split": "test",
        "setting": "explicit",
        "seed": episode,
        "difficulty": "easy",
        "privileged": False,
        "language_version": "1",
        "environment_version": 1,
        "package_version": "0",
        **fields,
    }
    error = {"error": "policy"} if outcome == "error" else {}
    return Result(outcome=outcome, episode=episode, **error, **usual)  # type: ignore[arg-type]


def with_rate(
    successes: int,
    episodes: int,
    seeds: int,
    rng: np.random.Generator,
    options: InstructionOptions,
    **fields: object,
) -> Iterable[Result]:
    """Yield the results of a cell with a number of successes on randomly drawn trials."""
    won = np.zeros(episodes * seeds, dtype=bool)
    won[rng.permutation(len(won))[:successes]] = True
    for number, success in enumerate(won.tolist()):
        yield make_result(
            "success" if success else "failure",
            number // seeds,
            policy_seed=number % seeds,
            **options._asdict(),
            **fields,
        )


def like_published(table: str, only: str | None = None) -> list[Result]:
    """Return results with the rates, episodes and seeds of a published table."""
    episodes, seeds = TRIALS[table]  # type: ignore[index]
    rng = np.random.default_rng(8)
    return [
        result
        for row in published_rows(table)
        if only is None or row.model == only
        for task, rate in row.rates.items()
        if rate is not None
        for result in with_rate(
            round(Fraction(rate) * episodes * seeds / 100),
            episodes,
            seeds,
            rng,
            row.options,
            policy=row.model,
            task=task,
        )
    ]


@pytest.fixture(scope="session")
def result() -> MakeResult:
    return make_result


@pytest.fixture(scope="session")
def published_like() -> Callable[..., list[Result]]:
    return like_published


@pytest.fixture(scope="session")
def cell_of() -> Callable[..., Iterable[Result]]:
    return with_rate


@pytest.fixture(scope="session")
def wait_s() -> float:
    return WAIT_S


@pytest.fixture(scope="module")
def patient_sockets() -> Iterator[None]:
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(WAIT_S)
    yield
    socket.setdefaulttimeout(before)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    reason = "no browser: pip install playwright, and a Chromium (Debian's package chromium)"
    playwright = pytest.importorskip("playwright.sync_api", reason=reason)
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    with playwright.sync_playwright() as driver:
        if path is None and not Path(driver.chromium.executable_path).exists():
            pytest.skip(reason)
        # Chromium refuses its sandbox to root, the user of most containers.
        arguments = ["--no-sandbox"] if os.geteuid() == 0 else []
        chromium = driver.chromium.launch(
            executable_path=path, args=arguments, timeout=1000 * WAIT_S
        )
        yield chromium
        chromium.close()


@pytest.fixture
def open_page(browser: Any) -> OpenPage:
    """Open a page that must log no error or warning and load nothing from elsewhere."""

    @contextmanager
    def open_address(address: str, **options: Any) -> Iterator[Any]:
        context = browser.new_context(viewport={"width": 1280, "height": 900}, **options)
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
