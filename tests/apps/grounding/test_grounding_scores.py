"""Scores of answers to the grounding dataset: verdicts, chance, gaps, floors, the report."""

import functools
import json
import math
import os

import numpy as np
import pytest
from made_items import SETTINGS, items_of
from msgspec.structs import replace
from typer.testing import CliRunner

from roboirg.analysis.measures.chance import floor_level
from roboirg.apps.grounding.answer_floors import FLOORS, floor_answers
from roboirg.apps.grounding.answer_scores import (
    score_answers,
    score_rows,
)
from roboirg.apps.grounding.items.answer_file import Answer, read_answers, write_answers
from roboirg.apps.grounding.items.grounding_item import (
    LETTERS,
    QUESTION_KINDS,
    read_items,
    write_items,
)
from roboirg.apps.grounding.items.verdicts import guess_chance, judge_reply, right_reply
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.main import app
from roboirg.records.record import Job

TASKS = ("PickXtimes", "BinFill", "VideoUnmask", "VideoPlaceButton", "StopCube")


@functools.cache
def items(tasks=TASKS, episodes=8):
    """Return the grounding items of some tasks' first episodes, in all settings."""
    found = []
    for task in tasks:
        for index in range(episodes):
            found += items_of(task, index)[1]
    return found


def rows_of(answers, kind, dataset=None):
    """Score answers; return the score of a kind of question, and its rows by setting."""
    scores = score_answers(dataset or items(), answers, "model")
    (score,) = [score for score in scores if score.kind == kind]
    return score, {row.summary.key.options.setting: row for row in score_rows(score)}


def item_of(task, setting="direct"):
    """Return the item of the first episode of a task in a setting."""
    return next(item for item in items() if (item.task, item.setting) == (task, setting))


@pytest.mark.parametrize("kind", QUESTION_KINDS)
def test_the_oracle_is_always_right(kind):
    """The floor `oracle` gives each item's stored answer, so its rate is 1 in every setting.

    The items are of eight episodes of five tasks. A rate that is corrected for chance is 1 at most,
    and that is reached, too.
    """
    score, rows = rows_of(floor_answers("oracle", items()), kind)

    assert score.unparsed == score.missing == 0
    assert set(rows) == set(SETTINGS)
    for setting, row in rows.items():
        assert row.summary.rate == row.corrected == 1, setting


@pytest.mark.parametrize("kind", ["slots", "choice"])
def test_random_answers_are_at_chance(kind):
    """The floor `chance` answers each item at random. It has to be right as often as `guess_chance`
    computes for the items, in the mean.

    At least 3,000 answers, with as many seeds as that takes, have a standard error of at most
    sqrt(0.25 / 3000) = 0.0091, so a deviation of 0.03 is more than three of these.
    """
    known = {item.id: item for item in items()}
    right = []
    chances = []
    for seed in range(math.ceil(3_000 / len(items()))):
        for answer in floor_answers("chance", items(), seed):
            if answer.kind == kind:
                item = known[answer.id]
                right.append(judge_reply(item, kind, answer.reply).right)
                chances.append(guess_chance(item, kind))

    assert len(right) >= 3_000
    assert abs(np.mean(right) - np.mean(chances)) < 0.03


MASK = 64 / 256**2
"""The share of the picture that a mask of the items here covers."""


@pytest.mark.parametrize(
    ("points", "in_order", "chance"),
    [(1, True, MASK), (2, True, MASK**2), (2, False, 2 * MASK**2)],
)
def test_random_pixels_hit_as_often_as_masks_are_large(points, in_order, chance):
    """A mask covers 8 × 8 of 256 × 256 pixels: a random pixel lies in it with chance `MASK`.

    Points are independent, so the chances of two multiply; without an order two points fit their
    two masks in two ways.
    """
    item = item_of("StopCube")
    item = replace(item, points=item.points[:points], points_in_order=in_order)

    assert guess_chance(item, "points") == pytest.approx(chance)


