"""Words from outside: the import from a repository with RoboMME's interface."""

import dataclasses
import functools
import re
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner
from wording_stand_ins import (
    STYLES,
    TASKS,
    make_clone,
    same_number,
    sentence,
    train_episodes,
    train_goals,
)

from roboirg import main as cli
from roboirg.apps.language_lab.robomme import goal_sentences, robomme_import
from roboirg.apps.language_lab.robomme.template_search import find_templates
from roboirg.apps.language_lab.robomme.wording_writer import wording_text
from roboirg.apps.language_lab.validation.episode_checks import check_episode
from roboirg.core.episode import COLORS, Goal
from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import FORMS, Instruction, expressible, instruct_with
from roboirg.language.slot_types.number import SAME_NUMBER
from roboirg.language.variants import expressible_options
from roboirg.language.worded_command import TaskWordings, Wordings, goal_fields
from roboirg.language.wordings import wording_store
from roboirg.language.wordings.wording_file import parse_wordings
from roboirg.language.wordings.wording_store import register_wordings
from roboirg.reader import interpret
from roboirg.tasks import all_tasks, get_task


@functools.cache
def imported(style: str) -> robomme_import.ImportedWordings:
    """The import of a stand-in; its wordings are open."""
    with tempfile.TemporaryDirectory() as folder:
        found = robomme_import.import_robomme(make_clone(Path(folder), style), "stand-in")
    register_wordings(found.wordings)
    return found


@functools.cache
def imported_task(style: str, task: str) -> Wordings:
    """The import of one task of a stand-in; open."""
    with tempfile.TemporaryDirectory() as folder:
        say = goal_sentences.load_function(make_clone(Path(folder), style))
    found = robomme_import._TaskImport(all_tasks()[task], say).run()
    wordings = Wordings(style, task, {task: found})
    register_wordings(wordings)
    return wordings


def import_task(task: str, say) -> tuple[TaskWordings | None, list]:
    """The import of one task from a function, with what it refused."""
    importer = robomme_import._TaskImport(all_tasks()[task], lambda self, _env: say(self))
    return importer.run(), importer.refused


def opened(task: str, commands: TaskWordings) -> str:
    """The identity of open wordings with one task."""
    return register_wordings(Wordings("own", task, {task: commands}))


def check_sentences(style: str, task: str, wordings: Wordings) -> None:
    """Check that every goal of a task is stated in the sentence of the source."""
    for goal in train_goals(task):
        command = wordings.tasks[task].find(goal)
        assert command is not None, goal
        assert command.state(goal) == sentence(style, task, goal)


@pytest.mark.slow
@pytest.mark.parametrize("style", STYLES)
def test_every_task_is_imported_with_all_settings(style):
    found = imported(style)
    assert not found.refused
    assert tuple(found.wordings.tasks) == TASKS
    assert not any(one.own for one in found.wordings.tasks.values())
    for task in TASKS:
        check_sentences(style, task, found.wordings)


@pytest.mark.parametrize(
    ("style", "task"),
    [
        ("sentences_in_words", "PickXtimes"),
        ("sentences_in_digits", "VideoPlaceOrder"),
        ("sentences_in_digits", "VideoRepick"),
    ],
)
def test_every_goal_has_the_sentence_of_the_source(style, task):
    check_sentences(style, task, imported_task(style, task))


@pytest.mark.slow
@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("task", TASKS)
def test_every_instruction_is_valid(style, task):
    identity = imported(style).wordings.identity
    for episode in train_episodes(task, 40, 52):  # the import looked at others
        found = check_episode(episode, wordings=identity)
        assert not found.failures
        for setting in expressible(episode, wordings=identity):
            for form in FORMS:
                options = InstructionOptions(setting, form, wordings=identity)
                said = instruct_with(episode, options)
                read = interpret(said.text, episode.scene, task)
                assert (read.goals, read.not_understood) == ((episode.goal,), ()), said.text
                assert said.metadata["wordings"] == identity
                assert said.metadata["command"] in {
                    one.text for one in imported(style).wordings.tasks[task].commands
                }
        explicit = instruct_with(episode, InstructionOptions(wordings=identity))
        assert explicit.text == sentence(style, task, episode.goal, episode.difficulty)


