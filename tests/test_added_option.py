"""A further option of instructions is a field and the code that reads it; all else follows."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from plan_files import plan_file

import roboirg

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


CALL_COMMANDS = """
import contextlib, io, json, sys
import roboirg
from roboirg.main import main

told = []
for words in json.loads(sys.argv[1]):
    sys.argv = ["roboirg", *map(str, words)]
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.suppress(SystemExit):
        main()
    told.append(out.getvalue())
env = roboirg.make("PickXtimes", setting="direct", greeting="hello", cameras=())
print(json.dumps([*told, env.instruction.text]))
"""


@pytest.fixture
def source_with_the_option(tmp_path):
    folder = tmp_path / "src" / "roboirg"
    shutil.copytree(Path(roboirg.__file__).parent, folder)
    for name, changes in CHANGES_THAT_ADD_THE_OPTION.items():
        text = (folder / name).read_text()
        for before, after in changes:
            assert before in text
            text = text.replace(before, after, 1)
        (folder / name).write_text(text)
    return folder.parent


@pytest.mark.sim
@pytest.mark.slow
def test_a_new_instruction_option_reaches_words_commands_plans_records_and_tables(
    source_with_the_option, tmp_path
):
    """The option `greeting` is added to a copy of the package, as a field and the code that reads
    it in the setting *direct*. A process calls five commands there, and what each has printed
    comes back in order; the greeting "Hello, robot." must be in all of them."""
    few = ("--tasks", "PickXtimes", "--settings", "explicit,direct")
    plan = plan_file(greeting="hello", max_steps=2, episodes=1)
    run, rows = tmp_path / "run", tmp_path / "rows.jsonl"
    commands = [
        ("show", "PickXtimes", 0, "--words", "--settings", "direct", "--greeting", "hello"),
        ("run", "--plan", plan, "--show-plan"),
        ("run", "--plan", plan, *few, "--policy", "random", "--workers", 0, "--out", run),
        ("tables", run),
        ("export", "instructions", *few, "--plan", plan, "--out", rows),
    ]
    done = subprocess.run(
        [sys.executable, "-c", CALL_COMMANDS, json.dumps(commands, default=str)],
        capture_output=True, text=True, check=False, cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(source_with_the_option), "COLUMNS": "200"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    shown, planned, _, tables, _, made = json.loads(done.stdout)
    assert shown.count("Hello, robot.") == 1
    assert "# hello: the robot is greeted; or plain.\ngreeting: hello" in planned
    records = [json.loads(line) for line in (run / "records.jsonl").read_text().splitlines()]
    said = {record["options"]["setting"]: record["options"]["greeting"] for record in records}
    assert said == {"direct": "hello", "explicit": "plain"}
    assert records[0]["instruction"][0]["text"].startswith("Hello, robot.")
    assert "direct (greeting hello)" in tables
    assert "Hello, robot." in rows.read_text()
    assert made.startswith("Hello, robot.")
