"""The command line stays small, and the help of every command is short and has an example."""

import contextlib
import functools
import io
import re
import shlex
from typing import get_type_hints

import count_commands
import pytest
import typer.main
from all_commands import all_commands

from roboirg.core.instruction_options import (
    OPTION_NAMES,
    InstructionKeywords,
)
from roboirg.main import app
from roboirg.runs.plan.plan_fields import plan_options
from roboirg.runs.plan.plan_file import plan_text, read_plan_file
from roboirg.runs.plan.plan_maker import make_plan


@functools.cache
def help_of(name, columns):
    """Return the help of a command in a terminal of so many columns."""
    printed = io.StringIO()
    with (
        pytest.MonkeyPatch.context() as patch,
        contextlib.redirect_stdout(printed),
        contextlib.suppress(SystemExit),
    ):
        patch.setenv("COLUMNS", str(columns))
        patch.setattr("typer.rich_utils.MAX_WIDTH", columns)
        typer.main.get_command(app).main([*name.split(), "--help"], "roboirg")
    return printed.getvalue()


def test_the_number_of_commands_and_parameters_stays_below_its_limits():
    """`count_commands` counts those of the program as it is, and has the limits."""
    found = count_commands.commands()
    assert count_commands.entries() <= count_commands.MOST_ENTRIES
    assert len(found) - 1 <= count_commands.MOST_COMMANDS
    assert sum(len(command.parameters) for command in found) <= count_commands.MOST_PARAMETERS


every_command = pytest.mark.parametrize("name", sorted(all_commands()))


def test_help_is_short():
    """45 lines of 100 columns; 60 of the command *run*, which has the most options."""
    for name in all_commands():
        lines = help_of(name, 100).strip().splitlines()

        assert len(lines) <= (60 if name == "run" else 45), name


@every_command
def test_help_has_an_example_that_the_command_takes(name):
    """Each help text has one line, "Example: roboirg ...". It begins with the name of the command,
    and its options are parsed as the command would."""
    text = help_of(name, 100)

    (example,) = re.findall(r"Example: roboirg (.*)", text)

    own = name.split()
    words = shlex.split(example)
    assert words[: len(own)] == own
    all_commands()[name].make_context(name, words[len(own) :])  # refuses what it does not take


@every_command
def test_help_cuts_no_word_and_is_no_wider_than_the_terminal(name):
    """But addresses, which are written scheme://…."""
    text = help_of(name, 80)

    assert max(map(len, text.splitlines())) <= 80
    assert not re.search(r"(?<!://)…", text)


def test_help_names_all_options():
    """Of every command, in a terminal of 80 columns."""
    for name, command in all_commands().items():
        options = set()
        for parameter in command.params:
            options.update(parameter.opts, parameter.secondary_opts)

        named = set(help_of(name, 80).split())

        assert {option for option in options if option.startswith("-")} <= named, name


@pytest.mark.parametrize("episodes", ["3,0-2,7", "7,"])  # 7 alone would be the first seven
def test_a_plan_written_as_yaml_is_read_back_the_same(tmp_path, episodes):
    """Options of all kinds differ from their defaults: lists, numbers, words. The plan is written
    to a file, and a plan made of the file's fields must equal it."""
    plan = make_plan(
        ["oracle", "bär=listener"], tasks="PickXtimes,VideoUnmask", settings="direct,contextual",
        forms="implicit,resolved", episodes=episodes, stages="1,5;1-5", distractors=3,
        delivery="turns", frame="camera", observe_every=4, demonstration_frames="none",
        video="failures", devices="0,1", retry_on="none", wordings="train",
    )  # fmt: skip

    (tmp_path / "plan.yaml").write_text(plan_text(plan))
    fields = read_plan_file(str(tmp_path / "plan.yaml"))

    assert make_plan(fields.pop("policies"), **fields) == plan


def test_a_plan_written_as_yaml_has_every_option_with_its_help_as_a_comment():
    """The file is what a user edits, so each option of a plan stands in it, set or not, below
    comment lines, `# ...`, with its help, which may be broken over several."""
    text = plan_text(make_plan(["oracle"]))
    without_line_breaks = " ".join(text.replace("\n# ", " ").split())

    for option in plan_options():
        assert f"\n{option.name}:" in text
        assert option.help in without_line_breaks


def test_a_plan_written_as_yaml_keeps_letters_beyond_ascii():
    """YAML would allow escapes such as "\\xE4", which no user could read."""
    assert "bär=listener" in plan_text(make_plan(["bär=listener"]))


def test_every_option_of_instructions_is_a_keyword_and_an_option_of_the_command_show():
    """The fields of instruction options are the keywords of `roboirg.make`, and the command *show*
    has each as an option, but for setting, form and delivery."""
    assert set(get_type_hints(InstructionKeywords)) == set(OPTION_NAMES)

    (shown,) = (
        command.parameters for command in count_commands.commands() if command.words == "show"
    )
    own = {"setting", "form", "delivery"}
    assert {f"--{name}" for name in OPTION_NAMES if name not in own} <= set(shown)
