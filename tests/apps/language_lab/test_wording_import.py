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
def imported(task):
    """Return the open words of one task, imported from the stand-in of RoboMME's repository."""
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr(robomme_import, "all_tasks", lambda: {task: all_tasks()[task]})
        _, wordings = robomme_import.import_robomme(make_clone(Path(folder)), "stand-in")
    register_wordings(wordings)
    return wordings


@pytest.fixture
def one_task(monkeypatch):
    """Only VideoRepick is imported, of which there are few goals."""
    tasks = {"VideoRepick": all_tasks()["VideoRepick"]}
    monkeypatch.setattr(robomme_import, "all_tasks", lambda: tasks)


each_task = pytest.mark.parametrize("task", slow_but(["BinFill", "VideoUnmask"], TASKS))


@each_task
def test_each_goal_has_the_sentence_of_the_source(task):
    """The stand-in is asked once by the import, and once here without it."""
    sentences = imported(task).tasks[task].literals
    for goal in train_goals(task):
        assert sentences[unordered(goal)] == sentence(task, goal)


@each_task
def test_the_explicit_setting_says_the_sentence_of_the_source(task):
    """Sentences are imported from a stand-in of RoboMME's repository. In two training episodes of
    each task, the explicit instruction is the sentence that the stand-in has for the goal.
    """
    for episode in train_episodes(task, 0, 2):
        said = instruct(episode, wordings=imported(task).identity)
        assert said.text == sentence(task, episode.goal, episode.difficulty)


@each_task
def test_imported_sentences_leave_each_other_setting_as_it_is(task):
    """Whole sentences are said in *explicit* only."""
    for episode in train_episodes(task, 0, 2):
        assert expressible(episode, wordings=imported(task).identity) == expressible(episode)


def import_command(folder, *options):
    """Return the outcome of `roboirg language import-robomme`, which writes FOLDER/out.toml."""
    clone = make_clone(folder / "clone")
    words = ["language", "import-robomme", str(clone), "--out", str(folder / "out.toml")]
    return CliRunner().invoke(cli.app, [*words, *options])


def test_the_command_writes_a_file_that_is_read_again(one_task, tmp_path):
    """The stand-in of RoboMME's repository has three sentences for the goals of VideoRepick. The
    name that was given and a digest of the words make their identity.
    """
    outcome = import_command(tmp_path, "--name", "stand-in")

    out = tmp_path / "out.toml"
    identity = read_wordings(out).identity
    assert re.fullmatch("stand-in@[0-9a-f]{8}", identity)
    assert outcome.stdout == f"VideoRepick: 3 sentences\nWrote {identity}: {out}\n"


@pytest.mark.parametrize(
    ("options", "complaint"),
    [([], "give it another name"), (["--name", "a b"], "the name 'a b'")],
)
def test_a_name_that_is_bad_or_robomme_s_is_refused_and_nothing_is_written(
    one_task, tmp_path, options, complaint
):
    """Without a name it would be "robomme", which only RoboMME's own sentences may have."""
    outcome = import_command(tmp_path, *options)

    assert complaint in str(outcome.exception)
    assert not (tmp_path / "out.toml").exists()


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
    """RoboMME's sentences come from a function of its repository, `get_language_goal`; a clone has
    it in one file. Here that file has a function that returns `body`, a Python expression, for
    each goal: an error, no list, a sentence with a placeholder or a foreign letter, or one that
    depends on more than the goal. `complaint` is a pattern of the message.
    """
    clone = make_clone(tmp_path)
    file = clone / robomme_import.FILE
    file.write_text(f"def get_language_goal(self, env):\n    return {body}\n")

    with pytest.raises(InvalidValueError, match=complaint):
        robomme_import.import_robomme(clone, "stand-in")


def test_only_one_file_is_loaded_and_no_module_is_left_behind(one_task, tmp_path):
    """RoboMME's package itself, which here would end the process, needs a simulator."""
    clone = make_clone(tmp_path)
    (clone / "src/robomme/__init__.py").write_text("raise SystemExit")
    path = list(sys.path)
    modules = set(sys.modules)

    robomme_import.import_robomme(clone, "stand-in")

    assert sys.path == path
    assert not [name for name in set(sys.modules) - modules if "robomme" in name]


def test_an_import_writes_no_bytecode_into_the_clone(one_task, tmp_path, monkeypatch):
    """Python's option not to write any is set during the import alone."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    clone = make_clone(tmp_path)

    robomme_import.import_robomme(clone, "stand-in")

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
    """`content` is that of RoboMME's file of sentences; None if there is no such file."""
    if content is not None:
        file = tmp_path / robomme_import.FILE
        file.parent.mkdir(parents=True)
        file.write_text(content)
    with pytest.raises(InvalidValueError, match=complaint):
        robomme_import.import_robomme(tmp_path)