@pytest.mark.slow
def test_referring_expressions_take_the_place_of_the_phrases():
    identity = imported("sentences_in_words").wordings.identity

    def said(task: str, setting: str, **wanted) -> Instruction:
        episode = next(
            one
            for one in train_episodes(task, 0, 100)
            if wanted.items() <= one.goal.as_mapping().items()
        )
        return instruct_with(episode, InstructionOptions(setting, wordings=identity))

    def command(task: str, setting: str, **wanted) -> str:
        return said(task, setting, **wanted).command

    once = said("PickXtimes", "direct", repeats=1)
    assert once.command == (
        f"grab it and set it on the target, repeating this action {same_number(once)}, "
        "then press the button to stop"
    )
    assert command("PickXtimes", "spatial", repeats=3) == (
        "grab the cube there and set it on the target, repeating this action three times, "
        "then press the button to stop"
    )
    assert command("StopCube", "direct") == (
        "press the button so that the cube stops on the target when it arrives during that visit"
    )
    hidden = command("VideoUnmask", "direct", colors=("red",))
    assert re.fullmatch(
        f"watch the video, then pick up the container that hides {POINTED}", hidden
    ), hidden
    assert command("BinFill", "direct", counts=(1, 1)) == (
        "drop that many of the former and that many of the latter into the bin, "
        "then press the button to stop"
    )
    identity = imported("sentences_in_digits").wordings.identity
    assert command("VideoUnmask", "spatial", colors=("red",)) == "Lift the container there"


POINTED = (
    r"(?:it|the former|the latter|the \w+ of them|the \w+ one|that cube"
    r"|the one I mentioned earlier|the .*cube.*)"
)
"""Words for a thing, as a regular expression."""

COUNTED = r"(?:[^.]*\b(?:take|add)\b[^.]*\. )?"
"""A calculation of open reasoning, which is a sentence before the command."""
UNSPOILED = {
    "StopCube": (
        rf"{COUNTED}Use the button to stop the cube exactly as it reaches the target "
        r"(?:during (?:that visit|the (?:visit|other) .*|the .* visit but not .*)"
        r"|(?:one|two) visits? (?:earlier|later) than .*)"
    ),
    "VideoRepick": (
        rf"{COUNTED}Pick up and put back down the cube that was picked up in the video, "
        r"doing so .*, then press the button"
    ),
    "VideoPlaceOrder": (
        rf"{COUNTED}After watching the video, place {POINTED} on "
        r"the target (?:of (?:that placement|the (?:other )?placement(?: (?!.* it was ).*)?"
        r"|the (?:.* placement but not .*|placement with that number))"
        r"|used (?:one|two) placements? (?:earlier|later) than .*)\."
    ),
    "VideoPlaceButton": (
        rf"After watching the video, place {POINTED} on "
        r"the target (?:used (?:then|at .*)"
        r"|of the placement (?:just before or after|closest in time to) .*)\."
    ),
}
"""Good English around a referring expression, in the sentences that are hardest to fill."""
HARDEST = tuple(UNSPOILED)


def pointed_commands(task: str, last: int) -> Iterator[Instruction]:
    """The instructions in digits whose command does not state the slot that is no color."""
    wordings = imported_task("sentences_in_digits", task)
    for episode in train_episodes(task, 0, last):
        (slot,) = set(episode.goal.as_mapping()) - {"color"}
        stated = wordings.tasks[task].phrase(episode.goal, slot)
        for options in expressible_options(episode, wordings.identity):
            said = instruct_with(episode, options)
            once = slot == "repeats" and "again" in said.command
            if options.setting != "explicit" and not once and (
                stated is None or stated.text not in said.command
            ):  # fmt: skip
                yield said


@pytest.mark.parametrize("task", HARDEST)
def test_no_expression_spoils_the_sentence_around_it(task):
    said = list(pointed_commands(task, 8))
    assert {(one.setting, one.form) for one in said} >= {
        ("direct", "implicit"),
        ("contextual", "implicit"),
        *(("reasoning", form) for form in FORMS),
    }
    for one in said:
        assert one.metadata["command"] != "own"
        assert re.fullmatch(UNSPOILED[task], one.command, re.IGNORECASE), one.command


@pytest.mark.slow
@pytest.mark.parametrize("task", HARDEST)
def test_no_expression_spoils_the_sentence_in_any_training_episode(task):
    commands = {one.command for one in pointed_commands(task, 100)}
    assert len(commands) > 20
    assert not [one for one in commands if not re.fullmatch(UNSPOILED[task], one, re.IGNORECASE)]


