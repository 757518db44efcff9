"""Every command in an environment with the core alone: it works, or names the extra it needs."""

import json
import tomllib
from pathlib import Path

import pytest
from all_commands import all_commands, make_run, words_of
from python_process import print_of_python

from roboirg.main import _MODULES, describe_missing

RUN_COMMANDS_WITHOUT_EXTRAS = """
import importlib.metadata, io, json, sys, traceback
from contextlib import redirect_stderr, redirect_stdout

class Without:
    def __init__(self, finder):
        self.finder = finder
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] not in refused:
            return self.finder.find_spec(name, path, target)

# Without libraries there are no distributions, of which the entry points of roboirg-learn come.
points = importlib.metadata.entry_points()
importlib.metadata.entry_points = lambda **wanted: points.select(**wanted)
refused, commands = set(json.loads(sys.argv[1])), json.loads(sys.argv[2])
sys.meta_path[:] = map(Without, sys.meta_path)
from roboirg import main
found = {}
for name, words in commands.items():
    out, err, code = io.StringIO(), io.StringIO(), 0
    sys.argv = ["roboirg", *name.split(), *words]
    with redirect_stdout(out), redirect_stderr(err):
        try:
            main.main()
        except SystemExit as left:
            code = left.code or 0
        except BaseException:
            code = traceback.format_exc()
    found[name] = [code, out.getvalue(), err.getvalue()]
sys.__stdout__.write(json.dumps(found))
"""

EXTRA_OF_COMMAND = {
    "run": "sim", "show": "sim", "report": "report",
    "figures": "report", "compare": "report", "serve": "remote",
    "real score": "pages",
    "export demonstrations": "sim", "export grounding": "sim",
    "language shortcuts": "report",
}  # fmt: skip
"""The extra of each command that cannot do its work without one; all others work."""


@pytest.fixture(scope="module")
def results_of_commands(tmp_path_factory):
    folder = tmp_path_factory.mktemp("core")
    words = words_of(str(folder), str(make_run(folder / "run")))
    refused = sorted({module for modules in _MODULES.values() for module in modules})
    printed = print_of_python(
        "-c", RUN_COMMANDS_WITHOUT_EXTRAS, json.dumps(refused), json.dumps(words),
        cwd=folder, ROBOIRG_WORKERS="0",
    )  # fmt: skip
    return json.loads(printed)


@pytest.mark.parametrize("command", EXTRA_OF_COMMAND)
def test_without_its_extra_a_command_names_it(results_of_commands, command):
    """An extra is a set of optional libraries, as in pip install 'roboirgbench[sim]'. The fixture
    has run every command in a process in which no extra can be imported, and noted exit code,
    output and errors."""
    code, out, err = results_of_commands[command]

    assert (code, out) == (2, ""), err
    assert err.startswith("roboirg: ")
    assert len(err.splitlines()) == 1
    assert f"[{EXTRA_OF_COMMAND[command]}]'" in err


@pytest.mark.parametrize("command", sorted(set(all_commands()) - set(EXTRA_OF_COMMAND)))
def test_other_commands_work_without_extras(results_of_commands, command):
    """The fixture has run every command in a process in which no extra can be imported. The doctor
    works, too, and its exit code is 1 because it finds that extras are missing."""
    code, _, err = results_of_commands[command]

    assert code == (1 if command == "doctor" else 0), err


def test_every_extra_of_the_package_has_its_modules_listed_in_the_command():
    """Else a missing module could not be traced to the extra that brings it."""
    extras = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
    assert set(_MODULES) | {"dev", "docs", "learn"} == set(extras["optional-dependencies"])
    assert describe_missing(ModuleNotFoundError("", name="numpyy")) is None
