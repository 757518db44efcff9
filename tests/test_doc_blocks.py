"""Every code block of the documents is executed, or a comment before it says why not.

    <!-- not run: why -->

Blocks of a page run in order, in one folder with a policy and two runs of results that nothing
played. Command lines are checked in any case: commands, options and their names exist.
"""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import NamedTuple

import pytest
import typer.main
from made_records import make_record

from roboirg.main import app, main
from roboirg.records.store import RecordStore
from roboirg.runs.plan.plan_file import read_plan_file
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.plan.stored_plans import write_plan

ROOT = Path(__file__).parent.parent
PAGES_TESTED_ELSEWHERE = ("integrations.md", "training.md")
"""Pages whose blocks tests/apps/integrations run, by `make integrations`."""
PAGES = [
    page
    for page in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(ROOT.glob("docs/*.md")))
    if "```" in page.read_text()
]
LANGUAGES = ("sh", "bash", "python", "toml", "yaml")
BLOCK = re.compile(
    r"(?:<!-- not run: (?P<why>[^>]+?) -->\n\s*)?"
    r"^ *```(?P<language>\w+)\n(?P<text>.*?)^ *```",
    re.DOTALL | re.MULTILINE,
)


class Block(NamedTuple):
    language: str
    text: str
    why: str | None
    line: int


def blocks_of(page):
    text = page.read_text()
    return [
        Block(
            found["language"],
            found["text"],
            found["why"],
            text[: found.start("text")].count("\n") + 1,
        )
        for found in BLOCK.finditer(text)
        if found["language"] in LANGUAGES
    ]


def command_lines(text):
    """The lines of a script, each with its continuations, without comments and empty ones."""
    joined = re.sub(r"\\\n\s*", "", text).splitlines()
    return [line for line in joined if line.strip() and not line.lstrip().startswith("#")]


def words_of(line):
    """The words behind `roboirg` if a line calls it, else None."""
    found = re.match(r"^\s*(?:\.venv/bin/|(?:\w+=\S+ )*)roboirg (.*)$", line)
    return None if found is None else shlex.split(found[1], comments=True)


def write_run(folder_of_a_reader, lost):
    plan = make_plan(
        ["listener", "forgetful"], tasks="PickXtimes,VideoUnmask", forms="implicit,resolved",
        episodes="2",
    )  # fmt: skip
    with RecordStore(folder_of_a_reader) as store:
        for job in plan.jobs():
            if job.policy == "listener" or (job.setting == "explicit" and job.episode != lost):
                store.append(make_record(job, "success"))
            else:
                store.append(make_record(job, "failure", "wrong"))
    write_plan(plan, folder_of_a_reader)


@pytest.fixture(scope="module")
def folder_of_runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages") / "runs"
    for lost, name in enumerate(("first", "second", "a", "b")):
        write_run(folder / name, lost)
    return folder


@pytest.fixture
def folder_of_a_reader(folder_of_runs, tmp_path, monkeypatch):
    policy = next(
        block.text for block in blocks_of(ROOT / "README.md") if "class MyPolicy" in block.text
    )
    (tmp_path / "my_policy.py").write_text(policy)
    shutil.copytree(folder_of_runs, tmp_path / "runs")
    (tmp_path / "results").symlink_to(ROOT / "results")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield tmp_path
    sys.modules.pop("my_policy", None)


def run_script(text, folder_of_a_reader, monkeypatch):
    """Run the lines of a script: `roboirg` in this process, the others in a shell."""
    for line in command_lines(text):
        words = words_of(line)
        if words is None:
            subprocess.run(["bash", "-ec", line], cwd=folder_of_a_reader, check=True)
            continue
        monkeypatch.setattr(sys, "argv", ["roboirg", *words])
        with pytest.raises(SystemExit) as left:
            main()
        assert not left.value.code, line


@pytest.fixture
def run_block(folder_of_a_reader, monkeypatch):
    """Executes a block where the reader is, after those before it; what fails is an error.

    A block that begins with a comment such as `# plan.yaml` is first written to that file.
    """
    monkeypatch.setattr(sys, "stdin", [])
    namespace = {"__name__": "page"}

    def run(block, page_name):
        named = re.match(r"# ([\w-]+\.\w+)\n", block.text)
        if named is not None:
            Path(named[1]).write_text(block.text)
        match block.language:
            case "python":
                code = compile(block.text, f"{page_name}:{block.line}", "exec")
                exec(code, namespace)  # noqa: S102 - our own documents
            case "toml":
                tomllib.loads(block.text)
            case "yaml":
                assert named is not None
                read_plan_file(named[1])
            case _:
                run_script(block.text, folder_of_a_reader, monkeypatch)

    return run


@pytest.mark.slow
@pytest.mark.sim
@pytest.mark.parametrize(
    "page",
    [page for page in PAGES if page.name not in PAGES_TESTED_ELSEWHERE],
    ids=lambda page: page.name,
)
def test_the_code_blocks_of_a_page_run_in_order_without_an_error(page, run_block):
    """An exception, an exit status other than 0, or a plan file that is refused is an error."""
    for block in blocks_of(page):
        if block.why is None:
            run_block(block, page.name)


def commands_of(page):
    """The lines of a page that call `roboirg`."""
    return [
        line
        for block in blocks_of(page)
        if block.language in ("sh", "bash")
        for line in command_lines(block.text)
        if words_of(line) is not None
    ]


def check_command(command, words):
    """Raise an error if a command does not exist, or does not take these words."""
    rest = words
    while hasattr(command, "commands"):
        assert rest[0] in command.commands, f"there is no command {rest[0]}"
        command, rest = command.commands[rest[0]], rest[1:]
    # It parses: all options exist, have values, and nothing is left over.
    with command.make_context("roboirg", rest):
        pass


COMMAND_LINES = [(page.name, line) for page in PAGES for line in commands_of(page)]


def test_the_documents_have_more_than_a_hundred_roboirg_commands():
    assert len(COMMAND_LINES) > 100


def test_every_roboirg_command_in_the_documents_exists_with_its_options():
    """Also in blocks that are not run."""
    wrong = []
    for page, line in COMMAND_LINES:
        try:
            check_command(typer.main.get_command(app), words_of(line))
        except Exception as error:  # noqa: BLE001 - typer has its own, by its version
            wrong.append(f"{page}: {line}: {error!r}")

    assert wrong == []


@pytest.fixture
def reasons():
    """Why blocks are not run, of all blocks but those that are tested elsewhere; None if one is."""
    found = []
    for page in PAGES:
        if page.name not in PAGES_TESTED_ELSEWHERE:
            found += [block.why for block in blocks_of(page)]
    return found


def test_code_blocks_that_are_not_run_give_a_reason_of_more_than_a_word(reasons):
    for why in filter(None, reasons):
        assert len(why.split()) > 1, why


def test_at_most_three_of_four_code_blocks_are_not_run(reasons):
    """More would mean that marking is a habit."""
    assert reasons.count(None) >= 0.25 * len(reasons)