@pytest.mark.parametrize(
    ("reply", "understood"),
    [
        ("C. Put the cube there.", "C"),
        ("Let me see. A cube ... The answer is B.", "B"),
        ('{"choice": "B"}', "B"),
        ("Not A. Answer: D", None),
        ("Because it is red.", None),
    ],
)
def test_a_choice_is_read_by_its_letter(reply, understood):
    """The item has three choices, A to C: D is no answer, and neither is a reply without one.

    The letter that is given as the answer counts, not the "A" of "A cube".
    """
    item = next(item for item in items() if len(item.choices) == 3)

    verdict = judge_reply(item, "choice", reply)

    assert verdict.understood == understood
    assert verdict.right == (understood == item.choice)


@pytest.mark.parametrize("form", ["{letter}. {choice}", "The answer is {letter}: {choice}"])
def test_the_words_of_no_choice_cast_doubt_on_its_letter(form):
    """A reply may repeat the choice after its letter: the letter alone is understood.

    Each choice of each item is tried; its own words must not be read as another letter.
    """
    for item in items():
        for letter, choice in zip("ABCD", item.choices, strict=False):
            reply = form.format(letter=letter, choice=choice)
            assert judge_reply(item, "choice", reply).understood == letter, reply


@pytest.mark.parametrize("kind", QUESTION_KINDS)
def test_thoughts_in_an_answer_are_not_scored(kind):
    """Thoughts name two goals and the letter D; the right answer comes after `</think>`.

    With the answer the reply is right, and with the thoughts alone nothing is understood.
    """
    item = item_of("PickXtimes")
    thoughts = f"<think>{item.goals[0]} or {item.goals[-1]}, the answer is D</think>"

    assert judge_reply(item, kind, f"{thoughts}\n{right_reply(item, kind)}").right
    assert judge_reply(item, kind, thoughts).understood is None


def test_points_in_a_list_are_all_read_and_numbers_may_be_texts():
    """The reply is a JSON list of the right points, in which x is a number and y a text."""
    item = item_of("PickXtimes")
    points = [{"x": point.x, "y": str(point.y)} for point in item.points]
    assert judge_reply(item, "points", json.dumps(points)).right


def test_slots_are_judged_one_by_one():
    """The reply has the right color and another number: one slot is right, the answer is not.

    Numbers of repeats are from 1 to 5, so `% 5 + 1` gives another of them. The JSON stands in a
    block of code after other words.
    """
    item = item_of("PickXtimes")
    answer = json.loads(item.answer)
    other = {**answer, "repeats": answer["repeats"] % 5 + 1}

    verdict = judge_reply(item, "slots", f"I think: ```json\n{json.dumps(other)}\n```")

    assert verdict.parts == {"color": True, "repeats": False}
    assert not verdict.right
    assert json.loads(verdict.understood) == other


def test_a_reply_that_is_no_goal_has_all_slots_wrong():
    """Words without JSON: not right, nothing understood, and both slots of the task wrong."""
    verdict = judge_reply(item_of("PickXtimes"), "slots", "red, I guess")
    assert verdict == (False, None, {"color": False, "repeats": False})


@pytest.mark.parametrize(
    ("points", "right", "parts"),
    [
        ([(17.9, 47.9), (37, 47)], True, [True, True]),
        ([(18, 40), (30, 48)], False, [False, False]),
        ([(30, 40), (10, 40)], False, [False, False]),
        ([(10, 40)], False, [True, False]),
        ([(10, 40), (30, 40), (10, 40)], False, [True, True]),
        ([(-1, 40), (300, 40)], False, [False, False]),
    ],
    ids=["in both", "just outside", "swapped", "one", "one too many", "outside the picture"],
)
def test_points_must_lie_in_the_masks_in_order(points, right, parts):
    """The masks are 8 × 8 pixels, at (10, 40) and (30, 40): x from 10 to below 18 is in the first.

    `parts` says of each mask whether its point lies in it. With a point too many both are hit, but
    the answer is not right.
    """
    reply = json.dumps({"points": [{"x": x, "y": y} for x, y in points]})

    verdict = judge_reply(item_of("PickXtimes"), "points", reply)

    assert verdict.right == right
    assert list(verdict.parts.values()) == parts


