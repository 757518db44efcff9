"""Wording files: whole sentences, commands and scenarios of a user's, bad files, and identity."""

import contextlib
import itertools
import re
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner
from wording_stand_ins import take_words, train_episodes

from roboirg import main as cli
from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import POOLS
from roboirg.language import FORMS, instruct, instruct_with, open_wordings, token_counts
from roboirg.language.generator import find_refusal
from roboirg.language.instruction_row import row
from roboirg.language.meaning import command_goals
from roboirg.language.request import values_of_goal
from roboirg.language.scenarios.identity import words_digest, words_of
from roboirg.language.scenarios.scenario import REMARKS
from roboirg.language.scenarios.wording_file import parse_wordings, read_wordings
from roboirg.language.scenarios.wording_store import find_wordings, register_wordings
from roboirg.language.settings import settings_of
from roboirg.shortcuts.command_chance import blind_goals, goals_of_command, understood_goals
from roboirg.tasks import get_task, goals_of
from roboirg.tasks.splits.splits import get_episode

PAGE = (Path(__file__).parents[2] / "docs/wording-files.md").read_text()
COMMAND_FILE_OF_THE_PAGE, SENTENCE_FILE_OF_THE_PAGE = re.findall(
    r"```toml\n(.*?)```", PAGE, re.DOTALL
)
"""The page's examples: a command and scenarios; a whole sentence."""
SENTENCE = "lift the {0} cube to the target, repeat {1}"
HEAD = 'name = "hand"\ntasks = ["PickXtimes"]\n'
SCENARIO = """
[[scenario]]
frame = "dusty"
setting = "spatial"
introduction = "It's dusty {place:spot}."
say.color = ["the cube <there place: there>"]
"""


def literal(color, repeats, text=SENTENCE):
    """Return the table of a sentence."""
    when = f'when = {{ repeats = {repeats}, color = "{color}" }}'
    return f'[[literal]]\ntask = "PickXtimes"\n{when}\ntext = "{text.format(color, repeats)}"\n'


SIX_SENTENCES = HEAD + "".join(
    literal("red", number) + literal("blue", number) for number in (1, 2, 3)
)


def identity_of(text):
    """Return the identity of open wordings."""
    return register_wordings(parse_wordings(text, "words.toml"))


def episode_with(task, **slots):
    """Return a training episode with such a goal."""
    return next(
        episode
        for episode in train_episodes(task, 0, 100)
        if slots.items() <= episode.goal.as_mapping().items()
    )


def options_of(task, **changes):
    """Yield options for every setting and form of a task, if it can express the episode."""
    for setting in settings_of(get_task(task)):
        for form in FORMS:
            yield InstructionOptions(setting, form, **changes)


def test_a_sentence_of_a_user_s_file_is_said_in_the_explicit_setting_only():
    """A wording file may bring a whole sentence for a goal; other settings keep our words."""
    identity = identity_of(SIX_SENTENCES)
    episode = episode_with("PickXtimes", color="red", repeats=2)
    for ours in options_of("PickXtimes"):
        if find_refusal(episode, ours) is not None:
            continue
        said = instruct_with(episode, replace(ours, wordings=identity))
        exported = row(episode, said)
        assert (said.metadata["wordings"], exported["wordings"]) == (identity, identity)
        assert exported["whole_sentence"] == said.metadata["command"]
        if ours.setting == "explicit":
            assert said.text == said.metadata["command"] == SENTENCE.format("red", 2)
            assert said.metadata["hidden_slots"] == 0
        else:
            own = instruct_with(episode, ours)
            assert (said.turns, said.mentions) == (own.turns, own.mentions)
            assert said.metadata["command"] == "own"


def test_a_goal_without_a_sentence_in_a_user_s_file_is_refused_in_explicit():
    """The file has sentences for red and blue cubes; the goal is a green one."""
    identity = identity_of(SIX_SENTENCES)
    episode = episode_with("PickXtimes", color="green", repeats=2)
    complaint = (
        f"{identity} has no sentence of PickXtimes for the goal: green, twice; leave explicit out"
    )

    with pytest.raises(InvalidValueError, match=complaint):
        instruct(episode, wordings=identity)
    assert instruct(episode, "direct", wordings=identity).text


