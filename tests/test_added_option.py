"""A further option of instructions is a field and the code that reads it; all else follows."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from plan_files import plan_file
from python_process import print_of_python

import roboirg

pytestmark = [pytest.mark.sim, pytest.mark.slow]

CHANGES_THAT_ADD_THE_OPTION = {
    "core/instruction_options.py": [
        (
            "    delivery: Label = field(",
            (
                "    greeting: Label = field(\n"
                '        default="plain",\n'
                '        metadata=described("hello: the robot is greeted; or plain."),\n'
                "    )\n"
                "    delivery: Label = field("
            ),
        ),
        ("    delivery: str\n", "    delivery: str\n    greeting: str\n"),
    ],
    "language/settings/direct.py": [
        ('reads=frozenset({"delivery"', 'reads=frozenset({"greeting", "delivery"'),
    ],
    "language/scenarios/spoken.py": [
        (
            '    utterances = [UtteranceSpec("introduction", introduction)]',
            (
                "    first: Phrase = ()\n"
                '    if request.options.greeting == "hello":\n'
                '        first = plain("Hello, robot. ")\n'
                '    utterances = [UtteranceSpec("introduction", first + introduction)]'
            ),
        ),
        ("phrases import Phrase", "phrases import Phrase, plain"),
    ],
}
"""All that is changed in the package to add it: texts and what they become, by file."""


@pytest.fixture(scope="module")
def source_with_the_option(tmp_path_factory):
    """A folder to import `roboirg` from: a copy of the package, changed."""
    source = tmp_path_factory.mktemp("src")
    package = shutil.copytree(Path(roboirg.__file__).parent, source / "roboirg")
    for name, changes in CHANGES_THAT_ADD_THE_OPTION.items():
        text = (package / name).read_text()
        for before, after in changes:
            assert before in text
            text = text.replace(before, after, 1)
        (package / name).write_text(text)
    return source


@pytest.fixture(scope="module")
def python_with_the_option(source_with_the_option):
    """A function that calls Python with words, with the changed copy, and returns what is
    printed."""

    def call(words):
        place = str(source_with_the_option)
        return print_of_python(*words.split(), cwd=place, PYTHONPATH=place, COLUMNS="200")

    return call


@pytest.fixture(scope="module")
def run_with_hello(python_with_the_option, tmp_path_factory):
    """The folder of a run whose plan has `greeting: hello`: an episode in *explicit* and one in
    *direct*."""
    run = tmp_path_factory.mktemp("runs") / "run"
    plan = plan_file(
        tasks="PickXtimes", settings="explicit,direct", greeting="hello", max_steps=2, episodes=1
    )
    python_with_the_option(f"-m roboirg run --plan {plan} --policy random --workers 0 --out {run}")
    return run


def test_a_new_instruction_option_is_one_of_commands_and_changes_the_words(python_with_the_option):
    """In a copy of the package an option `greeting` is added: a field, and in the setting *direct*
    code that begins with "Hello, robot." if it is `hello`. The command line needs no more."""
    printed = python_with_the_option(
        "-m roboirg show PickXtimes 0 --words --settings direct --greeting hello"
    )

    assert printed.count("Hello, robot.") == 1


def test_a_new_instruction_option_is_a_field_of_plans_with_its_explanation(python_with_the_option):
    """In a copy of the package the option `greeting` is added, with a description. A plan that sets
    it is printed with that description as a comment above."""
    plan = plan_file(greeting="hello")

    printed = python_with_the_option(f"-m roboirg run --plan {plan} --show-plan")

    assert "# hello: the robot is greeted; or plain.\ngreeting: hello" in printed


def test_a_new_instruction_option_is_recorded_where_the_setting_reads_it(run_with_hello):
    """In a copy of the package the option `greeting` is added, and only the setting *direct* reads
    it. A run with `greeting: hello` records that there, with the words, and the default, `plain`,
    in the setting *explicit*."""
    lines = (run_with_hello / "records.jsonl").read_text().splitlines()
    records = {}
    for record in map(json.loads, lines):
        records[record["options"]["setting"]] = record

    assert records["direct"]["options"]["greeting"] == "hello"
    assert records["direct"]["instruction"][0]["text"].startswith("Hello, robot.")
    assert records["explicit"]["options"]["greeting"] == "plain"


def test_tables_name_a_new_instruction_option_next_to_its_setting(
    python_with_the_option, run_with_hello
):
    """The run was played by a copy of the package with a new option, `greeting`, and has set it to
    `hello`, which the setting *direct* reads."""
    tables = python_with_the_option(f"-m roboirg tables {run_with_hello}")

    assert "direct (greeting hello)" in tables
