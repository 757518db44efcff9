"""An installed package adds a task, a setting and a protocol: the recipes of the docs."""

import json
import os
import re
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
RECIPES = {
    "task": ("add-task.md", "Add a task"),
    "setting": ("add-setting.md", "Add a setting"),
    "protocol": ("add-protocol.md", "Add a protocol"),
}
PYPROJECT = """\
[build-system]
requires = ["hatchling"]
build-backend = "hatchling.build"

[project]
name = "roboirg-outside"
version = "1.0"

[project.entry-points."roboirg.tasks"]
outside = "roboirg_outside.task"

[project.entry-points."roboirg.settings"]
outside = "roboirg_outside.setting:SETTING"

[project.entry-points."roboirg.protocols"]
outside = "roboirg_outside.protocol"
"""
LAB = ROOT / "docs" / "add-package.md"
SETTING_PAGE = ROOT / "docs" / "add-setting.md"
WITH_SETTING = "PickXtimes"
"""A task of the benchmark to which the recipe's setting applies."""
PRINT_NAMES = """\
from roboirg_outside.protocol import PROTOCOL
from roboirg_outside.setting import SETTING
from roboirg_outside.task import TASK
import json
print(json.dumps([TASK.name, SETTING.name, PROTOCOL.name]))
"""
CHECK_EPISODES_AND_WORDS = """\
import sys
sys.path[:0] = [{language!r}]
import test_golden
from roboirg.core.episode import SPLITS
from roboirg.tasks.splits.fingerprint import fingerprint
from roboirg.tasks.splits.splits import shipped_splits, split_episodes
for task, splits in list(shipped_splits().items())[::4]:
    assert fingerprint(split_episodes([task], SPLITS)) == splits.sha256, task
every = test_golden.expressible_options
test_golden.expressible_options = lambda one: [o for o in every(one) if o.setting not in {added!r}]
for task, expected in list(test_golden.DIGESTS.items())[::4]:
    assert test_golden.digest_of_first_instructions(task) == expected, task
"""


def recipe(page, heading, kind="python"):
    """The first block of a section in Python, or of another kind, as it stands in the docs."""
    text = (ROOT / "docs" / page).read_text()
    section = re.search(rf"^#+ {heading}\n(.*?)(?=^##|\Z)", text, flags=re.DOTALL | re.MULTILINE)
    assert section, f"docs/{page} has no section {heading!r}"
    block = re.search(rf"```{kind}\n(.*?)```", section[1], flags=re.DOTALL)
    assert block, f"the section {heading!r} of docs/{page} has no {kind} block"
    return block[1]


@pytest.fixture(scope="module")
def python_with_the_packages(tmp_path_factory):
    """Install the recipes as a package into an environment of its own; yield its Python."""
    folder = tmp_path_factory.mktemp("outside")
    package = folder / "project" / "roboirg_outside"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text('"""Three additions."""\n')
    (package.parent / "pyproject.toml").write_text(PYPROJECT)
    for name, (page, heading) in RECIPES.items():
        (package / f"{name}.py").write_text(recipe(page, heading))
    (package / "words.toml").write_text(recipe("add-task.md", "Words", "toml"))
    # The first block in TOML of the section names the entry point.
    _, colored = re.findall(r"```toml\n(.*?)```", SETTING_PAGE.read_text(), re.DOTALL)
    (package / "colored.toml").write_text(colored)
    lab = folder / "lab" / "my_lab"
    lab.mkdir(parents=True)
    blocks = re.findall(r"```(toml|python|yaml)\n(.*?)```", LAB.read_text(), re.DOTALL)
    names = ("__init__.py", "words.toml", "lab-quick.yaml")
    files = (lab.parent / "pyproject.toml", *(lab / name for name in names))
    for path, (_, text) in zip(files, blocks, strict=True):
        path.write_text(text)
    venv.create(folder / "env", with_pip=False)
    python = folder / "env" / "bin" / "python"
    scheme = {"base": str(folder / "env"), "platbase": str(folder / "env")}
    site = Path(sysconfig.get_path("purelib", vars=scheme))
    # The environment sees what this one has, and the package under test.
    here = [sysconfig.get_path("purelib"), str(ROOT / "src")]
    (site / "parent.pth").write_text("\n".join(here) + "\n")
    install = ["install", "--quiet", "--no-deps", "--no-build-isolation", "--target", str(site)]
    projects = [str(package.parent), str(lab.parent)]
    subprocess.run([sys.executable, "-m", "pip", *install, *projects], check=True)
    return python