def test_a_user_s_sentences_can_serve_a_task_that_has_no_words_of_ours(monkeypatch):
    take_words(monkeypatch, "VideoRepick")
    slots = "when = { repeats = 2 }"
    head = 'name = "a"\ntasks = ["VideoRepick"]\n'
    identity = identity_of(f'{head}[[literal]]\ntask = "VideoRepick"\n{slots}\ntext = "go"')
    goal = next(iter(find_wordings(identity).tasks["VideoRepick"].literals))

    episode = replace(episode_with("VideoRepick"), goal=goal)

    assert instruct(episode, wordings=identity).text == "go"
    with pytest.raises(InvalidValueError, match="VideoRepick names no file of words"):
        instruct(episode, "direct", wordings=identity)


def test_a_sentence_given_for_two_goals_means_both():
    """*Do the usual with the red cube* stands for once and for twice."""
    several = "do the usual with the {0} cube"
    identity = identity_of(
        HEAD + literal("red", 1, several) + literal("red", 2, several) + literal("blue", 1)
    )
    episode = episode_with("PickXtimes", color="red", repeats=1)
    said = instruct(episode, wordings=identity)

    wanted = {
        goal for goal in goals_of(episode) if goal["color"] == "red" and goal["repeats"] in (1, 2)
    }

    for goals in (understood_goals, goals_of_command, blind_goals):
        assert set(goals(said, episode)) == wanted


def test_the_example_file_of_the_documentation_passes_the_check_and_is_spoken(tmp_path):
    """Whoever follows the page sees what it promises."""
    assert len(PAGE.split()) <= 950

    file = tmp_path / "mine.toml"
    file.write_text(COMMAND_FILE_OF_THE_PAGE)
    checked = CliRunner().invoke(
        cli.app, ["language", "check-scenarios", str(file), "--seeds", "0"]
    )
    assert checked.exit_code == 0, checked.output
    assert "explicit (PickXtimes)" in checked.output
    assert "photos (PickXtimes, direct, both pools)" in checked.output

    identity = open_wordings(file)
    assert re.fullmatch("workshop@[0-9a-f]{8}", identity)

    told = {}
    for episode in train_episodes("PickXtimes", 0, 100):
        for setting, form in itertools.product(("explicit", "direct", "contextual"), FORMS):
            said = instruct(episode, setting, form, wordings=identity)
            assert understood_goals(said, episode) == (episode.goal,)
            told[said.text] = said.metadata.get("scenario")
    assert set(told.values()) == {None, "fresh paint", "photos"}

    (shown,) = re.findall(r"\*(We have just\spainted the red cube\.[^*]*)\*", PAGE)
    assert told[shown.replace("\n", " ")] == "fresh paint"


def run_check(file, text):
    """Return what the check of a file prints."""
    file.write_text(text)
    return CliRunner().invoke(cli.app, ["language", "check-scenarios", str(file), "--seeds", "0"])


def test_the_example_commands_of_the_documentation_state_every_goal(tmp_path):
    rows = re.findall(r"\n\| ([A-Z]\w+)[^|]* \| (`[^|]+`) \|", PAGE)
    assert [task for task, _ in rows] == ["SwingXtimes", "StopCube", "BinFill", "VideoUnmask"]

    commands = [f"{task} = {re.findall('`(.*?)`', cell)}" for task, cell in rows]
    head = f'name = "mine"\ntasks = {[task for task, _ in rows]}\n[commands]\n'
    checked = run_check(tmp_path / "mine.toml", head + "\n".join(commands))
    assert checked.exit_code == 0, checked.output
    assert checked.output.count("explicit (") == len(rows)