@pytest.mark.parametrize(
    ("task", "commands"),
    [
        (
            "StopCube",
            {"Use the button to stop the cube exactly as it reaches the target during that visit"},
        ),
        (
            "VideoRepick",
            {
                "Pick up and put back down the cube that was picked up in the video, doing so "
                f"{words}, then press the button"
                for words in SAME_NUMBER.train
            },
        ),
        (
            "VideoPlaceOrder",
            {"After watching the video, place @ on the target of that placement."},
        ),
        (
            "VideoPlaceButton",
            {
                f"After watching the video, place @ on the target used {moment}."
                for moment in ("then", "at that moment")
            },
        ),
    ],
)
def test_the_direct_command_is_good_english(task, commands):
    direct = InstructionOptions(
        "direct", wordings=imported_task("sentences_in_digits", task).identity
    )
    found = {instruct_with(one, direct).command for one in train_episodes(task, 0, 12)}
    assert {re.sub(rf"place {POINTED} on", "place @ on", one) for one in found} == commands


def test_a_pronoun_stands_between_verb_and_particle():
    found, refused = import_task(
        "PickXtimes",
        lambda self: (
            f"pick up the {self.target_color_name} cube, place it on the target "
            f"{self.num_repeats} times, then press the button"
        ),
    )
    assert found is not None
    assert (refused, found.own) == ([], frozenset())
    identity = opened("PickXtimes", found)
    said = next(
        one for episode in train_episodes("PickXtimes", 0, 50)
        if "it" in map((one := instruct_with(
            episode, InstructionOptions("direct", wordings=identity)
        )).span, one.mentions)
    )  # fmt: skip
    assert said.command == (
        f"pick it up, place it on the target {same_number(said)}, then press the button"
    )
    assert [said.span(one) for one in said.mentions if one.utterance == 1] == [
        "it",
        same_number(said),
    ]


@pytest.mark.slow
def test_an_unreadable_template_is_refused_with_its_reason(tmp_path, monkeypatch):
    tasks = {name: all_tasks()[name] for name in ("StopCube", "VideoRepick")}
    monkeypatch.setattr(robomme_import, "all_tasks", lambda: tasks)
    clone = make_clone(tmp_path, "sentences_in_words")
    file = clone / goal_sentences.FILE
    text = file.read_text()
    assert "press the button so that the cube stops" in text
    file.write_text(text.replace("press the button so that the cube stops", "juggle the cube"))
    out = tmp_path / "out.toml"
    call = CliRunner().invoke(
        cli.app, ["language", "import-robomme", str(clone), "--out", str(out), "--name", "stand-in"]
    )
    assert isinstance(call.exception, RoboIRGError)  # main() prints it, exit code 2
    assert str(call.exception) == f"1 template could not be read back; {out} has the rest."
    assert 'does not know the verb "juggle"' in call.stderr
    assert "Refused StopCube (any visit)" in call.stderr
    lines = out.read_text().splitlines()
    assert "[StopCube]" not in lines
    assert "[VideoRepick]" in lines


def test_words_that_no_expression_can_replace_leave_our_own_commands():
    ordinals = ["", "first", "second", "third", "fourth"]
    found, refused = import_task(
        "VideoPlaceOrder",
        lambda self: (
            f"watch the video and put the {self.target_color_name} cube "
            f"where it was placed {ordinals[self.which_in_subset]}"
        ),
    )
    assert found is not None
    assert not refused
    assert found.own == {"direct", "contextual", "reasoning"}
    identity = opened("VideoPlaceOrder", found)
    (episode,) = train_episodes("VideoPlaceOrder", 3, 4)
    direct = InstructionOptions("direct", wordings=identity)
    said = instruct_with(episode, direct)
    assert said.metadata["command"] == "own"
    assert said.metadata["wordings"] == identity
    assert said.text == instruct_with(episode, InstructionOptions("direct")).text
    assert (
        instruct_with(episode, dataclasses.replace(direct, setting="explicit")).metadata["command"]
        != "own"
    )


