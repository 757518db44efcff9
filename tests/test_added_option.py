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

CHANGES = {
    "core/instruction_options.py": [
        (
            "    delivery: Name = field(",
            (
                "    greeting: Name = field(\n"
                '        default="none",\n'
                '        metadata=described("hello: the robot is greeted; or none."),\n'
                "    )\n"
                "    delivery: Name = field("
            ),
        ),
        ("    delivery: str\n", "    delivery: str\n    greeting: str\n"),
    ],
    "language/settings/direct.py": [
        (
            "    return InstructionSpec((introduction(request), command(request)))",
            (
                "    first = introduction(request)\n"
                '    if request.options.greeting == "hello":\n'
                '        greeting = plain("Hello, robot. ")\n'
                '        first = UtteranceSpec("introduction", (*greeting, *first.phrase))\n'
                "    return InstructionSpec((first, command(request)))"
            ),
        ),
        ("phrases import sentences", "phrases import plain, sentences"),
        ('reads=frozenset({"delivery"})', 'reads=frozenset({"delivery", "greeting"})'),
    ],
}
"""All that is changed in the package to add it: texts and what they become, by file."""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    folder = tmp_path / "src" / "roboirg"
    shutil.copytree(Path(roboirg.__file__).parent, folder)
    for name, changes in CHANGES.items():
        text = (folder / name).read_text()
        for before, after in changes:
            assert before in text
            text = text.replace(before, after, 1)
        (folder / name).write_text(text)
    return folder.parent


@pytest.mark.sim
@pytest.mark.slow
def test_an_added_option_reaches_words_commands_plans_records_and_tables(
    package: Path, tmp_path: Path
) -> None:
    def python(*words: object) -> str:
        done = subprocess.run(
            [sys.executable, *map(str, words)], capture_output=True, text=True, check=False,
            cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(package), "COLUMNS": "200"},
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout

    def command(*words: object) -> str:
        return python("-m", "roboirg", *words)

    few = ("--tasks", "PickXtimes", "--settings", "explicit,direct")
    shown = command("show", "PickXtimes", 0, "--words", "--greeting", "hello")
    assert shown.count("Hello, robot.") == 1
    plan = plan_file(greeting="hello", max_steps=2, episodes=1)
    assert "# hello: the robot is greeted; or none.\ngreeting: hello" in command(
        "run", "--plan", plan, "--show-plan"
    )
    run = tmp_path / "run"
    command("run", "--plan", plan, *few, "--policy", "random", "--workers", 0, "--out", run)
    records = [json.loads(line) for line in (run / "records.jsonl").read_text().splitlines()]
    said = {one["options"]["setting"]: one["options"]["greeting"] for one in records}
    assert said == {"direct": "hello", "explicit": "none"}
    assert records[0]["instruction"][0]["text"].startswith("Hello, robot.")
    assert "direct (greeting hello)" in command("tables", run)
    rows = tmp_path / "rows.jsonl"
    command("export", "instructions", *few, "--plan", plan, "--out", rows)
    assert "Hello, robot." in rows.read_text()
    code = (
        "import roboirg; env = roboirg.make('PickXtimes', setting='direct', greeting='hello', "
        "cameras=()); print(env.instruction.text)"
    )
    assert python("-c", code).startswith("Hello, robot.")