def test_goals_without_a_sentence_are_listed_but_are_no_error(tmp_path):
    """A file of whole sentences need not cover all goals; at most ten are listed."""
    checked = run_check(tmp_path / "theirs.toml", SENTENCE_FILE_OF_THE_PAGE)
    assert checked.exit_code == 0
    assert "3 goals, such as: on visit 3; on visit 4; on visit 5. Episodes" in checked.output

    many = run_check(tmp_path / "hand.toml", HEAD + literal("red", 2)).output
    (listed,) = re.findall(r"No sentence of 14 goals, such as: (.*)\. Episodes", many)
    assert len(set(listed.split("; "))) == 10

    never = SENTENCE_FILE_OF_THE_PAGE.replace("visit = 2", "visit = 77")
    assert "BROKEN states no goal" in run_check(tmp_path / "theirs.toml", never).output


def test_a_mistake_in_a_command_for_training_and_tests_is_reported_once():
    with pytest.raises(InvalidValueError) as caught:
        parse_wordings(f"{HEAD}[commands]\nall = ['Très {{color}} {{repeats}}.']", "words.toml")
    assert str(caught.value).count("printable ASCII") == 1


def test_words_outside_our_table_have_an_exact_length_with_a_tokenizer_only(tmp_path, monkeypatch):
    """*Juggle* is in no table of token counts; without a tokenizer the length is "at most".

    The check and the command that shows an episode must print the same length.
    """
    file = tmp_path / "mine.toml"
    text = f'{HEAD}[commands]\nall = ["Juggle {{color}} {{repeats}}."]'
    shown = ["show", "PickXtimes", "3", "--words", "--wordings", str(file)]
    for has_tokenizer, bound in ((True, ""), (False, "at most ")):
        if not has_tokenizer:
            monkeypatch.setattr(token_counts, "_tokenizer", lambda: None)
            token_counts.tokens_of.cache_clear()
        longest = re.search(r"  (.*) of 64 tokens; states", run_check(file, text).output)[1]
        assert re.fullmatch(rf"{bound}\d+", longest)
        explicit = CliRunner().invoke(cli.app, [*shown, "--settings", "explicit"]).output
        assert f"({longest} tokens)" in explicit
    token_counts.tokens_of.cache_clear()


def test_the_check_reports_scenes_that_no_scenario_of_the_file_fits(tmp_path):
    """Such an episode is refused in a run; the command that the check prints shows why."""
    file = tmp_path / "mine.toml"
    file.write_text(HEAD + SCENARIO)
    checked = CliRunner().invoke(cli.app, ["language", "check-scenarios", str(file)])
    assert isinstance(checked.exception, RoboIRGError)

    found = re.search(
        r"BROKEN PickXtimes: spatial has no scenario that fits \d+ scenes, such as "
        r"PickXtimes/(\w+)/(\d+) \(\w+, .*\), so a run refuses them; see why with "
        r"`roboirg (show PickXtimes \2 --split \1 --words --wordings \S+)`, and write one more",
        checked.output,
    )
    shown = CliRunner().invoke(cli.app, found[3].split()).output
    why = r"mine.toml has no spatial scenario for it in the pool \w+: nothing has the place or clue"
    assert re.search(f"spatial cannot express the episode: .*{why}", shown)


def test_the_check_reports_a_command_that_does_not_state_the_goal(tmp_path):
    file = tmp_path / "mine.toml"
    for command, complaint in (
        ('["Lift {color}."]', "has no command of PickXtimes with {color} and {repeats}"),
        ('["Lift {color} {repeats}."]\n[stated.all]\ncolor = "a cube"', "and of others or none"),
        (f'["Lift {{color}} {{repeats}}{" again" * 60}."]', "tokens; only 64 are heard"),
    ):
        file.write_text(f"{HEAD}[commands]\nall = {command}\n")
        checked = CliRunner().invoke(cli.app, ["language", "check-scenarios", str(file)])
        assert complaint in checked.output


