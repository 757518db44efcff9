"""Each application may be left out: its commands and kinds of policies go, and nothing else."""

import json
import shutil

import layout
import pytest
from python_process import print_of_python
from selection import slow_but

APPLICATIONS = sorted(path.parent.name for path in (layout.PACKAGE / "apps").glob("*/__init__.py"))

PRINT_COMMANDS = """
import importlib.metadata, json, os, sys
hidden_package = os.environ.get("HIDDEN_PACKAGE")
all_entry_points = importlib.metadata.entry_points
def entry_points(**wanted):
    found = all_entry_points(**wanted)
    if hidden_package is None:
        return found
    return [entry for entry in found if hidden_package not in entry.value]
importlib.metadata.entry_points = entry_points
import typer
from roboirg.core.errors import RoboIRGError
from roboirg.main import app
from roboirg.policies.by_name.policy_kinds import find_kind

def names_in(command, prefix=""):
    found = []
    for name, inner in getattr(command, "commands", {}).items():
        found += [f"{prefix}{name}", *names_in(inner, f"{prefix}{name} ")]
    return found

kinds = []
for entry in entry_points(group="roboirg.policy_kinds"):
    try:
        find_kind(entry.name)
        kinds.append(entry.name)
    except RoboIRGError as error:
        assert entry.value in str(error), error
print(json.dumps([names_in(typer.main.get_command(app)), kinds]))
"""
"""A program that prints its commands and the kinds of policies that come from entry points.

Entry points of the package that the variable HIDDEN_PACKAGE names are left out.
"""

RUN_COMMAND = "\nfrom roboirg.main import main; sys.argv[0] = 'roboirg'; main()"
"""Behind `PRINT_COMMANDS`: the command of the process's arguments."""


def start(*words, program=PRINT_COMMANDS, **variables):
    """Run a program in a process of its own, as it replaces a function of Python's.

    Returns:
        its commands, the kinds of its policies, and what it printed after them.
    """
    listed, _, printed = print_of_python("-c", program, *words, **variables).partition("\n")
    commands, kinds = json.loads(listed)
    return set(commands), set(kinds), printed


@pytest.fixture(scope="module")
def all_commands():
    """The names of the commands of the whole program."""
    commands, kinds, _ = start()
    assert kinds == {"learned", "trained"}
    return commands


def test_without_the_package_that_learns_only_its_commands_and_kinds_are_gone(all_commands):
    """The package roboirg_learn, which is installed next to the benchmark, is hidden from the
    program. It alone has the command `learn` with its three commands, and the only two kinds of
    policies that come from outside.
    """
    commands, kinds, _ = start(HIDDEN_PACKAGE="roboirg_learn")

    learns = {"learn", "learn listener", "learn policy", "learn reader"}
    assert all_commands - commands == learns
    assert kinds == set()


def test_the_program_has_eight_applications():
    """They are folders, each of which is left out in turn below."""
    assert APPLICATIONS == [
        "demonstrations", "grounding", "integrations", "language_lab", "leaderboard",
        "policy_check", "real", "show",
    ]  # fmt: skip


@pytest.mark.sim
@pytest.mark.parametrize(
    ("application", "lost"),
    slow_but(
        [("show", {"show"})],
        [
            ("demonstrations", {"export demonstrations", "replay"}),
            ("grounding", {"export grounding", "score", "score grounding"}),
            ("integrations", set()),
            (
                "language_lab",
                {
                    "export instructions", "language", "language check-scenarios",
                    "language import-robomme", "language sample", "language shortcuts",
                    "language stats",
                },
            ),
            (
                "leaderboard",
                {
                    "export hub-results", "leaderboard", "leaderboard pack",
                    "leaderboard verify",
                },
            ),
            ("policy_check", {"check-policy"}),
            ("real", {"real", "real plan", "real score"}),
            ("show", {"show"}),
        ],
    ),
)  # fmt: skip
def test_without_the_folder_of_an_application_the_program_runs_and_lacks_only_its_commands(
    application, lost, all_commands, tmp_path
):
    """A copy of the program without the application's folder lists its commands and the kinds of
    policies that come from elsewhere, then plays five steps of an episode, whose table names the
    task. It lacks the commands that only this application adds, and nothing else.
    """
    shutil.copytree(layout.PACKAGE, tmp_path / "roboirg")
    shutil.rmtree(tmp_path / "roboirg" / "apps" / application)
    run = "run --policy random --tasks StopCube --settings explicit --episodes 1 --max-steps 5"

    commands, kinds, printed = start(
        *run.split(), "--workers", "0", "--out", str(tmp_path / "run"),
        program=PRINT_COMMANDS + RUN_COMMAND, PYTHONPATH=str(tmp_path),
    )  # fmt: skip

    assert all_commands - commands == lost
    assert kinds == {"learned", "trained"}
    assert "StopCube" in printed
