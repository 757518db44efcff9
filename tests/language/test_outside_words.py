"""Words that another package brings, for a setting or a task of its own.

The package is installed in a folder; a second process imports it from there, runs a short program,
and prints what the program adds to the list `found`.
"""

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from roboirg.language.scenarios.identity import words_of

DOCS = Path(__file__).parents[2] / "docs"
SCENARIO_OF_EACH_SETTING = """
[[scenario]]
frame = "NOUN 0"
pool = "POOL"
setting = "direct"
introduction = "{person} wants a NOUN of the {color} cube."
reinforcement = "{he} dreams of <it color: it> as a NOUN."
distractors = ["Every NOUN takes hours.", "A NOUN is expensive.", "My last NOUN was lost."]
competing = ["{he} already has a NOUN of {his} {rival color} hat."]
cue = "Okay, the NOUN begins with <it color: it>."
say.color = ["<it color: it>", "<that color: that cube>"]

[[scenario]]
frame = "NOUN 1"
pool = "POOL"
setting = "reasoning"
derive.pattern = "color exclusion"
introduction = "I already have a NOUN of the {excluded} [excluded: cube|cubes]."
say.color = ["<other excluded: the other one>"]

[[scenario]]
frame = "NOUN 2"
pool = "POOL"
setting = "reasoning"
list = "color"
derive.pattern = "contextual logic"
introduction = "I need a NOUN of the {list} cubes, but {person} has the {taken} one."
say.color = ["<other color: the other one>"]

[[scenario]]
frame = "NOUN 3"
pool = "POOL"
setting = "direct-rival"
list = "color"
introduction = "The NOUN of {person} has the {list.0} cube, and mine has the {list.1} one."
say.color = ["<it color: it>"]
remarks.former = "The NOUN is ready for <former list.0: {hers}>: "
remarks.latter = "The NOUN is ready for <latter list.1: the latter>: "
remarks.not_former = "The NOUN cannot have <former list.0: {hers}>: "
remarks.not_latter = "The NOUN cannot have <latter list.1: the latter>: "

[[scenario]]
frame = "NOUN 4"
pool = "POOL"
setting = "grounded"
introduction = "{clue} is missing from the NOUN."
say.color = ["<it clue: it>"]
"""
"""Of every setting of the page's task; NOUN is another word for each pool of wordings."""


def blocks(page, heading):
    """Return the blocks of a section of a page, and of its smaller ones, as they stand there."""
    _, _, section = (DOCS / page).read_text().partition(f"\n## {heading}\n")
    section = re.split(r"^## ", section, flags=re.MULTILINE)[0]
    return re.findall(r"```(?:python|toml)\n(.*?)```", section, re.DOTALL)


def words_for_every_setting():
    """Return the page's file of words with scenarios of every setting instead of its own."""
    head, _, _ = TASK_WORDS.partition("[[scenario]]")
    train = SCENARIO_OF_EACH_SETTING.replace("POOL", "train").replace("NOUN", "painting")
    test = SCENARIO_OF_EACH_SETTING.replace("POOL", "test").replace("NOUN", "film")
    return head + train + test


TASK_PAGE = (DOCS / "add-task.md").read_text()
TASK, *_ = re.findall(r"```python\n(.*?)```", TASK_PAGE, re.DOTALL)
TASK_PROJECT, *_ = re.findall(r"```toml\n(.*?)```", TASK_PAGE, re.DOTALL)
(TASK_WORDS,) = blocks("add-task.md", "Words")
COLORED, COLORED_PROJECT, COLORED_WORDS = blocks("add-task.md", "Add a setting")