@pytest.mark.parametrize("pool", POOLS)
def test_a_user_s_spatial_scenario_changes_the_spatial_setting_only(pool):
    identity = identity_of(HEAD + SCENARIO)
    split = {"train": "train", "test": "test"}[pool]
    for index in range(12):
        episode = get_episode("PickXtimes", split, index)
        for ours in options_of("PickXtimes"):
            theirs = replace(ours, wordings=identity)
            if ours.setting == "spatial":
                if find_refusal(episode, theirs) is None:
                    assert instruct_with(episode, theirs).metadata["scenario"] == "dusty"
                continue
            assert find_refusal(episode, ours) == find_refusal(episode, theirs)
            if find_refusal(episode, ours) is None:
                own = instruct_with(episode, ours)
                said = instruct_with(episode, theirs)
                assert (said.turns, said.mentions) == (own.turns, own.mentions)


def test_a_scenario_for_training_is_not_said_in_test_episodes():
    identity = identity_of(HEAD + SCENARIO.replace("setting", 'pool = "train"\nsetting'))
    options = InstructionOptions("spatial", wordings=identity)
    assert "no spatial scenario for it in the pool test" in find_refusal(
        get_episode("PickXtimes", "test", 0), options
    )


def test_a_user_s_phrase_for_the_color_leaves_the_one_for_the_number():
    identity = identity_of(HEAD + '[stated.PickXtimes]\ncolor = "our {color} cube"\n')
    said = instruct(episode_with("PickXtimes", color="red", repeats=3), wordings=identity).text

    assert "our red cube" in said
    assert "three times" in said


def test_the_digest_of_a_wording_file_changes_with_what_is_said_only():
    """A comment or another task changes nothing; a sentence, command or pool does."""
    ours = words_digest("PickXtimes", "test")
    pool = SCENARIO.replace("setting", 'pool = "train"\nsetting', 1)
    texts = {
        "same": HEAD + SCENARIO,
        "comment": HEAD + "# mine\n" + SCENARIO,
        "dust": HEAD + SCENARIO.replace("dusty {", "full of dust {"),
        "command": HEAD + SCENARIO + '[commands]\nall = ["Do {color} {repeats}."]\n',
        "sentences": SIX_SENTENCES,
        "pool": HEAD + pool,
    }
    found = {
        name: words_digest("PickXtimes", "test", "explicit", identity_of(text))
        for name, text in texts.items()
    }

    assert found.pop("comment") == found["same"]
    assert len({ours, *found.values()}) == len(found) + 1

    other = texts["dust"].replace('"PickXtimes"', '"PickXtimes", "SwingXtimes"')
    assert words_digest("PickXtimes", "test", "explicit", identity_of(other)) == found["dust"]
    assert words_digest("PickXtimes", "test") == ours

    identity = identity_of(texts["same"])
    said = instruct(get_episode("PickXtimes", "test", 0), wordings=identity)
    assert said.metadata["words"] == words_of("PickXtimes", "test", wordings=identity)


def test_a_task_that_the_wording_file_lacks_is_refused_with_the_option_to_use():
    spoken = identity_of(HEAD + SCENARIO)
    episode = episode_with("PickXtimes")
    stop = episode_with("StopCube")
    lacking = f"^The wording file {spoken} has no words of StopCube; name .*: --tasks PickXtimes"

    with pytest.raises(InvalidValueError, match=lacking):
        instruct(stop, wordings=spoken)
    with pytest.raises(InvalidValueError, match="are not open"):
        instruct(episode, wordings="gone@00000000")