def test_a_form_of_its_own_for_once_is_a_case_of_its_own():
    def say(self) -> str:
        if self.num_repeats == 1:
            return "press the button after you lift the cube of the video and put it down"
        return f"lift the cube of the video and put it down {self.num_repeats} times, then stop"

    found, refused = import_task("VideoRepick", say)
    assert found is not None
    assert not refused
    assert [dict(one.when) for one in found.commands] == [{"repeats": 1}, {}]


def test_a_count_that_is_spread_over_the_sentence_has_no_implicit_form():
    spread = {
        1: "lift the cube of the video once and put it down",
        2: "lift and put down the cube of the video twice",
        3: "three times, lift it, the cube of the video, and put it down",
    }
    found, refused = import_task("VideoRepick", lambda self: spread[self.num_repeats])
    assert found is not None
    assert not refused
    assert [(dict(one.when), one.text) for one in found.commands] == [
        ({"repeats": repeats}, text) for repeats, text in spread.items()
    ]
    identity = opened("VideoRepick", found)
    for episode in train_episodes("VideoRepick", 0, 4):
        explicit = instruct_with(episode, InstructionOptions(wordings=identity))
        assert explicit.text == spread[episode.goal.number("repeats")]
        said = instruct_with(episode, InstructionOptions("direct", wordings=identity))
        assert said.metadata["command"] == "own"
        assert said.text == instruct_with(episode, InstructionOptions("direct")).text


@pytest.mark.parametrize(
    ("say", "reason"),
    [
        (lambda self: self.unheard_of, "get_language_goal raised AttributeError"),
        (lambda _self: None, "get_language_goal returned [None], not a list of sentences"),
        (lambda _self: "put {it} there", "has brackets"),
        (lambda _self: "", "is empty"),
        (lambda _self: "soulève-le", "is not printable ASCII on one line"),
        (lambda self: f"lift it, this is {self.difficulty}", "depends on the difficulty"),
    ],
)
def test_an_unusable_sentence_refuses_the_task(say, reason):
    found, refused = import_task("VideoRepick", lambda self: [say(self)])
    assert found is None
    assert [(one.task, one.case) for one in refused] == [("VideoRepick", "all goals")]
    assert reason in refused[0].reason


def test_a_sentence_that_does_not_tell_the_goal_is_refused():
    found, refused = import_task("VideoRepick", lambda _self: "lift the cube of the video")
    # It is read as once.
    assert found is not None
    assert [dict(one.when) for one in found.commands] == [{"repeats": 1}]
    assert [(one.case, one.reason) for one in refused] == [
        (
            f"repeats {repeats}",
            "'lift the cube of the video': the interpreter finds 1 goal: repeats 1",
        )
        for repeats in (2, 3)
    ]


def test_the_reason_is_of_the_first_goal():
    def say(self) -> str:
        return f"juggle the {self.target_color_name} cube {self.num_repeats} times"

    found, refused = import_task("PickXtimes", say)
    assert found is None
    (episode,) = train_episodes("PickXtimes", 0, 1)
    first = get_task("PickXtimes").goals(episode.scene)[0]
    sentence = f"juggle the {first['color']} cube {first['repeats']} times"
    (one,) = refused
    assert one.case == "any color, any repeats"
    assert one.reason == f'{sentence!r}: the interpreter: does not know the verb "juggle"'


def test_a_goal_without_a_template_is_refused_once(monkeypatch):
    spread = ["lift the cube of the video once", "lift the cube of the video twice",
              "three times, lift the cube of the video"]  # fmt: skip
    monkeypatch.setattr(robomme_import, "find_templates", lambda told: find_templates(told)[:-1])
    found, refused = import_task("VideoRepick", lambda self: spread[self.num_repeats - 1])
    assert found is not None
    assert refused == [("VideoRepick", "repeats 3", "no template fits")]


def test_a_verb_may_depend_on_the_count():
    def say(self) -> str:
        counts = {color: getattr(self, f"{color}_cubes_target_number") for color in COLORS}
        items = " and ".join(f"{count} {color} cubes" for color, count in counts.items() if count)
        verb = "put" if sum(counts.values()) <= 2 else "drop"
        return f"{verb} {items} into the bin, then press the button"

    found, refused = import_task("BinFill", say)
    assert found is not None
    assert not refused
    read = parse_wordings(wording_text("a", "", {"BinFill": found}), "file").tasks["BinFill"]
    told = [goal for goal in train_goals("BinFill") if found.find(goal) is not None]
    assert told
    for goal in told:
        wanted = say(goal_sentences.stand_in(goal, "hard"))
        assert found.find(goal).state(goal) == read.find(goal).state(goal) == wanted


