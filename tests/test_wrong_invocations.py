"""Wrong invocations of every command: one sentence, exit code 2, nothing written.

Commands share their options. Each kind of mistake is made once, and each option's value is wrong
once; the commands take turns, so that none is left out.
"""

import sys
from collections import Counter

import pytest
from all_commands import all_commands, make_run, words_of

from roboirg import main as cli

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


def wrong_words(command, words):
    """Yield kinds of mistakes, with variations of right words that have one, for a command."""
    yield "unknown option", [*words, "--no-such-option"]
    yield "surplus words", [*words, "surplus", "words", "here"]
    for parameter in command.params:
        names = [name for name in parameter.opts if name.startswith("--")]
        if not names or names[0] in ("--help", "--version"):
            continue
        if parameter.is_flag:
            yield "a flag with a value", [*words, f"{names[0]}=maybe"]
        elif names[0] not in OPTIONS_OF_ANY_TEXT:
            bad = WRONG_NAMES.get(names[0], "many")
            yield f"{names[0]} {bad}", [*words, names[0], bad]
        if parameter.required:
            yield f"without {names[0]}", [word for word in words if word != names[0]]
        if not parameter.is_flag:
            yield "no value", [*words, names[0]]


RIGHT_WORDS_FOR = {
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


def one_of_each_kind():
    """Return a case of every kind, and at least one of every command: its name, and the words."""
    cases = {}
    right_words = words_of("out", "run") | RIGHT_WORDS_FOR
    for name, command in all_commands().items():
        for kind, words in wrong_words(command, right_words[name]):
            cases.setdefault(kind, {}).setdefault(name, words)
    tried = Counter()
    chosen = []
    for kind in sorted(cases, key=lambda kind: len(cases[kind])):
        name = min(cases[kind], key=lambda name: tried[name])
        tried[name] += 1
        chosen.append(pytest.param(name, cases[kind][name], id=f"{name}: {kind}"))
    for name in sorted(set(all_commands()) - set(tried)):
        words = cases["unknown option"][name]
        chosen.append(pytest.param(name, words, id=f"{name}: unknown option"))
    return chosen


CASES = one_of_each_kind()


@pytest.fixture(scope="module")
def folder_with_a_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wrong")
    make_run(folder / "run")
    return folder


@pytest.fixture
def refused(folder_with_a_run, monkeypatch, capsys):
    """Call a command that ends with exit code 2, and return what it prints."""
    monkeypatch.chdir(folder_with_a_run)
    monkeypatch.setattr(sys, "path", list(sys.path))

    def call(name, words):
        monkeypatch.setattr(sys, "argv", ["roboirg", *name.split(), *words])
        with pytest.raises(SystemExit) as left:
            cli.main()
        printed = capsys.readouterr()
        assert left.value.code == 2, printed
        return printed

    return call


@pytest.mark.parametrize(("name", "words"), CASES)
def test_a_wrong_command_line_is_one_sentence_with_exit_code_2_and_writes_nothing(
    name, words, folder_with_a_run, refused
):
    before = sorted(folder_with_a_run.rglob("*"))
    printed = refused(name, words)

    assert printed.out == ""
    assert printed.err.startswith("roboirg: ")
    assert printed.err.count("\n") == 1
    assert sorted(folder_with_a_run.rglob("*")) == before


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
