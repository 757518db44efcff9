"""Each application may be left out: its commands and kinds of policies go, and nothing else."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import layout
import pytest
from selection import slow_but

from roboirg.util.discovery import entry_names

APPLICATIONS = sorted(path.parent.name for path in (layout.PACKAGE / "apps").glob("*/__init__.py"))

KINDS_OF = {
    "demonstrations": {"recorded"},
    "learning": {"learned", "trained"},
}

WALK = """
import json, sys
from importlib.metadata import entry_points
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


def without(application: str | None, folder: Path) -> dict[str, str]:
    """Return the variables of a process that imports a copy of the package."""
    shutil.copytree(layout.PACKAGE, folder / "roboirg")
    if application is not None:
        shutil.rmtree(folder / "roboirg" / "apps" / application)
    return {**os.environ, "PYTHONPATH": str(folder)}


def commands_and_kinds(variables: dict[str, str]) -> tuple[dict[str, list[str]], set[str]]:
    found = subprocess.run(
        [sys.executable, "-c", WALK], capture_output=True, text=True, check=True, env=variables
    )
    commands, kinds = json.loads(found.stdout)
    return commands, set(kinds)


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, list[str]], set[str]]:
    return commands_and_kinds(without(None, tmp_path_factory.mktemp("whole")))


def test_every_kind_of_policy_and_every_application_is_there(everything):
    commands, kinds = everything
    assert kinds == set(entry_names("roboirg.policy_kinds")) == {
        "learned", "recorded", "trained",
    }  # fmt: skip
    assert len(APPLICATIONS) >= 8
    assert {
        "run",
        "tables",
        "leaderboard verify",
        "show",
    } <= commands.keys()


@pytest.mark.sim
@pytest.mark.parametrize("application", slow_but(["leaderboard", "learning"], APPLICATIONS))
def test_without_an_application_the_rest_works(application, everything, tmp_path):
    variables = without(application, tmp_path / "src")
    commands, kinds = commands_and_kinds(variables)
    own = f"roboirg.apps.{application}."
    lost = {
        name
        for name, modules in everything[0].items()
        if all(one.startswith(own) for one in modules)
    }
    assert everything[0].keys() - commands.keys() == lost
    assert bool(lost) == (layout.PACKAGE / "apps" / application / "commands.py").exists()
    assert everything[1] - kinds == KINDS_OF.get(application, set())
    run = [
        sys.executable, "-m", "roboirg", "run", "--policy", "random", "--tasks", "StopCube",
        "--settings", "explicit", "--episodes", "1", "--max-steps", "5", "--workers", "0",
        "--out", str(tmp_path / "run"),
    ]  # fmt: skip
    played = subprocess.run(run, capture_output=True, text=True, check=False, env=variables)
    assert played.returncode == 0, played.stderr
    assert "StopCube" in played.stdout