@pytest.fixture(scope="module")
def names_of_additions(python_with_the_packages):
    return json.loads(
        subprocess.run([python_with_the_packages, "-c", PRINT_NAMES], check=True, stdout=-1).stdout
    )


@pytest.fixture(scope="module")
def roboirg(python_with_the_packages, tmp_path_factory):
    """Run a command in that environment and return what it prints."""
    folder = tmp_path_factory.mktemp("work")

    def run(*words):
        command = [str(python_with_the_packages), "-m", "roboirg", *words]
        env = {**os.environ, "COLUMNS": "200", "ROBOIRG_CACHE": str(folder / "cache")}
        done = subprocess.run(
            command, cwd=folder, env=env, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{' '.join(words)}\n{done.stdout}\n{done.stderr}"
        return done.stdout

    run.folder = folder
    return run


def test_commands_list_the_task_setting_and_protocol_of_an_installed_package(
    roboirg, names_of_additions
):
    """The package adds one of each; its setting is for a task of the benchmark (`WITH_SETTING`)."""
    task, setting, protocol = names_of_additions
    listed = {line.split()[0]: line for line in roboirg("tasks").splitlines()}
    assert "explicit" in listed[task]
    assert setting in listed[WITH_SETTING]
    assert protocol in roboirg("serve", "--help")


@pytest.mark.sim
def test_an_episode_of_the_packages_task_and_setting_is_played_and_shown(
    roboirg, names_of_additions
):
    """The listener plays the package's task, and PickXtimes with the package's setting."""
    task, setting, *_ = names_of_additions
    roboirg(
        "run", "--policy", "listener", "--tasks", f"{task},{WITH_SETTING}", "--settings", "all",
        "--episodes", "1", "--out", "played",
    )  # fmt: skip
    records = [json.loads(line) for line in (roboirg.folder / "played/records.jsonl").open()]
    played = {(record["task"], record["options"]["setting"]) for record in records}
    assert {(task, "direct"), (WITH_SETTING, "direct"), (WITH_SETTING, setting)} <= played
    assert {record["outcome"] for record in records} == {"success"}
    roboirg("report", "played")
    page = (roboirg.folder / "played/report.html").read_text()
    assert task in page
    assert setting in page


@pytest.mark.sim
def test_the_package_of_the_page_adds_a_task_a_setting_a_kind_a_command_and_a_plan(roboirg):
    assert roboirg("lab", "--times", "2") == "hello hello\n"
    assert "Greet the lab." in roboirg("--help")
    roboirg("run", "--plan", "lab-quick", "--max-steps", "400", "--out", "lab")
    records = [json.loads(line) for line in (roboirg.folder / "lab/records.jsonl").open()]
    played = {
        (record["policy"], record["task"], record["options"]["setting"]) for record in records
    }
    assert played == {
        (who, "LabPick", own) for who in ("oracle", "lab:any") for own in ("explicit", "lab")
    }
    assert {record["outcome"] for record in records if record["policy"] == "oracle"} == {"success"}
    assert {record["error"] for record in records} == {None}


def test_an_installed_package_does_not_change_the_benchmarks_own_episodes_and_words(
    python_with_the_packages, names_of_additions
):
    """A script compares both with the stored ones, in an environment with the package installed."""
    _, added, _ = names_of_additions
    script = CHECK_EPISODES_AND_WORDS.format(
        language=str(ROOT / "tests" / "language"), added=(added, "lab")
    )
    subprocess.run([python_with_the_packages, "-c", script], check=True)