class InstalledPackage:
    """A package as if it were installed, with the code and words of two documentation pages.

    It adds the task PlaceAndPress with words.toml, and the setting "colored" with colored.toml.

    Args:
        folder: where it lies.
    """

    def __init__(self, folder):
        self.folder = folder
        self.files = folder / "my_package"
        info = folder / "my_package-1.0.dist-info"
        for made in (self.files, info):
            made.mkdir()
        files = {
            "__init__.py": "",
            "place_and_press.py": TASK,
            "words.toml": TASK_WORDS,
            "colored.py": COLORED,
            "colored.toml": COLORED_WORDS,
        }
        for name, text in files.items():
            (self.files / name).write_text(text)
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-package\nVersion: 1.0\n")
        entries = ""
        for project in (TASK_PROJECT, COLORED_PROJECT):
            for group, points in tomllib.loads(project)["project"]["entry-points"].items():
                ((name, place),) = points.items()
                entries += f"[{group}]\n{name} = {place}\n"
        (info / "entry_points.txt").write_text(entries)

    def run(self, code):
        """Run a program in a process where the package is installed.

        It may use the names that PROGRAM_HEAD imports. Returns what it adds to the list `found`.
        """
        path = os.pathsep.join([str(self.folder), *sys.path])
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM_HEAD + code + "\nprint(json.dumps(found))"],
            env={**os.environ, "PYTHONPATH": path},
            capture_output=True,
            text=True,
            check=False,
        )
        assert not done.returncode, done.stderr
        return json.loads(done.stdout)


PROGRAM_HEAD = """
import itertools, json
from dataclasses import replace
from roboirg.apps.language_lab.scenarios.scenario_check import check_scenarios, scenes_of
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import POOLS
from roboirg.language import FORMS, instruct, instruct_with
from roboirg.language.arms import say_arm
from roboirg.language.generator import find_refusal
from roboirg.language.scenarios.identity import language_label, words_of
from roboirg.language.scenarios.scenario_file import setting_scenarios, task_scenarios
from roboirg.language.settings import all_settings, get_setting, settings_of
from roboirg.shortcuts.command_chance import understood_goals
from roboirg.tasks import all_tasks, get_task
from roboirg.tasks.splits.splits import get_episode
found = []

def said_or_refused(task, setting):
    try:
        return instruct(get_episode(task, "test", 0), setting).text
    except InvalidValueError as error:
        return str(error)
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """The package of the documentation pages, installed."""
    return InstalledPackage(tmp_path_factory.mktemp("package"))


def test_the_setting_of_the_documentation_page_speaks_the_words_of_its_own_file(package):
    """`package` is an installed package with the code of docs/add-task.md; the program runs in a
    process that imports it. The page's file of words has the scenarios "new coat" for training and
    "loan" for tests, for two tasks. An instruction names the digest of the words."""
    found = package.run("""
for task, pool in itertools.product(("PickXtimes", "SwingXtimes"), POOLS):
    said = instruct(get_episode(task, "test", 1), "colored", wordings=pool)
    names_its_words = said.metadata["words"] == words_of(task, pool, "colored")
    found.append([task, pool, said.metadata["scenario"], names_its_words])
""")

    assert found == [
        ["PickXtimes", "train", "new coat", True],
        ["PickXtimes", "test", "loan", True],
        ["SwingXtimes", "train", "new coat", True],
        ["SwingXtimes", "test", "loan", True],
    ]


def test_the_setting_of_the_documentation_page_means_the_goal(package):
    """`package` is an installed package with the code of docs/add-task.md; the program runs in a
    process that imports it, and notes whether what the setting *colored* says leaves exactly the
    goal of the episode, in two tasks and both pools of words."""
    found = package.run("""
for task, pool in itertools.product(("PickXtimes", "SwingXtimes"), POOLS):
    episode = get_episode(task, "test", 1)
    said = instruct(episode, "colored", wordings=pool)
    found.append(understood_goals(said, episode) == (episode.goal,))
""")

    assert found == [True, True, True, True]


def test_the_setting_of_the_documentation_page_ends_with_the_explicit_command_when_resolved(
    package,
):
    """`package` is an installed package with the code of docs/add-task.md; the program runs in a
    process that imports it. The resolved form of the setting *colored* has the same introduction as
    the implicit one, and then the command of the setting *explicit*."""
    (turns,) = package.run("""
episode = get_episode("PickXtimes", "test", 1)
resolved = instruct(episode, "colored", "resolved").turns
found.append([resolved, instruct(episode, "colored").turns, instruct(episode).text])
""")

    resolved, implicit, explicit_command = turns
    assert resolved == [implicit[0], explicit_command]


def test_the_words_of_the_setting_of_the_documentation_page_break_no_rule(package):
    """`package` is an installed package with the code of docs/add-task.md; the program runs in a
    process that imports it. The checker for authors collects the rules that the page's words break
    in every 20th scene."""
    found = package.run("""
