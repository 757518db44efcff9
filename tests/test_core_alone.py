"""Every command in an environment with the core alone: it works, or names the extra it needs."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import typer.main

from roboirg.cli.app import app
from roboirg.cli.missing_extras import _MODULES, describe_missing
from roboirg.evaluation.rollout_result import RolloutResult, make_record
from roboirg.records.record import Job
from roboirg.records.store import RecordStore

WALK = """
import io, json, sys, traceback
from contextlib import redirect_stderr, redirect_stdout

class Without:
    def __init__(self, finder):
        self.finder = finder
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] not in refused:
            return self.finder.find_spec(name, path, target)

refused, commands = set(json.loads(sys.argv[1])), json.loads(sys.argv[2])
sys.meta_path[:] = map(Without, sys.meta_path)
from roboirg.cli import app
found = {}
for name, words in commands.items():
    out, err, code = io.StringIO(), io.StringIO(), 0
    sys.argv = ["roboirg", *name.split(), *words]
    with redirect_stdout(out), redirect_stderr(err):
        try:
            app.main()
        except SystemExit as left:
            code = left.code or 0
        except BaseException:
            code = traceback.format_exc()
    found[name] = [code, out.getvalue(), err.getvalue()]
sys.__stdout__.write(json.dumps(found))
"""

NEEDS = {
    "bench": "sim", "run": "sim", "show": "sim", "demo": "report", "report": "report",
    "view": "report", "figures": "report", "compare": "report", "serve": "remote",
    "export records": "export", "real run": "sim", "real score": "report",
    "language shortcuts": "report", "real figure": "report",
}  # fmt: skip
"""The extra of each command that cannot do its work without one; all others work."""


def words_of(folder, run):
    """Return words for each command with which it does its work where all is installed."""
    return {
        "bench": ["--rounds", "1"],
        "run": ["--policy", "random", "--tasks", "PickXtimes", "--episodes", "1", "--workers", "0",
                "--settings", "explicit", "--out", f"{folder}/out"],
        "merge": [run, "--out", f"{folder}/merged"],
        "report": [run],
        "view": [run],
        "tables": [run],
        "figures": [run, "--out", f"{folder}/figures"],
        "compare": [f"{run}:random", f"{run}:oracle"],
        "serve": ["random"],
        "check-policy": ["random"],
        "demo": ["--out", f"{folder}/demo"],
        "doctor": [],
        "tasks": [],
        "build-splits": ["--tasks", "PickXtimes", "--split", "val", "--workers", "0"],
        "show": ["PickXtimes", "0", "--out", f"{folder}/sheet.png"],
        "instruct": ["PickXtimes", "0"],
        "language stats": ["--tasks", "PickXtimes", "--split", "val"],
        "language validate": ["--tasks", "PickXtimes", "--split", "val", "--workers", "0"],
        "language card": ["--help"],
        "language shortcuts": ["--tasks", "PickXtimes", "--split", "val", "--learned"],
        "export instructions": ["--tasks", "PickXtimes", "--split", "val",
                                "--out", f"{folder}/words.jsonl"],
        "export episodes": ["--tasks", "PickXtimes", "--split", "val",
                            "--out", f"{folder}/episodes.jsonl"],
        "export records": [run, "--out", f"{folder}/records.parquet"],
        "real plan": ["--policy", "random", "--tasks", "PutInBox", "--trials", "1", "--no-sheet",
                      "--demonstrations", "1", "--out", f"{folder}/study"],
        "real run": [f"{folder}/study"],
        "real score": [f"{folder}/study"],
        "real figure": [run, "--out", f"{folder}/figures"],
        "wordings import-robomme": ["--help"],
    }  # fmt: skip


def all_commands():
    def walk(command, name):
        for word, inner in getattr(command, "commands", {}).items():
            yield from walk(inner, [*name, word])
        if not hasattr(command, "commands"):
            yield " ".join(name)

    return set(walk(typer.main.get_command(app), []))


@pytest.fixture(scope="module")
def walked(tmp_path_factory):
    folder = tmp_path_factory.mktemp("core")
    with RecordStore(folder / "run") as store:
        for number in range(6):
            job = Job(policy="random", task="PickXtimes", split="test", episode=number // 2,
                      setting="direct")  # fmt: skip
            result = RolloutResult("failure", cause="timeout", steps=7)
            if number % 2:
                job = job.model_copy(update={"policy": "oracle"})
                result = RolloutResult("success", cause=None, steps=7)
            store.append(make_record(job, result, started_at="now"))
    words = words_of(str(folder), str(folder / "run"))
    assert set(words) == all_commands()
    refused = sorted({module for modules in _MODULES.values() for module in modules})
    done = subprocess.run(
        [sys.executable, "-c", WALK, json.dumps(refused), json.dumps(words)],
        check=True, capture_output=True, text=True, cwd=folder,
    )  # fmt: skip
    return json.loads(done.stdout)


@pytest.mark.parametrize("command", sorted(all_commands()))
def test_a_command_works_or_names_its_extra(walked, command):
    code, out, err = walked[command]
    if command in NEEDS:
        assert (code, out) == (2, ""), walked[command]
        assert err.startswith("roboirg: ")
        assert len(err.splitlines()) == 1
        assert f"'roboirgbench[{NEEDS[command]}]'" in err, err
    else:
        assert code == (1 if command == "doctor" else 0), walked[command]


def test_the_modules_of_every_extra_are_known():
    extras = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
    assert set(_MODULES) | {"world", "dev"} == set(extras["optional-dependencies"])
    assert describe_missing(ModuleNotFoundError("", name="numpyy")) is None