OLD = '[PickXtimes]\nown = ["direct"]\n[[PickXtimes.commands]]\ntext = "lift {color}"\n'


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("name = ", "is not valid TOML"),
        (HEAD.replace('"hand"', '"a b"') + SCENARIO, "has the name 'a b'; it must begin with"),
        (HEAD.partition("\n")[2] + SCENARIO.replace("setting", 'pool = "test"\nsetting', 1),
         "has the name ''; it must begin with a line such as"),
        (HEAD.replace('"hand"', "3"), "name: Expected a text, got a number; it is 3"),
        (f"{HEAD}source = 3", "source: Expected a text, got a number; it is 3"),
        ('name = "a"', "has no tasks; add a line such as tasks = "),
        ('name = "a"\ntasks = "PickXtimes"', "tasks: Expected a list, got a text; it is 'Pick"),
        ('name = "a"\ntasks = ["PickXTimes"]', "Did you mean 'PickXtimes'?"),
        (f'name = "a"\n{OLD}', "has the table [PickXtimes] of an earlier format; write its comma"),
        (f"{HEAD}[comands]", "Did you mean 'commands'?"),
        (HEAD, "has no words of PickXtimes, which stands in its tasks"),
        (f"{HEAD}commands = 3", "commands: Expected a table, got a number; it is 3"),
        (f"{HEAD}[commands]\nall = 'a'", "Expected a table or a list, got a text"),
        (f"{HEAD}[commands.all]\ntest = ['Do {{color}}.']",
         "has no commands of PickXtimes in the pool train"),
        (f"{HEAD}commands.all.train = ['{{color}}']\ncommands.all.test = ['{{colour}}']",
         "commands of PickXtimes has other marks than {color} and {repeats}: '{colour}'."),
        (HEAD + SCENARIO.replace("It's", "It's très"), "'dusty', introduction has the words"),
        (HEAD + SCENARIO.replace('"spatial"', '"spatail"'),
         "'dusty': There is no setting 'spatail'; known: direct, direct-rival, "),
        (HEAD + SCENARIO.replace('"dusty"', '"\\u001b[31m"'), "frame or people has the words"),
        (HEAD + SCENARIO + SCENARIO, "'dusty' stands twice in the setting spatial, test."),
        (HEAD + SCENARIO + SCENARIO.replace("setting", 'pool = "test"\nsetting', 1),
         "'dusty' stands twice in the setting spatial, test."),
        (f"{HEAD}[commands]\nall = ['Lift <it color: it> {{repeats:lap}}.']",
         "commands of PickXtimes has other marks than {color} and {repeats}: 'Lift <it color"),
        (f"{HEAD}[commands]\nall = ['Lift {{color}} {{repeats}}[repeats: |!]']", "has other marks"),
        (f"{HEAD}[stated.all]\ncolor = 'the {{person}} cube'", "stated color has other marks than"),
        (f"{HEAD}[stated.all]\nrepeats = 'of {{color}}, {{repeats}}'", "stated repeats has other"),
        (f"{HEAD}[stated.all]\ncolor = '<it color: it>'", "stated color has other marks"),
        (f"{HEAD}[stated.all]\ncolour = 'the {{color}} brick'",
         "stated.all: There is no field 'colour'; known: color, repeats. Did"),
        (HEAD + SCENARIO + "notes = {}", "'dusty': There is no field 'notes'; known: "),
        (HEAD + SCENARIO + 'cue.a = "So"', "'dusty': There is no field 'cue.a'; known: "),
        (HEAD + SCENARIO + 'lead = ["So ", "Now "]', "lead has the words ['So ', 'Now ']; "),
        (HEAD + SCENARIO.replace('["the cube <there place: there>"]', "[]"), "has no say.color; "),
        (HEAD + SCENARIO.replace("there>", 'there>", "the {color} cube'),
         "'dusty' has words in say.color that leave different fields open"),
        (HEAD + SCENARIO + "people.he = []", "'dusty' has fewer than two people; leave people out"),
        (HEAD + SCENARIO + 'people.he = ["Leo", "Leo"]', "'dusty' has fewer than two people;"),
        (HEAD + SCENARIO + 'list = "colors.0"', "list: There is no slot 'colors.0'; known: color"),
        (HEAD + SCENARIO.replace('"spatial"', '"direct-rival"')
         + "".join(f'{name} = "No. "\n' for name in REMARKS),
         "'dusty' has a remark that points at nothing"),
        (HEAD.replace("PickXtimes", "VideoRepick")
         + "[[literal]]\ntask = 'VideoRepick'\nwhen.color = 'red'\ntext = 'x'",
         "literal 1 has when = {'color': 'red'}; it must have a value for repeats."),
        (HEAD.replace("PickXtimes", "BinFill") + "[[literal]]\ntask = 'BinFill'\ntext = 'x'\n"
         "when = { colors = ['red'], counts = [1, 2] }", "literal 1 has when = {'colors': ('red',"),
        (HEAD + SCENARIO.replace("It's", "\u00e9" * 3000), "has words of 3,0"),
        (f"{HEAD}literal = 3", "literal: Expected a list, got a number; it is 3"),
        (f"{HEAD}[[literal]]\ntask = 'PickXtimes'\ntext = 'x'", "literal 1 has no when."),
        (HEAD + literal("red", 1).replace("repeats = 1, ", ""),
         "literal 1 has when = {'color': 'red'}; it must have a value for color and repeats"),
        (HEAD + literal("red", "'2'"), "literal 1, when.repeats: Expected a number, got a text"),
        (HEAD + literal("red", "[2]"), "literal 1, when.repeats: Expected a number, got a list"),
        (HEAD + literal("red", 1, "lift {{color}}"), "it must be a whole sentence"),
        (HEAD + literal("red", 1, " "), "has the text ' '; it must be a whole sentence"),
        (HEAD + literal("red", 1) * 2, "literal 2 states the goal red, once of PickXtimes again"),
        (HEAD + literal("red", 1).replace("PickXtimes", "StopCube"),
         "literal 1: There is no task 'StopCube'; known"),
    ],
)  # fmt: skip
def test_a_bad_wording_file_is_refused_in_one_line_with_the_faulty_field(text, complaint):
    with pytest.raises(InvalidValueError) as caught:
        parse_wordings(text, "words.toml")
    assert complaint in str(caught.value)
    assert "words.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_empty_table_of_commands_is_refused_and_not_filled_with_ours():
    with pytest.raises(InvalidValueError) as caught:
        parse_wordings(f"{HEAD}[commands.PickXtimes]\n{SCENARIO}", "words.toml")
    lines = [f"words.toml has no commands of PickXtimes in the pool {pool}." for pool in POOLS]
    assert str(caught.value).splitlines() == lines