for task, words in setting_scenarios("colored").items():
    for report in check_scenarios(words, None, scenes_of(task, 0)[::20]):
        found += report.broken
""")
    assert found == []


def test_the_words_of_an_installed_setting_change_the_digest_of_that_setting_only(package):
    """`words_of` identifies what can be said of a task in a pool (train or test) by a digest. The
    fixture has installed a package with the setting *colored*, whose own file of words is for
    PickXtimes and SwingXtimes. So only their words in this setting may be others than those of the
    task here, where the package is not installed."""
    found = package.run("""
for task, pool, setting in itertools.product(all_tasks(), POOLS, all_settings()):
    found.append([task, pool, setting, words_of(task, pool, setting)])
""")

    changed = []
    for task, pool, setting, words in found:
        if words != words_of(task, pool):
            changed.append((task, pool, setting))
    assert changed == [
        ("PickXtimes", "train", "colored"),
        ("PickXtimes", "test", "colored"),
        ("SwingXtimes", "train", "colored"),
        ("SwingXtimes", "test", "colored"),
    ]


def test_the_language_label_names_an_installed_setting_after_the_words_of_its_task(package):
    """`package` is an installed package with the setting *colored*. A label has the version of the
    language, the words of the task, and those of a setting with a file of its own, each as task,
    pool and digest."""
    (label,) = package.run("""
found.append(language_label(["PickXtimes"], "test", ["direct", "colored"]))
""")
    _, ours, colored = label.split()
    assert ours == words_of("PickXtimes", "test")
    assert re.fullmatch("PickXtimes/test/colored@[0-9a-f]{12}", colored)


@pytest.mark.parametrize(
    ("setting", "pattern"),
    [
        ("explicit", r"Place the \w+ cube on the target, then push the button\."),
        ("contextual", r"[\w ]+ wants a photo of the \w+ cube on the target\. .*"),
        ("reasoning", ".*: words.toml has no reasoning scenario for it in the pool test; leave.*"),
    ],
)
def test_the_task_of_the_documentation_page_speaks_the_words_of_its_own_file(
    package, setting, pattern
):
    """`package` is an installed package with the task PlaceAndPress of docs/add-task.md. Its file
    words.toml has a command, and the scenario *… wants a photo …* for *direct*, which *contextual*
    says, too. It has none for *reasoning*, and the refusal names that file. `said_or_refused`
    returns the text or the refusal."""
    (text,) = package.run(f'found.append(said_or_refused("PlaceAndPress", "{setting}"))')
    assert re.fullmatch(pattern, text)


def test_the_words_of_the_task_of_the_documentation_page_break_no_rule(package):
    """`package` is an installed package with the task PlaceAndPress of docs/add-task.md. The
    checker for authors collects the rules that the page's words break in every 20th scene."""
    found = package.run("""
words = task_scenarios("PlaceAndPress")
for report in check_scenarios(words, None, scenes_of("PlaceAndPress", 0)[::20]):
    found += report.broken
""")
    assert found == []


@pytest.fixture(scope="module")
def complete_package(tmp_path_factory):
    """An installed package whose task has words for each setting."""
    outside = InstalledPackage(tmp_path_factory.mktemp("complete"))
    (outside.files / "words.toml").write_text(words_for_every_setting())
    return outside


def test_a_task_of_another_package_can_be_commanded_in_every_setting(complete_package):
    """`complete_package` is an installed package with the task PlaceAndPress and scenarios for
    every setting. In at least one of twelve episodes, each setting must be possible in the words of
    training and of tests."""
    found = complete_package.run("""
for split, setting in itertools.product(("train", "test"), settings_of(get_task("PlaceAndPress"))):
    for index in range(12):
        episode = get_episode("PlaceAndPress", split, index)
        if find_refusal(episode, InstructionOptions(setting)) is None:
            found.append(f"{setting} in {split}")
""")

    assert sorted(set(found)) == [
        "contextual in test", "contextual in train",
        "direct in test", "direct in train",
        "direct-rival in test", "direct-rival in train",
        "explicit in test", "explicit in train",
        "grounded in test", "grounded in train",
        "reasoning in test", "reasoning in train",
    ]  # fmt: skip