@pytest.mark.parametrize(
    ("second", "right"), [({"x": 10, "y": 40}, True), ({"x": 30, "y": 40}, False)]
)
def test_points_of_amounts_have_no_order(second, right):
    """Each of the two masks, at (10, 40) and (30, 40), must be met once, in any order.

    The first point lies in the second mask. So a second point in the first mask completes the
    answer, and another one at (30, 40) leaves the first mask unmet.
    """
    reply = json.dumps({"points": [{"x": 30, "y": 40}, second]})
    assert judge_reply(item_of("BinFill"), "points", reply).right == right


@pytest.mark.parametrize(
    "reply", ["", "[1, 2]", '{"points": 3}', '{"points": []}', '{"x": true, "y": 1}',
              '{"points": [{"x": NaN, "y": 2}]}', '{"points": [{"x": "nan", "y": 2}]}',
              '{"points": [{"x": 2, "y": 1e400}]}', '{"x": 1, "y": 2, "x": 3}']
)  # fmt: skip
def test_replies_that_point_nowhere_are_no_answer(reply):
    """No reply has a point of two finite numbers: nothing is understood, so nothing is right.

    Among them are an empty list, a truth value for x, NaN, a number beyond floats, and x given
    twice.
    """
    verdict = judge_reply(item_of("PickXtimes"), "points", reply)

    assert verdict.understood is None
    assert not verdict.right


@pytest.fixture(scope="module")
def half_answered():
    """The score, and rows by setting, of four of eight episodes of five tasks.

    All explicit answers are right; all others are `{}`, which says nothing and counts as wrong.
    """
    answers = []
    for item in items():
        if item.episode < 4:
            reply = item.answer if item.setting == "explicit" else "{}"
            answers.append(Answer(item.id, "slots", reply))
    return rows_of(answers, "slots")


def test_rates_and_gap_are_those_of_the_items_that_have_answers(half_answered):
    """Explicit answers are all right and direct ones all empty: rates 1 and 0, so a gap of -1.

    Answers are to four episodes of five tasks, hence 4 * 5 trials; items without an answer do not
    count.
    """
    _, rows = half_answered

    assert rows["explicit"].summary.rate == 1
    assert rows["direct"].summary.rate == 0
    assert rows["direct"].summary.gap.value == -1
    assert rows["direct"].summary.counts.trials == 4 * 5


def test_p_values_are_those_of_the_sign_flip_test_and_holms_of_four_settings(half_answered):
    """All 20 pairs (4 episodes of 5 tasks) differ to one side: 2 of 2**20 flips of signs do so.

    Holm multiplies the smallest of the four settings' p-values by 4; that of spatial, which fewer
    tasks have, is larger.
    """
    _, rows = half_answered

    p_value = 2 * 0.5**20

    assert rows["direct"].summary.gap.p_value == pytest.approx(p_value)
    assert rows["direct"].summary.p_holm == pytest.approx(4 * p_value)


def test_unusable_and_missing_answers_are_counted(half_answered):
    """Of episodes below 4 the answers are `{}` but for explicit ones; from 4 on there are none."""
    score, _ = half_answered

    assert score.unparsed == sum(
        item.setting != "explicit" and item.episode < 4 for item in items()
    )
    assert score.missing == sum(item.episode >= 4 for item in items())


@pytest.mark.parametrize("setting", ["direct", "reasoning", "contextual"])
@pytest.mark.parametrize("rule", ["first-mention", "surface"])
def test_shortcuts_are_right_as_often_as_the_listeners_that_use_them(rule, setting):
    """A shortcut answers by a rule about the words, such as the color that is named first, without
    understanding them. Answers to questions follow the same rules as listeners that play.

    `floor_level` computes how often such a listener decides the right goal. The rate of answers to
    48 items, of the same episodes, is within 0.15 of it: two standard errors, for ties are drawn.
    """
    dataset = items(episodes=24, tasks=("PickXtimes", "VideoPlaceButton"))
    options = InstructionOptions(setting)
    jobs = []
    for task in ("PickXtimes", "VideoPlaceButton"):
        for episode in range(24):
            jobs.append(Job(policy=rule, task=task, split="test", episode=episode, options=options))

    _, rows = rows_of(floor_answers(rule, dataset), "slots", dataset)

    expected = float(floor_level(rule, jobs))
    assert float(rows[setting].summary.rate) == pytest.approx(expected, abs=0.15)


