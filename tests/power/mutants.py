"""What the tests find: stored faults, put into a copy of the code one at a time.

    python tests/power/mutants.py FOLDER [--rooms ROOM ...] [--all]

Cosmic Ray 8.7 made the faults of mutants.csv from the code of November 2026; of each room as many
places as it has here were drawn with seed 69, and one fault of each place. 47 whose lines were
rewritten since were drawn again, with seed 72 and outside annotations. Later, those of rewritten
lines were made by hand in the statements that do the same now, and where there are none, with the
same operators at places of the room drawn with seed 73. The last 40 were drawn with seed 91, eight
from each of judging, stats, language, analysis and contract, and each is found by a test next to
its module. A fault is tried with the test that found it last, with its file, then with the tests of
its room; with --all, those that none found are tried, too. FOLDER gets a copy of the working tree
and results.csv, with which a second call goes on; at the end stands a table, and each fault that is
found no longer, or whose lines the code no longer has. Calls for different rooms may run side by
side, each in a folder of its own.
"""

from __future__ import annotations

import argparse
import csv
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
STORED = Path(__file__).with_name("mutants.csv")
TESTS = {
    "judging": ("tests/judging", "tests/tasks"),
    "tasks": ("tests/tasks", "tests/test_splits.py", "tests/judging", "tests/language"),
    "stats": ("tests/stats", "tests/analysis", "tests/api", "tests/scripts"),
    "store": ("tests/records", "tests/runs", "tests/apps/leaderboard"),
    "plan": ("tests/runs", "tests/test_wrong_invocations.py"),
    "language": ("tests/language", "tests/apps/language_lab"),
    "landmarks": ("tests/language",),
    "reader": ("tests/reader", "tests/language", "tests/policies"),
    "delivery": ("tests/test_delivery.py", "tests/language"),
    "analysis": ("tests/analysis",),
    "contract": ("tests/policies", "tests/apps/policy_check", "tests/runs"),
}
"""Where the tests of each room are."""
LIMIT_S = 240.0
"""A fault that keeps the tests busy for so long counts as found."""
GONE = "gone"
"""The result of a fault whose lines are not in the code."""
NOTHING_RUN = (4, 5)
"""What pytest returns for a test that no longer exists, and where none is left."""
FAILED = re.compile(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", re.MULTILINE)


class Mutant(NamedTuple):
    """One fault.

    Attributes:
        number: its name.
        room: the part of the code in which it lies.
        module: its file, from ``src/roboirg`` on.
        line: where its lines stood.
        was: the lines as they are.
        now: the lines with the fault.
        operator: what Cosmic Ray calls the change.
        found_by: the test that found it; empty where none did.
        equivalent: why no test can find it; empty if one could.
    """

    number: str
    room: str
    module: str
    line: str
    was: str
    now: str
    operator: str
    found_by: str
    equivalent: str

    @contextmanager
    def put_into(self, tree: Path) -> Iterator[bool]:
        """Change the file in a copy of the repository, and change it back.

        Yields:
            Whether the code still has its lines; if not, nothing is changed.
        """
        path = tree / "src/roboirg" / self.module
        if not path.exists():
            yield False
            return
        text = path.read_text("utf-8")
        faulty_text = self._put_into_text(text)
        if faulty_text is None:
            yield False
            return
        try:
            write_module(path, faulty_text)
            yield True
        finally:
            write_module(path, text)

    def _put_into_text(self, text: str) -> str | None:
        """Return the text of a module with the fault; None if it has its lines no longer.

        Of several places with these lines it takes the one nearest to where they stood.
        """
        lines = text.splitlines()
        was = self.was.splitlines() or [""]
        stood_at = int(self.line) - 1
        places = [at for at in range(len(lines)) if lines[at : at + len(was)] == was]
        if not places:
            return None
        first = min(places, key=lambda at: abs(at - stood_at))
        after = first + len(was)
        return "\n".join([*lines[:first], self.now, *lines[after:]]) + "\n"


def write_module(path: Path, text: str) -> None:
    """Write the text of a module.

    No compiled module is left: Python would take it for a file of the same size and second.
    """
    shutil.rmtree(path.parent / "__pycache__", ignore_errors=True)
    path.write_text(text, encoding="utf-8")


def first_failure(tree: Path, *tests: str) -> str:
    """Return the first test that fails in a copy of the repository, or an empty text."""
    options = ("-x", "-q", "-p", "no:cacheprovider", "--timeout", "100", "-m", "not slow")
    with tempfile.TemporaryFile("w+") as printed:
        process = subprocess.Popen(
            [sys.executable, "-m", "pytest", *options, *tests],
            cwd=tree,
            env={**os.environ, "PYTHONPATH": str(tree / "src")},
            stdout=printed,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            code = process.wait(LIMIT_S)
        except subprocess.TimeoutExpired:
            return "timeout"
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        if code in (0, *NOTHING_RUN):
            return ""
        printed.seek(0)
        found = FAILED.search(printed.read())
    return found[1] if found else "collection"


def found_by(mutant: Mutant, tree: Path) -> str:
    """Return a test that finds a fault, or an empty text."""
    with mutant.put_into(tree) as fits:
        if not fits:
            return GONE
        tries = [TESTS[mutant.room]]
        file = mutant.found_by.partition("::")[0]
        if (tree / file).is_file():
            tries = [(mutant.found_by,), (file,), *tries]
        for tests in tries:
            failure = first_failure(tree, *tests)
            if failure:
                return failure
        return ""


def copy(tree: Path) -> Path:
    """Copy the working tree to a folder, unless an earlier call has; return the folder."""
    if tree.exists():
        return tree
    list_files = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
    names = subprocess.check_output(list_files, cwd=ROOT, text=True).split("\0")
    for name in names:
        source = ROOT / name
        if source.is_file():  # what was deleted is listed, too
            target = tree / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, target)
    return tree


def read(path: Path) -> list[list[str]]:
    """Return the rows of a CSV file, without its header."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))[1:]


def table(mutants: list[Mutant], results: dict[str, str]) -> str:
    """Return a line for each room, and one for each fault that is found no longer."""
    lines = ["room       faults  equivalent  found before  found now"]
    tried = [mutant for mutant in mutants if mutant.number in results]
    for room in TESTS:
        of_room = [mutant for mutant in tried if mutant.room == room]
        lines.append(_line_of_table(room, of_room, results))
    lines.append(_line_of_table("all", tried, results))
    for mutant in tried:
        result = results[mutant.number]
        if mutant.found_by and result in ("", GONE):
            place = f"{mutant.module}:{mutant.line}"
            lines.append(f"{result or 'lost'}: {mutant.number} {place} {mutant.now.strip()}")
    return "\n".join(lines)


def _line_of_table(name: str, mutants: list[Mutant], results: dict[str, str]) -> str:
    """Return how many of some faults no test can find, and how many were and are found."""
    num_equivalent = sum(bool(mutant.equivalent) for mutant in mutants)
    num_before = sum(bool(mutant.found_by) for mutant in mutants)
    num_now = sum(results[mutant.number] not in ("", GONE) for mutant in mutants)
    return f"{name:9} {len(mutants):7} {num_equivalent:11} {num_before:13} {num_now:10}"


def main() -> None:
    """Try the faults that no earlier call has tried."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rooms", nargs="+", choices=TESTS, default=list(TESTS))
    parser.add_argument("--all", action="store_true")
    options = parser.parse_args()
    mutants = [Mutant(*row) for row in read(STORED)]
    tree = copy(options.folder.absolute() / "copy")
    stored = options.folder / "results.csv"
    if not stored.exists():
        stored.write_text("number,found_by\n", encoding="utf-8")
    results = dict(read(stored))
    for mutant in mutants:
        if mutant.room not in options.rooms or mutant.number in results:
            continue
        is_tried = mutant.found_by or (options.all and not mutant.equivalent)
        if is_tried:
            results[mutant.number] = found_by(mutant, tree)
            with stored.open("a", encoding="utf-8", newline="") as file:
                csv.writer(file).writerow((mutant.number, results[mutant.number]))
    sys.stdout.write(table(mutants, results) + "\n")


if __name__ == "__main__":
    main()
