"""Each application may be left out: its commands and kinds of policies go, and nothing else."""

import json
import os
import shutil
import subprocess
import sys

import layout
import pytest
from selection import slow_but

APPLICATIONS = sorted(path.parent.name for path in (layout.PACKAGE / "apps").glob("*/__init__.py"))

RUN_COMMAND = "\nfrom roboirg.main import main; sys.argv[0] = 'roboirg'; main()"
"""Behind `PRINT_COMMANDS`: the command of the process's arguments."""

PRINT_COMMANDS = """
left_out = ""
import importlib.metadata, json, sys
all_entry_points = importlib.metadata.entry_points
def entry_points(**wanted):
    found = all_entry_points(**wanted)
    return [one for one in found if not left_out or left_out not in one.value]
importlib.metadata.entry_points = entry_points
import typer
from roboirg.core.errors import RoboIRGError
from roboirg.main import app
from roboirg.policies.by_name.policy_kinds import find_kind

def applications(command, prefix=""):
    # The modules that add each command; of a group, those of its commands.
    found = {}
    for name, one in getattr(command, "commands", {}).items():
        inner = applications(one, f"{prefix}{name} ")
        own = {one.callback.__module__} if not inner else set().union(*inner.values())
        found |= inner | {f"{prefix}{name}": own}
    return found

kinds = []
for entry in entry_points(group="roboirg.policy_kinds"):
    try:
        find_kind(entry.name)
        kinds.append(entry.name)
    except RoboIRGError as error:
        assert entry.value in str(error), error
commands = applications(typer.main.get_command(app))
print(json.dumps([{name: sorted(own) for name, own in commands.items()}, sorted(kinds)]))
"""


@pytest.fixture(scope="module")
def all_commands_and_kinds():
    """The commands, with the modules that add them, and the kinds of policies of all applications.

    Listed by a process of its own, as the program replaces a function of Python's.
    """
    walked = subprocess.run([sys.executable, "-c", PRINT_COMMANDS], capture_output=True, check=True)
    commands, kinds = json.loads(walked.stdout)
    return commands, set(kinds)


def test_without_the_package_that_learns_only_its_commands_and_kinds_are_gone(
    all_commands_and_kinds,
):
    """The package roboirg_learn is hidden from a process, which prints what is left.

    `PRINT_COMMANDS` leaves out entry points of the package that its variable `left_out` names; that
    line is replaced here. Only the package's four commands and two kinds of policies are lost; no
    other kind comes from an entry point, so none is left.
    """
    all_commands, all_kinds = all_commands_and_kinds
    program = PRINT_COMMANDS.replace('left_out = ""', "left_out = 'roboirg_learn'", 1)

    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)

    commands, kinds = json.loads(done.stdout)
    assert all_commands.keys() - commands.keys() == {
        "learn", "learn listener", "learn policy", "learn reader",
    }  # fmt: skip
    assert (all_kinds, kinds) == ({"learned", "trained"}, [])


@pytest.mark.sim
@pytest.mark.parametrize("application", slow_but(["show"], APPLICATIONS))
def test_without_the_folder_of_an_application_the_program_runs_and_lacks_only_its_commands(
    application, all_commands_and_kinds, tmp_path
):
    """A copy of the program without an application's folder prints its commands and plays.

    What may be lost are the commands that only this application adds, and it has some if and only
    if it has a file of commands; all kinds of policies are still there.
    """
    all_commands, all_kinds = all_commands_and_kinds
    shutil.copytree(layout.PACKAGE, tmp_path / "roboirg")
    shutil.rmtree(tmp_path / "roboirg" / "apps" / application)
    words = "run --policy random --tasks StopCube --settings explicit --episodes 1"
    words += f" --max-steps 5 --workers 0 --out {tmp_path / 'run'}"

    played = subprocess.run(
        [sys.executable, "-c", PRINT_COMMANDS + RUN_COMMAND, *words.split()],
        capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
    )  # fmt: skip

    assert played.returncode == 0, played.stderr
    walked, _, shown = played.stdout.partition("\n")
    assert "StopCube" in shown

    lost = set()
    for name, modules in all_commands.items():
        if all(module.startswith(f"roboirg.apps.{application}.") for module in modules):
            lost.add(name)
    commands, kinds = json.loads(walked)
    assert all_commands.keys() - commands.keys() == lost
    assert bool(lost) == (layout.PACKAGE / "apps" / application / "commands.py").exists()
    assert all_kinds == set(kinds)