def test_who_hears_the_command_alone_is_right_in_explicit_and_guesses_in_direct():
    """The floor `command` is a model that reads the last utterance alone, such as "Grab it".

    An explicit instruction is one utterance, so it is always right. In *direct* it guesses among
    the goals that fit; `command_chance` is the mean chance of that guess, and the rate of 48 items
    is within 0.15 of it, two standard errors.
    """
    dataset = items(episodes=24, tasks=("PickXtimes", "VideoPlaceButton"))

    _, rows = rows_of(floor_answers("command", dataset), "slots", dataset)

    chance = rows["direct"].command_chance
    assert rows["explicit"].summary.rate == 1
    assert float(rows["direct"].summary.rate) == pytest.approx(chance, abs=0.15)


def test_the_words_alone_are_learned_from_the_train_split():
    """The floor `text-only` learned answers from words without a picture (needs scikit-learn).

    On 50 episodes of StopCube explicit words name the answer, so it is nearly always right; the
    words of direct help it to at least 0.3 more than a guess.
    """
    pytest.importorskip("sklearn")
    dataset = [item for item in items(("StopCube",), 50) if item.setting in ("explicit", "direct")]

    _, rows = rows_of(floor_answers("text-only", dataset), "slots", dataset)

    assert rows["explicit"].summary.rate > 0.9
    assert rows["direct"].summary.rate > rows["direct"].chance + 0.3


@pytest.mark.parametrize("name", sorted(set(FLOORS) - {"text-only"}))
def test_a_floor_answers_every_item_whatever_the_others_are(name):
    """Two episodes of StopCube get the same answers alone as among all items, and each has one.

    A choice is answered by a letter.
    """
    few = [item for item in items() if item.task == "StopCube" and item.episode < 2]

    answers = list(floor_answers(name, few))

    assert {answer.id for answer in answers} == {item.id for item in few}
    assert set(answers) <= set(floor_answers(name, items()))
    for answer in answers:
        assert answer.kind != "choice" or answer.reply in LETTERS


def test_answers_of_every_kind_are_read_as_they_were_written(tmp_path):
    """One answer to each kind of question is written and read; an empty line does no harm."""
    path = tmp_path / "model.jsonl"
    answers = [
        Answer(items()[0].id, "slots", f"It is {items()[0].answer}"),
        Answer(items()[1].id, "choice", items()[1].choice),
        Answer(items()[2].id, "points", right_reply(items()[2], "points")),
    ]

    write_answers(path, answers)
    path.write_text(path.read_text() + "\n")

    assert read_answers(path, items()) == answers


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("{", "line 1: not valid .Input data was truncated"),
        ('{"reply": ""}', "missing required field `id`"),
        ('{"id": "g1", "kind": "slots", "reply": ""}', "no item 'g1'"),
        ('{"id": "ID", "kind": "poem", "reply": ""}', "Invalid enum value 'poem' - at `.*kind`"),
        (2 * '{"id": "ID", "kind": "choice", "reply": "A"}\n', "line 2: choice of item"),
        ("", "the file holds no answers"),
    ],
    ids=["no JSON", "no item", "unknown item", "unknown question", "again", "empty"],
)
def test_a_file_that_holds_no_answers_is_refused_in_one_sentence(tmp_path, line, words):
    """In a line, ID stands for the id of an item that the dataset has; `words` are in the
    message.
    """
    path = tmp_path / "answers.jsonl"
    path.write_text(line.replace("ID", items()[0].id))

    with pytest.raises(InvalidValueError, match=words):
        read_answers(path, items())