@pytest.mark.parametrize(
    "wrong",
    [
        "".join(f"a{number} = 1\n" for number in range(5000)),
        'introduction = "' + "x" * 500_000 + '"',
        'needs = { "' + "x" * 500_000 + '" = 1 }',
        "[[scenario]]\n" * 5000,
    ],
)
def test_error_messages_about_a_huge_file_stay_short(wrong):
    text = f'{HEAD}[[scenario]]\nframe = "{"A" * 200_000}"\nsetting = "direct"\n{wrong}'
    with pytest.raises(InvalidValueError) as caught:
        parse_wordings(text, "words.toml")
    assert len(str(caught.value)) < 10_000
    assert max(map(len, str(caught.value).splitlines())) <= 2_000


def test_a_byte_order_mark_does_not_change_the_identity_of_a_file(tmp_path):
    """Editors on Windows add such a mark to the beginning of a text file."""
    path = tmp_path / "words.toml"
    path.write_text(SIX_SENTENCES)
    usual = open_wordings(path)
    path.write_text(SIX_SENTENCES, encoding="utf-8-sig")

    assert open_wordings(path) == usual


def test_naming_a_task_twice_does_not_change_the_digest():
    twice = HEAD.replace('"PickXtimes"', '"PickXtimes", "PickXtimes"')
    needing = SCENARIO + 'needs.tasks = ["PickXtimes", "PickXtimes"]\n'

    digests = [
        words_digest("PickXtimes", "test", "spatial", identity_of(text))
        for text in (HEAD + SCENARIO, twice + SCENARIO, twice + needing)
    ]

    assert len(set(digests)) == 1


BIN_HEAD = 'name = "bin"\ntasks = ["BinFill"]\n'


def bin_literals(goals, step):
    """Return a sentence for each goal, with its colors from the first to the last or back."""
    tables = [BIN_HEAD]
    for goal in goals:
        colors = list(goal["colors"])[::step]
        counts = list(goal["counts"])[::step]
        when = f"when = {{ colors = {colors}, counts = {counts} }}"
        tables.append(f'[[literal]]\ntask = "BinFill"\n{when}\ntext = "fill {goal.amounts}"\n')
    text = "".join(tables)
    return text.replace("fill (", "fill ").replace("(", "").replace(")", "")


