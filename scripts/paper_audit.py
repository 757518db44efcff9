"""Check the program against the paper, item by item; exits with 1 if an item fails.

python scripts/paper_audit.py [WORD of the items to check]

What cannot be known stands in docs/comparability.md.
To add items, write a function with `@item(...)`: it raises `AssertionError` where the program
differs, and returns what it found.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import write_published_figures as figures
import yaml

from roboirg.apps.real.study.study_plan import DEFAULT_DEMONSTRATIONS, DEFAULT_TRIALS
from roboirg.core.errors import InvalidValueError
from roboirg.policies import make_policy
from roboirg.policies.planners.systems import all_systems, find_system
from roboirg.tasks import LEFT_OUT, every_task, find_tasks

ROOT = Path(__file__).parents[1]

Check = Callable[[], str]


class Item(NamedTuple):
    """One thing that the paper says, or that its figures say of it.

    Attributes:
        name: short and unique.
        claim: what should be so.
        check: returns what was found; raises AssertionError where it is not so.
    """

    name: str
    claim: str
    check: Check


ITEMS: list[Item] = []


def item(name: str, claim: str) -> Callable[[Check], Check]:
    """Add a check to the items."""

    def add(check: Check) -> Check:
        ITEMS.append(Item(name, claim, check))
        return check

    return add


def read(name: str) -> str:
    """Return the text of a file of the repository."""
    return " ".join((ROOT / name).read_text(encoding="utf-8").split())


def same(found: object, wanted: object) -> str:
    """Return what was found; raises AssertionError if it is not what is wanted."""
    if found != wanted:
        raise AssertionError(f"{found} instead of {wanted}")
    return str(found)


def says(name: str, *parts: str) -> str:
    """Return the name of a file that has all of some texts."""
    text = read(name)
    for part in parts:
        if part not in text:
            raise AssertionError(f"{name} lacks {part!r}")
    return name


# Facts


@item("planner", "GroundSG-Gemini plans with Gemini 3.1 Pro")
def _() -> str:
    planner = find_system("GroundSG-Gemini", {}).planner or {}
    return same(planner["model"]["model"], "gemini-3.1-pro-preview")


@item("systems", "the paper has six systems; GroundSG-oracle is RoboMME's")
def _() -> str:
    paper = {"pi0.5", "TTT-Expert", "FrameS-Modul", "GroundSG-QwenVL", "GroundSG-Gemini", "MemER"}
    same(set(all_systems()), paper | {"GroundSG-oracle"})
    for page in ("README.md", "docs/policies.md", "docs/planners.md", "CHANGELOG.md"):
        if "seven systems" in read(page):
            raise AssertionError(f"{page} speaks of seven systems")
    return says("docs/planners.md", "GroundSG with the oracle is RoboMME's.")


@item("left-out", "five tasks of RoboMME are left out, because they have nothing to refer to")
def _() -> str:
    names = {"PickHighlight", "MoveCube", "InsertPeg", "PatternLock", "RouteStick"}
    same(set(LEFT_OUT), names)
    same(names & every_task().keys(), set())
    for name in names:
        try:
            find_tasks([name])
        except InvalidValueError as error:
            if "no variable to refer to" not in str(error):
                raise AssertionError(f"asked for {name}: {error}") from error
    return says("docs/tasks.md", *names)


PAPER_AUTHORS = [
    "Akelijiang, Aernaer",
    "Li, Jiannan",
    "Chen, Zhineng",
    "Chen, Jingjing",
    "Zhu, Bin",
]


@item("cite", "paper and RoboMME with their authors, and the project page, are cited everywhere")
def _() -> str:
    cff = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    paper = cff["preferred-citation"]
    robomme = cff["references"][0]
    authors = [f"{author['family-names']}, {author['given-names']}" for author in paper["authors"]]
    same(authors, PAPER_AUTHORS)
    says("README.md", "Aernaer Akelijiang, Jiannan Li")
    same([len(robomme["authors"]), robomme["authors"][0]["family-names"]], [9, "Dai"])
    same(paper["identifiers"][0]["value"], "arXiv:2609.34384")
    same(robomme["identifiers"][0]["value"], "arXiv:2603.04639")
    project = "aernar.github.io/RoboIRGBench/"
    return says("README.md", "arXiv:2609.34384", "arxiv.org/abs/2603.04639", project)


@item("independent", "the first sentence says that this is an independent implementation")
def _() -> str:
    before = read("README.md").partition("An independent implementation")[0]
    same(before, "# RoboIRGBench *")
    return says("docs/comparability.md", "this is an independent implementation")


@item("introductions", "no page says what the paper's unpublished introductions name")
def _() -> str:
    pages = ["README.md", *(f"docs/{path.name}" for path in ROOT.glob("docs/*.md"))]
    for page in pages:
        if re.search(r"paper's (introductions|instructions) (name|say|hold)", read(page)):
            raise AssertionError(f"{page} says it")
    return f"{len(pages)} pages"


@item("horizon", "pi0.5 and FrameS-Modul can execute 20 actions, as in the real study")
def _() -> str:
    for name in ("pi0.5", "FrameS-Modul"):
        policy: Any = make_policy(f"system:{name}?policy.execute=20", 0)
        same(policy.options.execute, 20)
    return says("docs/real-robot.md", "--open-loop-horizon=20", "--policy.n_action_steps=20")


@item("real-study", "the page has the training, cameras, 30 pictures a second, GELLO and recording")
def _() -> str:
    training = ("5,000 steps", "5e-5", "batches of 48", "300 warm-up steps")
    recording = ("RealSense", "435IF", "GELLO", "30 pictures per second")
    return says("docs/real-robot.md", *training, *recording)


@item("demonstrations", "50 explicit demonstrations a task and 10 trials a cell are the defaults")
def _() -> str:
    return same((DEFAULT_DEMONSTRATIONS, DEFAULT_TRIALS), (50, 10))


# What the published figures support


@item("figures-page", "the page of the figures is what the script computes")
def _() -> str:
    if figures.PAGE.read_text(encoding="utf-8") != figures.page():
        raise AssertionError("run: python scripts/write_published_figures.py")
    return str(figures.PAGE.relative_to(ROOT))


def main(word: str = "") -> int:
    """Print each item with its verdict; returns the exit code."""
    failed = 0
    for name, claim, check in ITEMS:
        if word not in name:
            continue
        verdict = "holds"
        try:
            found = check()
        except AssertionError as error:
            verdict = "FAILS"
            found = str(error)
            failed += 1
        print(f"{verdict:6} {name}: {claim}\n       {found}")
    print(f"{failed} of {len(ITEMS)} items fail")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:2]))