def test_the_words_of_a_task_of_another_package_mean_the_goal_in_both_forms(complete_package):
    """`complete_package` is an installed package with the task PlaceAndPress and scenarios for
    every setting. The program collects the texts that mean another goal than the episode's, or
    several."""
    wrong = complete_package.run("""
for split, index in itertools.product(("train", "test"), range(12)):
    episode = get_episode("PlaceAndPress", split, index)
    for setting, form in itertools.product(settings_of(get_task("PlaceAndPress")), FORMS):
        options = InstructionOptions(setting, form)
        if find_refusal(episode, options) is None:
            said = instruct_with(episode, options)
            if understood_goals(said, episode) != (episode.goal,):
                found.append(said.text)
""")

    assert wrong == []


def test_a_task_of_another_package_has_every_control_run(complete_package):
    """`complete_package` is an installed package with the task PlaceAndPress and scenarios for
    every setting. A control run ("arm") says other words, or those of another goal. The program
    collects refusals; only a paraphrase may lack, where a setting has one text for an episode."""
    refusals = complete_package.run("""
arms = ("paraphrase-1", "other-goal", "silent", "scrambled", "again")
for split, setting in itertools.product(("train", "test"), settings_of(get_task("PlaceAndPress"))):
    episode = get_episode("PlaceAndPress", split, 0)
    options = InstructionOptions(setting)
    if find_refusal(episode, options) is None:
        for arm in arms:
            try:
                say_arm(episode, options, arm)
            except InvalidValueError as error:
                found.append(str(error))
""")

    for refusal in refusals:
        assert "has no paraphrase" in refusal


def package_with_a_mistake(folder, file, before, after):
    """Return the package of the documentation pages with a text replaced in one of its files."""
    outside = InstalledPackage(folder)
    text = (outside.files / file).read_text()
    assert before in text
    (outside.files / file).write_text(text.replace(before, after))
    return outside


@pytest.mark.parametrize(
    ("file", "before", "after", "sentence"),
    [
        (
            "colored.py", '"colored.toml"', '"gone.toml"',
            "The words of colored are '{}/gone.toml', which is no file; name it by its whole path.",
        ),
        (
            "colored.toml", '"PickXtimes", ', "",
            ": {}/colored.toml has no colored scenario for it in the pool test.",
        ),
        (
            "colored.toml", 'setting = "colored"', 'setting = "colorful"',
            " 'new coat': There is no setting 'colorful'; known: colored, direct, direct-rival, ",
        ),
        (
            "colored.py", "content_plans=content_plans", 'content_plans="drect"',
            "There is no setting for the content_plans of colored, named 'drect'; known: direct, ",
        ),
    ],
    ids=["no such file", "task left out", "misspelled setting", "misspelled plan of contents"],
)  # fmt: skip
def test_a_mistake_in_the_words_of_a_package_is_reported_with_file_and_cure(
    tmp_path, file, before, after, sentence
):
    """The package of a documentation page has the setting *colored* in colored.py, and its words
    for PickXtimes and SwingXtimes in colored.toml. An author makes one mistake: `after` stands
    where `before` would be right. Who asks for a command in this setting is told by the sentence,
    in which ``{}`` is the folder of the package."""
    outside = package_with_a_mistake(tmp_path, file, before, after)

    (printed,) = outside.run('found.append(said_or_refused("PickXtimes", "colored"))')

    assert sentence.format(outside.files).rstrip(".") in printed


def test_a_word_file_of_a_task_that_names_another_task_only_is_refused(tmp_path):
    """The package of a documentation page has the task PlaceAndPress, and its words in words.toml.
    That file names PickXtimes wherever PlaceAndPress would be right."""
    outside = package_with_a_mistake(tmp_path, "words.toml", "PlaceAndPress", "PickXtimes")

    (printed,) = outside.run('found.append(said_or_refused("PlaceAndPress", "explicit"))')

    assert f": PlaceAndPress is not among the tasks of {outside.files}/words.toml" in printed
