"""RoboMME's sentences as a wording file, from a repository with RoboMME's interface."""

import functools
import re
import sys
import tempfile
from pathlib import Path

import pytest
from selection import slow_but
from typer.testing import CliRunner
from wording_stand_ins import make_clone, sentence, train_episodes, train_goals

from roboirg import main as cli
from roboirg.apps.language_lab import robomme_import
from roboirg.core.errors import InvalidValueError
from roboirg.language import expressible, instruct
from roboirg.language.goal_fields import unordered
from roboirg.language.scenarios.wording_file import read_wordings
from roboirg.language.scenarios.wording_store import register_wordings
from roboirg.tasks import all_tasks

TASKS = tuple(all_tasks())


@functools.cache
def imported(*tasks):
    """The import of some tasks of the stand-in; open."""
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        chosen = {name: all_tasks()[name] for name in tasks}
        patch.setattr(robomme_import, "all_tasks", lambda: chosen)
        _, wordings = robomme_import.import_robomme(make_clone(Path(folder)), "stand-in")
    register_wordings(wordings)
    return wordings


@pytest.fixture
def one_task(monkeypatch):
    """Only VideoRepick is imported, of which there are few goals."""
    tasks = {"VideoRepick": all_tasks()["VideoRepick"]}
    monkeypatch.setattr(robomme_import, "all_tasks", lambda: tasks)


@pytest.mark.parametrize("task", slow_but(["BinFill", "VideoUnmask"], TASKS))
def test_each_goal_has_the_sentence_of_the_source_and_each_setting_stays(task):
    wordings = imported(task)
    for goal in train_goals(task):
        assert wordings.tasks[task].literals[unordered(goal)] == sentence(task, goal)
    for episode in train_episodes(task, 0, 2):
        said = instruct(episode, wordings=wordings.identity)
        assert said.text == sentence(task, episode.goal, episode.difficulty)
        assert expressible(episode, wordings=wordings.identity) == expressible(episode)


def test_the_command_writes_a_file_that_is_read_again(one_task, tmp_path):
    clone = make_clone(tmp_path / "clone")
    out = tmp_path / "out.toml"
    words = ["language", "import-robomme", str(clone), "--out", str(out)]
    call = CliRunner().invoke(cli.app, [*words, "--name", "stand-in"])

    assert call.exit_code == 0

    found = read_wordings(out)
    lines = ("VideoRepick: 3 sentences", f"Wrote {found.identity}: {out}")
    assert call.stdout.splitlines() == [*lines]
    assert re.fullmatch("stand-in@[0-9a-f]{8}", found.identity)

    # Only RoboMME's sentences may have its name, and a bad name is refused before the work.
    out.unlink()
    for more, complaint in (([], "give it another name"), (["--name", "a b"], "the name 'a b'")):
        call = CliRunner().invoke(cli.app, [*words, *more])
        assert complaint in str(call.exception)
        assert not out.exists()


ASKED = r"RoboMME's get_language_goal, asked for a goal of VideoRepick \((?:once|\d times)\), "


@pytest.mark.parametrize(
    ("body", "complaint"),
    [
        ("self.unheard_of", f"{ASKED}raised AttributeError"),
        ("None", f"{ASKED}returned None; it must be a list of sentences"),
        ("['put {it} there']", "it must be a whole sentence"),
        ("['soul\\u00e8ve-le']", "must be printable ASCII on one line"),
        (
            "[f'lift it, this is {self.difficulty}']",
            r"two sentences for a goal of VideoRepick \(.+\): 'lift it, .*' and 'lift it, ",
        ),
    ],
)
def test_a_sentence_that_cannot_be_used_is_named(one_task, tmp_path, body, complaint):
    clone = make_clone(tmp_path)
    file = clone / robomme_import.FILE
    file.write_text(f"def get_language_goal(self, env):\n    return {body}\n")

    with pytest.raises(InvalidValueError, match=complaint):
        robomme_import.import_robomme(clone, "stand-in")


def test_only_one_file_is_loaded_and_nothing_is_left_behind(one_task, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    clone = make_clone(tmp_path)
    (clone / "src/robomme/__init__.py").write_text("raise SystemExit")
    before = list(sys.path)
    modules = set(sys.modules)

    robomme_import.import_robomme(clone, "stand-in")

    assert sys.path == before
    assert not [name for name in set(sys.modules) - modules if "robomme" in name]
    assert not list(clone.rglob("__pycache__"))
    assert not sys.dont_write_bytecode


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (None, "name the folder of a clone"),
        ("import no_such_module_anywhere", "cannot be loaded: ModuleNotFoundError"),
        ("this is no Python", "cannot be loaded: SyntaxError"),
        ("get_language_goal = 3", "has no function get_language_goal"),
    ],
)
def test_a_folder_without_the_function_is_refused(tmp_path, content, complaint):
    if content is not None:
        file = tmp_path / robomme_import.FILE
        file.parent.mkdir(parents=True)
        file.write_text(content)
    with pytest.raises(InvalidValueError, match=complaint):
        robomme_import.import_robomme(tmp_path)
