"""Measure how long a page of many episodes takes to make, open and filter.

python scripts/bench_page.py RUN [--episodes 10000] [--browser /usr/bin/chromium]

Repeats the episodes of a run with other policy seeds. Needs Playwright for Python and Chromium.
"""

from __future__ import annotations

import argparse
import itertools
import os
import shutil
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from roboirg.evaluation.analysis.page.entries import Run
from roboirg.evaluation.analysis.page.report import render_runs
from roboirg.evaluation.records.record import Record
from roboirg.evaluation.records.store import read_records

BROWSERS = ("chromium", "google-chrome", "chromium-browser")
REPEATS = 5
FILTERS: dict[str, dict[str, str]] = {
    "task": {"task": "StopCube"},
    "outcome": {"outcome": "failure"},
    "words, common": {"words": "cube"},
    "words, none": {"words": "no such words at all"},
    "everything again": {},
    "two policies": {"view": "pairs"},
}

FILTER = """async (hash) => {
  const begun = performance.now();
  history.replaceState(null, "", hash);
  dispatchEvent(new HashChangeEvent("hashchange"));
  await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
  return performance.now() - begun;
}"""
"""Filter and return the milliseconds until the next frame is painted."""


def repeated(records: tuple[Record, ...], number: int) -> list[Record]:
    """Return a number of copies of records; each round has another policy seed."""
    copies = (
        replace(record, policy_seed=seed, video=None)
        for seed in itertools.count()
        for record in records
    )
    return list(itertools.islice(copies, number))


def measure(page: Any, path: Path) -> None:  # noqa: ANN401 - Playwright may be missing
    """Open and filter a page several times; print the medians in milliseconds."""
    opened = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        page.goto(path.as_uri())
        page.wait_for_selector("#rows li")
        opened.append(1000 * (time.perf_counter() - start))
    print(f"open, until the list appears: {statistics.median(opened):.0f} ms")
    print(f"open, by the page's clock: {page.evaluate('roboirg.counters.openMs'):.0f} ms")
    for name, filters in FILTERS.items():
        words = "&".join(f"{key}={value}" for key, value in filters.items())
        times = [page.evaluate(FILTER, f"#?{words}") for _ in range(REPEATS)]
        print(
            f"filter, {name}: {statistics.median(times):.0f} ms "
            f"({page.evaluate('roboirg.counters.matched')} match, "
            f"{page.evaluate('document.querySelectorAll(`*`).length')} elements)"
        )


def main() -> None:
    """Create the page in a temporary folder and measure it."""
    from playwright.sync_api import sync_playwright

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("--episodes", type=int, default=10_000)
    parser.add_argument("--browser", default=next(filter(None, map(shutil.which, BROWSERS)), None))
    arguments = parser.parse_args()
    records = repeated(read_records(arguments.run), arguments.episodes)
    start = time.perf_counter()
    text = render_runs([Run("", records)])
    print(f"{len(records)} episodes, {len(text) / 1e6:.1f} MB, created in "
          f"{time.perf_counter() - start:.1f} s")  # fmt: skip
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        path = Path(folder) / "page.html"
        path.write_text(text)
        flags = ["--no-sandbox"] if os.geteuid() == 0 else []
        browser = playwright.chromium.launch(executable_path=arguments.browser, args=flags)
        measure(browser.new_page(viewport={"width": 1280, "height": 900}), path)
        browser.close()


if __name__ == "__main__":
    main()
