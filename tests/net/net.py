"""The net: what must stay equal while the code changes, stored as text next to this file.

    python tests/net/net.py make [PART ...]      writes what the code gives now
    python tests/net/net.py compare [PART ...]   prints what differs from what is stored

Parts: words, printed, golden, packs; without any, all. `make net` compares them all, in minutes.
"""

from __future__ import annotations

import difflib
import shutil
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "language"))
import net_printed
import net_runs
import net_words

from roboirg.util.processor import processor_family

STORED = Path(__file__).parent / "stored"
MOST_BYTES = 2_000_000
MOST_LINES = 40

PARTS: Mapping[str, Callable[[Path], dict[str, str]]] = {
    "words": net_words.texts,
    "printed": net_printed.results,
    "golden": net_runs.episodes,
    "packs": net_printed.verified_packs,
}
"""What makes the texts of each part, by name, in an empty folder."""
PROCESSOR = "processor"
PORTABLE: Mapping[str, Callable[[str], str]] = {
    "golden": net_runs.without_motion,
    "packs": lambda text: text.partition(";")[0],
}
"""What is comparable of the parts that are simulated, if processors of two families did it."""


def made(part: str) -> dict[str, str]:
    """Return what the code gives now."""
    with tempfile.TemporaryDirectory(prefix="roboirg-net-") as folder:
        found = PARTS[part](Path(folder))
    return found | {PROCESSOR: f"{processor_family()}\n"} if part in PORTABLE else found


def stored(part: str) -> dict[str, str]:
    """Return what is stored."""
    return {path.stem: path.read_text("utf-8") for path in sorted((STORED / part).glob("*.txt"))}


def make(part: str) -> None:
    """Store what the code gives now in place of what was stored."""
    shutil.rmtree(STORED / part, ignore_errors=True)
    (STORED / part).mkdir(parents=True)
    for name, text in made(part).items():
        (STORED / part / f"{name}.txt").write_text(text, encoding="utf-8")
    size = sum(path.stat().st_size for path in STORED.rglob("*.txt"))
    if size > MOST_BYTES:
        sys.exit(f"The net has {size:,} bytes; it must have at most {MOST_BYTES:,}.")


def compare(part: str) -> bool:
    """Print what differs from what is stored, and return whether nothing does."""
    before, now = stored(part), made(part)
    if before.get(PROCESSOR) != now.get(PROCESSOR):
        print(f"{part}: compared without motion, as another kind of processor is at work")
        before, now = (
            {name: PORTABLE[part](text) for name, text in one.items() if name != PROCESSOR}
            for one in (before, now)
        )
    differing = [name for name in sorted({*before, *now}) if before.get(name) != now.get(name)]
    print(f"{part}: {len(now)} texts, {len(differing)} differ")
    for name in differing:
        old, new = (one.get(name, "").splitlines() for one in (before, now))
        changes = list(difflib.unified_diff(old, new, f"stored/{name}", f"now/{name}", "", "", 0))
        print(*(line.rstrip() for line in changes[:MOST_LINES]), sep="\n")
        if len(changes) > MOST_LINES:
            print(f"({len(changes) - MOST_LINES} lines more)")
    return not differing


def main(words: list[str]) -> int:
    """Make or compare parts; returns the exit code."""
    calls: dict[str, Callable[[str], object]] = {"make": make, "compare": compare}
    verb, *parts = words or [""]
    unknown = {*parts} - {*PARTS}
    if verb not in calls or unknown:
        print(__doc__, file=sys.stderr)
        return 2
    return 1 if False in [calls[verb](part) for part in parts or PARTS] else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