def test_a_missing_file_of_answers_is_refused(tmp_path):
    with pytest.raises(InvalidValueError, match="cannot be read"):
        read_answers(tmp_path / "none.jsonl", items())


def run(*arguments):
    """Return what came of ``roboirg score grounding``."""
    words = ["score", "grounding", *map(str, arguments)]
    return CliRunner().invoke(app, words, env={"COLUMNS": "120"})


@pytest.fixture
def scored(tmp_path):
    """What came of `score grounding` of a right model and a mixed one, with the floor of chance.

    Items are of two episodes of five tasks, BinFill with fewer. Of the mixed one, every seventh
    answer is missing, the others are right, wrong or unusable; to choices it always says A.
    """
    dataset = []
    for number, item in enumerate(items()):
        if item.episode < 2 and (item.task, number % 3) != ("BinFill", 0):
            dataset.append(replace(item, video=f"{item.task}.mp4"))
    write_items(dataset, tmp_path / "set")
    right = [Answer(item.id, "slots", item.answer) for item in dataset]
    mixed = [Answer(item.id, "choice", "A") for item in dataset if item.setting == "direct"]
    for number, item in enumerate(dataset):
        replies = (item.answer, item.goals[0], "No idea.", item.goals[-1], item.answer)
        if number % 7:
            mixed.append(Answer(item.id, "slots", replies[number % 5]))
    write_answers(tmp_path / "right.v2.jsonl", right)
    write_answers(tmp_path / "mixed.jsonl", mixed)
    return run(
        tmp_path / "right.v2.jsonl", tmp_path / "mixed.jsonl", "--data", tmp_path / "set",
        "--floor", "chance", "--write-floors", tmp_path / "floors",
        "--report", tmp_path / "report.md",
    )  # fmt: skip


def test_the_command_prints_a_table_of_scores(scored, tmp_path, snapshot):
    """`scored` has run the command on a right model, a mixed one and the floor of chance.

    The snapshot has the table with a row for each of them, kind of question and setting.
    """
    assert scored.exit_code == 0, scored.output
    assert scored.output.replace(str(tmp_path), "FOLDER") == snapshot


def test_the_command_writes_a_report_of_each_model(scored, tmp_path, snapshot):
    """The snapshot has the section of the mixed model's slots, up to that of the floor.

    `scored` has run the command, whose report has a section for each model and kind of question.
    """
    _, _, report = (tmp_path / "report.md").read_text().partition("\n## mixed, slots\n")
    assert report.partition("\n## chance, slots")[0] == snapshot


def test_the_command_writes_the_answers_of_floors(scored, tmp_path):
    """`scored` asked for the floor of chance, which answers the three questions of each item."""
    answers = read_answers(tmp_path / "floors" / "chance.jsonl", items())
    assert len(answers) == 3 * len(read_items(tmp_path / "set"))


def test_items_of_several_splits_are_not_scored_together():
    """One more item, of the split val, is added to items of the test split."""
    dataset = [*items(), replace(items()[0], split="val")]
    with pytest.raises(InvalidValueError, match="several splits, wordings or versions"):
        score_answers(dataset, [Answer(items()[0].id, "choice", "A")], "m")


def test_items_that_are_a_pipe_are_refused(tmp_path):
    """To open it would wait for ever."""
    os.mkfifo(tmp_path / "items.jsonl")

    with pytest.raises(InvalidValueError, match=r"holds no .*not a regular file"):
        read_items(tmp_path)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "nothing to score"),
        (("--floor", "luck"), "no floor 'luck'"),
        (("--data", "nowhere", "--floor", "chance"), "holds no grounding dataset"),
    ],
)
def test_a_command_that_has_nothing_to_score_is_refused_in_one_sentence(tmp_path, arguments, words):
    """Of no answers and no floor, a floor that is not known, and a folder without items.

    All other words of the command are in order, with a dataset in the folder.
    """
    write_items(items(), tmp_path)

    done = run("--data", tmp_path, *arguments)

    assert isinstance(done.exception, InvalidValueError)
    assert words in str(done.exception)