@pytest.mark.parametrize("step", [1, -1])
def test_a_sentence_for_amounts_is_found_whatever_the_order_of_its_colors(step):
    """`step` -1 writes the colors of each BinFill goal in reverse."""
    episodes = [get_episode("BinFill", "test", index) for index in range(12)]
    goals = {goal for episode in episodes for goal in goals_of(episode)}

    identity = identity_of(bin_literals(goals, step))

    assert max(len(episode.goal["colors"]) for episode in episodes) > 1
    for episode in episodes:
        said = instruct(episode, wordings=identity)
        assert understood_goals(said, episode) == (episode.goal,)


def test_the_check_reports_a_sentence_for_an_impossible_goal(tmp_path):
    """The cube of StopCube visits its target at most five times."""
    file = tmp_path / "theirs.toml"
    file.write_text(SENTENCE_FILE_OF_THE_PAGE.replace("visit = 2", "visit = 99"))

    checked = CliRunner().invoke(cli.app, ["language", "check-scenarios", str(file)])

    assert "  No scene has the goal of a sentence: on visit 99\n" in checked.output


PAINT_SCENARIO = """
[[scenario]]
frame = "paint"
setting = "direct"
introduction = "We painted the {color} cube."
reinforcement = "It is new."
distractors = ["I still have to wash the brushes."]
competing = ["The {rival color} one comes next week."]
cue = "So let's go."
lead = "So "
say.color = ["<it color: it>"]
"""


def test_a_competing_remark_names_no_color_of_the_list_that_was_introduced():
    """Of three colors two are listed, and five remarks all name the third."""
    listing = PAINT_SCENARIO.replace("the {color} cube", "a {list.0} and a {list.1} cube")
    listing = listing.replace('"So "', '"I need <rank color: {rank}>, so "')
    identity = identity_of(f'{HEAD}{listing}list = "color"\nneeds.list = [2]\n')
    remarks = {"distractor": "competing", "distractors": 5}
    episode = get_episode("PickXtimes", "test", 3)

    said = instruct(episode, "contextual", wordings=identity, **remarks)

    assert said.turns[0] == "We painted a blue and a green cube."
    assert said.text.count("The red one comes next week.") == 5


@pytest.mark.parametrize(
    ("command", "begun"),
    [
        ("I'd like {color} there {repeats}.", "So I'd like it"),
        ("I need {color} there {repeats}.", "So I need it"),
        ("LEDs on, lift {color} {repeats}.", "So LEDs on, lift it"),
        ("A lift of {color}, {repeats}.", "So a lift of it"),
        ("If you can, lift {color} {repeats}.", "So if you can, lift it"),
    ],
)
def test_so_before_a_command_lowers_its_first_letter_except_in_i_and_leds(command, begun):
    identity = identity_of(f'{HEAD}[commands]\nall = ["{command}"]\n{PAINT_SCENARIO}')
    said = instruct(get_episode("PickXtimes", "test", 3), "direct", wordings=identity)
    assert said.command.startswith(begun)


@pytest.mark.parametrize(
    ("before", "after"),
    [('lead = "So "', 'lead = "Take the {color} one: "'), ("it>", "it>, the {color} one,")],
)
def test_a_command_that_names_the_color_leaves_one_goal_even_if_it_also_says_it(before, after):
    """With *it* alone three colors are open, and one value is hidden; named, none is."""
    episode = get_episode("PickXtimes", "test", 3)
    said = [
        instruct(episode, "direct", wordings=identity_of(HEAD + text))
        for text in (PAINT_SCENARIO, PAINT_SCENARIO.replace(before, after))
    ]

    assert [len(command_goals(instruction.meaning, episode)) for instruction in said] == [3, 1]
    assert [instruction.metadata["hidden_slots"] for instruction in said] == [1, 0]


