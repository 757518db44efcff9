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
    "setting": ("add-task.md", "Add a setting"),
    "protocol": ("extend.md", "Add a protocol"),
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
LAB_FILES = {
    "pyproject.toml": "toml",
    "my_lab/__init__.py": "python",
    "my_lab/lab-quick.yaml": "yaml",
}
"""The package of the docs: its files, each the first block of its kind in the section."""
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
    return re.search(rf"```{kind}\n(.*?)```", section[1], flags=re.DOTALL)[1]


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
    # The last block in TOML of the page.
    *_, colored = re.findall(
        r"```toml\n(.*?)```", (ROOT / "docs" / "add-task.md").read_text(), re.DOTALL
    )
    (package / "colored.toml").write_text(colored)
    lab = folder / "lab"
    (lab / "my_lab").mkdir(parents=True)
    for name, kind in LAB_FILES.items():
        (lab / name).write_text(recipe("extend.md", "Add a package", kind))
    venv.create(folder / "env", with_pip=False)
    python = folder / "env" / "bin" / "python"
    scheme = {"base": str(folder / "env"), "platbase": str(folder / "env")}
    site = Path(sysconfig.get_path("purelib", vars=scheme))
    # The environment sees what this one has, and the package under test.
    here = [sysconfig.get_path("purelib"), str(ROOT / "src")]
    (site / "parent.pth").write_text("\n".join(here) + "\n")
    install = ["install", "--quiet", "--no-deps", "--no-build-isolation", "--target", str(site)]
    projects = [str(package.parent), str(lab)]
    subprocess.run([sys.executable, "-m", "pip", *install, *projects], check=True)
    return python


@pytest.fixture(scope="module")
def roboirg(python_with_the_packages, tmp_path_factory):
    """A function that runs a command, given as words, in that environment, and returns what it
    prints; ``roboirg.folder`` is where it runs."""
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


def records_of_run(folder):
    """Return the records of a run, an episode each, as its file has them."""
    return [json.loads(line) for line in (folder / "records.jsonl").open()]


def test_tasks_lists_the_task_and_the_setting_of_an_installed_package(roboirg):
    """The fixture has installed the recipes of the documentation: the task PlaceAndPress (recipe of
    tasks), and the setting *colored* (recipe of settings), which is for PickXtimes and another task
    of the benchmark. A line of `roboirg tasks` is a task and its settings."""
    lines = roboirg("tasks").splitlines()

    (own_task,) = [line for line in lines if line.startswith("PlaceAndPress ")]
    (pick,) = [line for line in lines if line.startswith("PickXtimes ")]
    assert "explicit" in own_task
    assert "colored" in pick


def test_serve_offers_the_protocol_of_an_installed_package(roboirg):
    """The fixture has installed the recipes of the documentation: that of protocols adds *tiny*. A
    policy is served by the protocol that is named on the command line."""
    assert "tiny" in roboirg("serve", "--help")


@pytest.mark.sim
def test_an_episode_of_the_packages_task_and_setting_is_played_and_shown(roboirg):
    """The fixture has installed the recipes of the documentation: the task PlaceAndPress, and the
    setting *colored* for PickXtimes. The built-in listener plays an episode of both tasks in all
    their settings; it understands every one. The report of the run names what was added."""
    roboirg(
        "run", "--policy", "listener", "--tasks", "PlaceAndPress,PickXtimes", "--settings", "all",
        "--episodes", "1", "--out", "played",
    )  # fmt: skip
    roboirg("report", "played")

    records = records_of_run(roboirg.folder / "played")
    played = {(record["task"], record["options"]["setting"]) for record in records}
    page = (roboirg.folder / "played/report.html").read_text()
    assert {("PlaceAndPress", "direct"), ("PickXtimes", "colored")} <= played
    assert {record["outcome"] for record in records} == {"success"}
    assert "PlaceAndPress" in page
    assert "colored" in page


def test_a_function_of_the_page_s_package_is_a_command(roboirg):
    """The fixture has installed the package of docs/extend.md. Its entry point *lab* is a
    function that prints *hello* some times and whose docstring is *Greet the lab.*"""
    assert roboirg("lab", "--times", "2") == "hello hello\n"
    assert "Greet the lab." in roboirg("--help")


@pytest.mark.sim
def test_the_plan_of_the_page_s_package_is_played_by_its_name(roboirg):
    """The fixture has installed the package of docs/extend.md. Its plan *lab-quick* has an episode
    of PickXtimes in two settings, for the oracle, which succeeds, and for *random*."""
    roboirg("run", "--plan", "lab-quick", "--out", "lab")

    records = records_of_run(roboirg.folder / "lab")
    played = [(row["policy"], row["task"], row["options"]["setting"]) for row in records]
    assert sorted(played) == [
        ("oracle", "PickXtimes", "direct"),
        ("oracle", "PickXtimes", "explicit"),
        ("random", "PickXtimes", "direct"),
        ("random", "PickXtimes", "explicit"),
    ]
    assert {row["outcome"] for row in records if row["policy"] == "oracle"} == {"success"}
    assert {row["error"] for row in records} == {None}


def test_an_installed_package_does_not_change_the_benchmarks_own_episodes_and_words(
    python_with_the_packages,
):
    """In an environment with two packages installed, of which one adds the setting *colored*, a
    script compares fingerprints of our episodes, and digests of our words in all other settings,
    with the stored ones; it ends with an error where one differs."""
    script = CHECK_EPISODES_AND_WORDS.format(
        language=str(ROOT / "tests" / "language"), added=("colored",)
    )

    subprocess.run([python_with_the_packages, "-c", script], check=True)
