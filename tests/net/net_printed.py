"""What commands print of the pack of scripted policies, of words and of scenes; if packs hold."""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from html import unescape
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKS = {path.name.partition(".")[0]: path for path in sorted((ROOT / "results").glob("*.zip"))}
SAMPLE = ("--sample", "1%", "--sample-seed", "1")

SCRIPTED = "scripted"
MARKDOWN, CSV = ("--format", "markdown"), ("--format", "csv")
COMMANDS: dict[str, tuple[str, ...]] = {
    "tasks": ("tasks",),
    "words-of-a-scene": ("show", "VideoUnmask", "3", "--words", "--settings", "all"),
    "language-stats": ("language", "stats", "--split", "val"),
    "shortcuts": (
        *("language", "shortcuts", "--split", "val", "--by", "pattern"),
        *("--settings", "direct,reasoning,contextual,spatial,direct-rival,grounded"),
    ),
    "published": ("tables", "--published", *MARKDOWN),
    "published-latex": ("tables", "--published", "--which", "main", "--format", "latex"),
    "main-terminal": ("tables", SCRIPTED, "--which", "main", "--published"),
    "main-latex": ("tables", SCRIPTED, "--which", "main", "--format", "latex"),
    "main-floors": ("tables", SCRIPTED, "--which", "main", "--floors", "all", *MARKDOWN),
    "main-breakdowns": ("tables", SCRIPTED, "--by", "all", *CSV),
    "main-compared": (
        *("compare", f"{SCRIPTED}:listener", f"{SCRIPTED}:forgetful", "--by", "all"),
    ),
    "planner-subgoals": ("tables", SCRIPTED, "--which", "subgoals", *MARKDOWN),
    "scripted-tables": ("tables", SCRIPTED, *CSV),
    "scripted-failures": ("tables", SCRIPTED, "--which", "failures", *MARKDOWN),
    "scripted-heard": ("tables", SCRIPTED, "--which", "heard", *MARKDOWN),
    "scripted-arms": ("tables", SCRIPTED, "--which", "arms", *MARKDOWN),
    "scripted-report": ("report", SCRIPTED),
}
FILES: dict[str, tuple[str, ...]] = {
    "episodes.jsonl": ("export", "episodes", "--split", "val", "--out", "episodes.jsonl"),
    "instructions.jsonl": (
        *("export", "instructions", "--split", "val", "--out", "instructions.jsonl"),
        *("--settings", "all,direct-rival,grounded"),
    ),
}
"""Commands whose file is kept as a hash."""


def results(folder: Path) -> dict[str, str]:
    """Return what each command prints, what the page of the pack says, and hashes of files."""
    with zipfile.ZipFile(PACKS[SCRIPTED]) as archive:
        archive.extractall(folder / SCRIPTED)
    found = {name: printed(folder, *words) for name, words in COMMANDS.items()}
    page = folder / SCRIPTED / "report.html"
    found["scripted-page"] = _page_text(page.read_text("utf-8"))
    found["files"] = "".join(sorted(_file_hashes(folder)))
    return found


def verified_packs(folder: Path) -> dict[str, str]:
    """Return what verifying a sample of each pack prints."""
    verify = ("leaderboard", "verify")
    return {name: printed(folder, *verify, str(pack), *SAMPLE) for name, pack in PACKS.items()}


def printed(folder: Path, *words: str) -> str:
    """Return what a command prints in a wide terminal, and its exit code if it fails."""
    environment = os.environ | {"COLUMNS": "200", "NO_COLOR": "1", "PYTHONHASHSEED": "0"}
    command = [str(Path(sys.executable).with_name("roboirg")), *words]
    done = subprocess.run(
        command, check=False, cwd=folder, env=environment, capture_output=True, text=True
    )
    if done.returncode:
        return f"{done.stdout}{done.stderr}exit code {done.returncode}\n"
    lines = [line.rstrip() for line in done.stdout.splitlines()]
    return "\n".join([*lines, ""])


def _file_hashes(folder: Path) -> Iterator[str]:
    for name, words in FILES.items():
        printed(folder, *words)
        yield f"{name} {hashlib.sha256((folder / name).read_bytes()).hexdigest()[:16]}\n"


def _page_text(page: str) -> str:
    """Return a page's words, a line for each element; neither code nor data."""
    body = re.sub(r"<(script|style)\b.*?</\1>", "", page, flags=re.DOTALL)
    words = [" ".join(unescape(part).split()) for part in re.split(r"<[^>]*>", body)]
    return "\n".join([*filter(None, words), ""])
