"""Check and measure rendering on this machine, and write what is found as JSON after each check.

The package's state before and after are trees of the kit, as is the state after without culling.
Each check is a process with a time limit. `check` of the kit calls this with its variables set.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import typer

TREES = ("before", "after", "unculled")
TEXTS = ("output", "errors")
LIMIT_S = 150.0
ROUNDS = 3


class Checks:
    """Checks of a kit, and their results so far."""

    def __init__(self, kit: Path, out: Path) -> None:
        self._kit, self._out = kit, out
        self.results: dict[str, Any] = {}

    def measure(self, name: str, tree: str, *words: str) -> dict[str, Any]:
        """Run `measure.py` with a tree of the package, and keep what it prints."""
        script = self._kit / "trees" / "after" / "scripts" / "gpu" / "measure.py"
        found = self.run(name, tree, str(script), *words)
        lines = found.pop("output").splitlines()
        return self.keep(name, found | (json.loads(lines[-1]) if found["code"] == 0 else {}))

    def run(self, name: str, tree: str, *words: str) -> dict[str, Any]:
        """Run Python with a tree of the package; return its code, its output and the seconds."""
        print(f"{name} ...", flush=True)
        path = os.pathsep.join([str(self._kit / "trees" / tree / "src"), os.environ["PYTHONPATH"]])
        start = time.perf_counter()
        try:
            done = subprocess.run(  # noqa: S603 - our own command
                [sys.executable, *words],
                check=False,
                capture_output=True,
                text=True,
                timeout=LIMIT_S,
                env=os.environ | {"PYTHONPATH": path},
            )
            found = {"code": done.returncode, "output": done.stdout, "errors": done.stderr[-600:]}
        except subprocess.TimeoutExpired:
            found = {"code": None, "output": "", "errors": f"no end within {LIMIT_S:g} s"}
        return found | {"seconds": round(time.perf_counter() - start, 1)}

    def keep(self, name: str, found: dict[str, Any]) -> dict[str, Any]:
        """Store a result, so that a kill loses none."""
        self.results[name] = found
        self._out.write_text(json.dumps(self.results, indent=1))
        return found


def main(kit: Path, out: Path, workers: str = "8,16") -> None:
    """Run all checks, and print a line for each figure.

    Args:
        kit: folder that `install` made.
        out: JSON file for the results.
        workers: numbers of worker processes.
    """
    checks = Checks(kit, out)
    checks.keep("doctor", checks.run("doctor", "after", "-m", "roboirg", "doctor"))
    check_pictures(checks, kit)
    check_steps(checks)
    for count in workers.split(","):
        for cameras, chunk, trees in ((2, 1, TREES), (1, 1, TREES[1:]), (1, 16, TREES[1:2])):
            for tree in trees:
                name = f"{count} workers, {cameras} of 2 cameras, chunks of {chunk}, {tree}"
                checks.measure(name, tree, "workers", count, str(cameras), str(chunk))
    for name, found in checks.results.items():
        failed = found.get("code", 0) != 0  # None at its time limit
        shown = {key: value for key, value in found.items() if failed or key not in TEXTS}
        print(f"{name}: {json.dumps(shown)}")


def check_pictures(checks: Checks, kit: Path) -> None:
    """Compare pictures and motion with those of the packing machine, and of the trees."""
    for tree in TREES:
        checks.measure(f"draw, {tree}", tree, "draw", str(kit / f"{tree}.npz"))
    for first, second in (("expected", "after"), ("before", "after"), ("after", "unculled")):
        name = f"pictures of {first} and {second}"
        files = (f"{kit}/{first}.npz", f"{kit}/{second}.npz")
        checks.measure(name, "after", "compare", *files)


def check_steps(checks: Checks) -> None:
    """Time steps of the trees in turn, and keep medians and the ratio to the state before."""
    times: dict[str, list[float]] = {tree: [] for tree in TREES}
    for number in range(ROUNDS):
        for tree in TREES[:: -1 if number % 2 else 1]:
            found = checks.measure(f"step, {tree}, round {number + 1}", tree, "step")
            times[tree].append(found.get("whole", float("nan")))
    medians = {tree: statistics.median(seconds) for tree, seconds in times.items()}
    ratios = {f"before / {tree}": medians["before"] / medians[tree] for tree in TREES[1:]}
    checks.keep("step", {**medians, **ratios})


if __name__ == "__main__":
    typer.run(main)