def test_the_declared_meaning_lists_values_in_the_order_of_the_goal():
    for task in ("PickXtimes", "BinFill", "VideoUnmask"):
        episode = get_episode(task, "test", 3)
        fields = [value.field for value in values_of_goal(episode.goal)]
        for setting in ("explicit", "direct"):
            assert list(instruct(episode, setting).meaning.terms) == fields


@pytest.mark.parametrize(
    ("before", "after", "setting", "lacking"),
    [
        ("We painted", "{excluded} went. We painted", "direct", "'excluded'"),
        ("{rival color} one", "{rival color} one {list}", "contextual", "a competing remark with"),
        ('["<it color: it>"]', '["{rank}, <it color: it>"]', "direct", "'rank'"),
    ],
)
def test_a_scenario_with_a_mark_that_has_no_value_is_refused_by_file_and_name(
    before, after, setting, lacking
):
    """`{excluded}` needs a rule that excludes colors, and `{rank}` needs a list."""
    identity = identity_of(HEAD + PAINT_SCENARIO.replace(before, after))
    episode = get_episode("PickXtimes", "test", 3)
    sentence = f"words.toml, scenario 'paint', lacks {lacking}"
    options = {"stages": (1, 2, 3, 5), "distractor": "competing"} if setting == "contextual" else {}

    with pytest.raises(InvalidValueError, match=f"^{re.escape(sentence)}"):
        instruct(episode, setting, wordings=identity, **options)


def test_a_scenario_that_lists_values_of_another_task_fits_no_episode():
    """PickXtimes has no visits; the file also serves StopCube, which has."""
    head = HEAD.replace('"PickXtimes"', '"PickXtimes", "StopCube"')
    identity = identity_of(head + PAINT_SCENARIO + 'list = "visit"\n')
    options = InstructionOptions("direct", wordings=identity)

    refused = find_refusal(get_episode("PickXtimes", "test", 3), options)

    assert "has no direct scenario for it in the pool test" in refused


PIECES_OF_FILES = st.sampled_from(
    [
        *re.split(r"(\s|[\[\]{}=.,])", SIX_SENTENCES + SCENARIO),
        "[[",
        "{a=",
        "\0",
        "\x1b",
        "é",
        "9" * 5000,
    ]
)


@given(st.lists(st.one_of(PIECES_OF_FILES, st.text(max_size=3)), max_size=40).map("".join))
def test_any_text_is_read_as_a_wording_file_or_refused(text):
    """Pieces of real files in random order: no other error may come out."""
    with contextlib.suppress(InvalidValueError):
        parse_wordings(HEAD + text, "words.toml")


@pytest.mark.parametrize("name", ["missing.toml", "nul\0.toml", "bytes.toml", ""])
def test_a_missing_or_binary_wording_file_is_refused(tmp_path, name):
    (tmp_path / "bytes.toml").write_bytes(b"\xff")
    with pytest.raises(InvalidValueError, match="cannot be read"):
        read_wordings(tmp_path / name)


def test_a_wording_file_that_changed_no_longer_serves_episodes_of_its_old_version(tmp_path):
    """The identity is the file's name and a digest. What was open once stays so in this process."""
    path = tmp_path / "words.toml"
    path.write_text(SIX_SENTENCES)
    identity = open_wordings(path)
    path.write_text(SIX_SENTENCES.replace("lift", "take"))
    changed = open_wordings(path)

    assert changed != identity
    assert open_wordings(path, identity) == identity  # this process still has it

    gone = "hand@00000000"
    with pytest.raises(InvalidValueError, match=f"holds {changed}, but the episodes need {gone}"):
        open_wordings(path, gone)
    with pytest.raises(InvalidValueError, match=f"holds {changed}, but the episodes need {gone}"):
        open_wordings(changed, gone)
    assert open_wordings(changed) == changed
    with pytest.raises(InvalidValueError, match="need their file; none was given"):
        open_wordings(None, gone)
    with pytest.raises(InvalidValueError, match="are not open"):
        find_wordings(gone)
    assert open_wordings(None) is None