def test_templates_that_a_file_cannot_keep_apart_are_refused(monkeypatch):
    monkeypatch.setattr(
        robomme_import, "wording_text", lambda *args: wording_text(*args).replace("lift", "grab")
    )
    found, refused = import_task(
        "VideoRepick",
        lambda self: f"lift and put down the cube of the video {self.num_repeats} times",
    )
    assert found is None
    (one,) = refused
    assert (one.task, one.case) == ("VideoRepick", "all goals")
    assert re.fullmatch("the file would give 'grab .*' instead of 'lift .*'", one.reason)


def test_an_import_leaves_no_wordings_open():
    found, _ = import_task(
        "VideoRepick",
        lambda self: f"lift and put down the cube of the video {self.num_repeats} times",
    )
    assert found is not None
    assert not [one for one in wording_store._OPEN if one.startswith("import@")]


def test_all_reasons_are_told_if_nothing_can_be_used(tmp_path):
    clone = make_clone(tmp_path, "sentences_in_words")
    (clone / goal_sentences.FILE).write_text("def get_language_goal(self, env):\n    return ['']")
    out = tmp_path / "out.toml"
    words = ["language", "import-robomme", str(clone), "--out", str(out), "--name", "stand-in"]
    call = CliRunner().invoke(cli.app, words)
    assert isinstance(call.exception, RoboIRGError)
    assert str(call.exception).startswith(f"No sentence of {str(clone)!r} can be used")
    assert call.stderr.count("Refused ") == len(TASKS)
    assert not out.exists()
    # A bad name is told before the work.
    call = CliRunner().invoke(cli.app, [*words, "--name", "a b"])
    assert "has the name 'a b'" in str(call.exception)
    assert "Refused" not in call.stderr


def test_only_one_file_is_loaded_and_nothing_is_left_behind(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    clone = make_clone(tmp_path, "sentences_in_words")
    (clone / "src/robomme/__init__.py").write_text("raise SystemExit")
    before, modules = list(sys.path), set(sys.modules)
    assert callable(goal_sentences.load_function(clone))
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
def test_a_folder_without_the_function_is_told(tmp_path, content, complaint):
    if content is not None:
        file = tmp_path / goal_sentences.FILE
        file.parent.mkdir(parents=True)
        file.write_text(content)
    with pytest.raises(InvalidValueError, match=complaint):
        robomme_import.import_robomme(tmp_path)


COLORED = [
    Goal.of(color=color, repeats=repeats)
    for color in ("red", "green", "blue")
    for repeats in range(1, 6)
]
WORDS = st.lists(st.text("abcde", min_size=1, max_size=3), max_size=3).map(
    lambda words: " ".join(["", *words, ""])
)


@given(WORDS, WORDS, WORDS, st.permutations(range(5)), st.booleans(), st.booleans(), st.booleans())
def test_templates_give_every_sentence_back(before, between, after, names, swapped, once, merged):
    """Whatever the sentences look like, and however values and words depend on each other."""

    def say(goal: Goal) -> str:
        parts = [str(goal["color"]), f"x{names[goal.number('repeats') - 1]}"]
        if swapped:
            parts.reverse()
        if once and goal["repeats"] == 1:
            return f"{before}only {goal['color']}"
        if merged and goal["color"] == "red":
            return f"{after}{''.join(parts)}"
        return f"{before}{parts[0]}{between}{parts[1]}{after}"

    sentences = {goal: say(goal) for goal in COLORED}
    drafts = find_templates(sentences)
    told = [goal for draft in drafts for goal in draft.sentences]
    assert sorted(map(repr, told)) == sorted(map(repr, COLORED))
    for draft in drafts:
        for goal in draft.sentences:
            assert draft.when.items() <= goal.as_mapping().items()
            values = goal_fields(goal)
            words = [draft.tables[name][values[name]] for name in draft.fields]
            pieces = [draft.literals[0]]
            for word, literal in zip(words, draft.literals[1:], strict=True):
                pieces += [word, literal]
            assert "".join(pieces) == sentences[goal]
    if not once and not merged:
        assert len(drafts) == 1
