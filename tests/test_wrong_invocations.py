"""Wrong invocations of every command: one sentence, exit code 2, nothing written.

Commands share their options: each option has a wrong value once, with the first command that has
it. And each command once gets an option that there is not.
"""

import sys

import pytest
from all_commands import all_commands, make_run, words_of

WRONG_NAMES = {
    "--tasks": "PickXtime", "--settings": "spatail", "--forms": "implict",
    "--split": "tset", "--episodes": "four", "--policy-seeds": "one",
    "--stages": "9-1", "--distractor": "nutral", "--frame": "robt",
    "--wordings": "nowhere.toml", "--floors": "chanse",
    "--video": "som", "--protocol": "opnpi",
    "--executor": "slurm", "--plan": "papr", "--api-key-env": "NO_SUCH_VARIABLE", "--which": "mian",
    "--format": "pdf", "--by": "colour",
}  # fmt: skip
"""A value that no command takes, for every option that takes names."""


OPTIONS_OF_ANY_TEXT = {
    "--out", "--trajectories", "--operator", "--policy", "--host",
    "--name",
}  # fmt: skip
"""Options that take any text; all others take numbers or names."""


RIGHT_WORDS_FOR = {
    "export hub-results": ["run", "random", "--dataset", "owner/name"],
    "fetch-models": ["--wheel", "nowhere"],
    "language check-scenarios": ["nowhere"],
    "language sample": ["--out", "out"],
    "language import-robomme": ["nowhere", "--out", "words.toml"],
    "leaderboard verify": ["nowhere"],
    "replay": ["nowhere"],
    "score grounding": ["nowhere", "--data", "nowhere"],
    "learn listener": ["--out", "out"],
    "learn policy": ["--out", "out"],
    "learn reader": ["--body", "a", "--out", "out"],
}
"""Words for commands whose work needs what is not there: files, or a library."""


def options_of(command):
    """Return the parameters of a command that are options, by the first name of each."""
    found = {}
    for parameter in command.params:
        if parameter.opts[0].startswith("--") and parameter.opts[0] not in ("--help", "--version"):
            found[parameter.opts[0]] = parameter
    return found


def words_with_wrong_values():
    """Return commands and words for them, in which the value of one option is wrong, by option."""
    found = {}
    right_words = words_of("out", "run") | RIGHT_WORDS_FOR
    for name, command in all_commands().items():
        for option, parameter in options_of(command).items():
            if parameter.is_flag:
                wrong = [f"{option}=maybe"]
            elif option in OPTIONS_OF_ANY_TEXT:
                wrong = [option]  # without a value
            else:
                wrong = [option, WRONG_NAMES.get(option, "many")]
            found.setdefault(option, (name, [*right_words[name], *wrong]))
    return found


WRONG_VALUES = words_with_wrong_values()


@pytest.fixture(scope="module")
def folder_with_a_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wrong")
    make_run(folder / "run")
    return folder


@pytest.fixture
def refused(folder_with_a_run, monkeypatch, roboirg):
    """Call a command that ends with exit code 2, and return what it prints."""
    monkeypatch.chdir(folder_with_a_run)
    monkeypatch.setattr(sys, "path", list(sys.path))

    def call(name, words):
        ended = roboirg(*name.split(), *words)
        assert ended.code == 2, ended
        return ended

    return call


def check_one_sentence(refused, folder, name, words):
    """Assert that a command prints one sentence, and that a folder stays as it is."""
    before = sorted(folder.rglob("*"))

    printed = refused(name, words)

    assert printed.out == ""
    assert printed.err.startswith("roboirg: ")
    assert printed.err.count("\n") == 1
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize("option", WRONG_VALUES)
def test_a_wrong_value_of_an_option_is_one_sentence_and_nothing_is_written(
    option, folder_with_a_run, refused
):
    check_one_sentence(refused, folder_with_a_run, *WRONG_VALUES[option])


@pytest.mark.parametrize("name", all_commands())
def test_an_unknown_option_is_one_sentence_and_nothing_is_written(name, folder_with_a_run, refused):
    right_words = words_of("out", "run") | RIGHT_WORDS_FOR

    check_one_sentence(refused, folder_with_a_run, name, [*right_words[name], "--no-such-option"])


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("leaderboard pack", ["run"]),
        ("check-policy", []),
        ("language check-scenarios", []),
        ("compare", ["run:random"]),
        ("tasks", ["surplus", "words"]),
    ],
)
def test_a_command_with_too_few_or_too_many_words_is_refused_in_one_sentence(
    name, words, folder_with_a_run, refused
):
    check_one_sentence(refused, folder_with_a_run, name, words)


NO_FOLDERS = "a" * 260, "run/records.jsonl"
"""A name that is too long for a file, and a file."""
WRITING = [
    pytest.param(name, words, id=f"{name}: {folder[:9]}")
    for folder in NO_FOLDERS
    for name, words in words_of(folder, "run").items()
    # One that plays before it writes is enough for both.
    if "--out" in words and (name, folder) != ("show", NO_FOLDERS[1])
]


@pytest.mark.parametrize(("name", "words"), WRITING)
def test_a_command_whose_output_folder_cannot_be_written_ends_in_one_sentence(name, words, refused):
    assert refused(name, words).err.splitlines()[-1].startswith("roboirg: ")
