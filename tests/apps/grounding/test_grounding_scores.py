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
    found = []
    for task in tasks:
        for index in range(episodes):
            found += items_of(task, index)[1]
    return found


def rows_of(answers, kind, dataset=None):
    (score,) = [
        score for score in score_answers(dataset or items(), answers, "model") if score.kind == kind
    ]
    return score, {row.summary.key.options.setting: row for row in score_rows(score)}


def item_of(task, setting="direct", index=0):
    return next(
        item
        for item in items()
        if (item.task, item.setting, item.episode) == (task, setting, index)
    )


@pytest.mark.parametrize("kind", QUESTION_KINDS)
def test_the_oracle_is_always_right(kind):
    score, rows = rows_of(floor_answers("oracle", items()), kind)
    assert score.unparsed == score.missing == 0
    assert set(rows) == set(SETTINGS)
    for row in rows.values():
        assert row.summary.rate == row.corrected == 1
        assert row.summary.gap is None or row.summary.gap.value == 0


@pytest.mark.parametrize("kind", ["slots", "choice"])
def test_random_answers_are_at_chance(kind):
    """Within three points, over three thousand answers."""
    known = {item.id: item for item in items()}
    seeds = range(math.ceil(3_000 / len(items())))
    found = [
        (
            judge_reply(known[answer.id], kind, answer.reply).right,
            guess_chance(known[answer.id], kind),
        )
        for seed in seeds
        for answer in floor_answers("chance", items(), seed)
        if answer.kind == kind
    ]
    assert len(found) >= 3_000

    right, expected = np.mean(found, axis=0)
    assert abs(right - expected) < 0.03


def test_random_pixels_hit_as_often_as_masks_are_large():
    item = item_of("StopCube")
    single = replace(item, points=item.points[:1])
    share = 64 / 256**2
    either = replace(item, points_in_order=False)

    chances = [guess_chance(each, "points") for each in (single, item, either)]

    assert chances == pytest.approx([share, share**2, 2 * share**2])


@pytest.mark.parametrize(
    ("reply", "understood"),
    [
        ("C. Put the cube there.", "C"),
        ("Let me see. A cube ... The answer is B.", "B"),
        ('{"choice": "B"}', "B"),
        ("Not A. Answer: D", None),  # there are three choices
        ("Because it is red.", None),
    ],
)
def test_a_choice_is_read_by_its_letter(reply, understood):
    item = next(item for item in items() if len(item.choices) == 3)
    verdict = judge_reply(item, "choice", reply)

    assert verdict.understood == understood
    assert verdict.right == (understood == item.choice)


def test_the_words_of_no_choice_cast_doubt_on_its_letter():
    for item in items():
        for letter, choice in zip("ABCD", item.choices, strict=False):
            for reply in (f"{letter}. {choice}", f"The answer is {letter}: {choice}"):
                assert judge_reply(item, "choice", reply).understood == letter


def test_thoughts_in_an_answer_are_not_scored():
    item = item_of("PickXtimes")
    thoughts = f"<think>{item.goals[0]} or {item.goals[-1]}, the answer is D</think>"
    for kind in QUESTION_KINDS:
        assert judge_reply(item, kind, f"{thoughts}\n{right_reply(item, kind)}").right
        assert judge_reply(item, kind, thoughts).understood is None


def test_points_in_a_list_are_all_read_and_numbers_may_be_texts():
    item = item_of("PickXtimes")
    points = [{"x": point.x, "y": str(point.y)} for point in item.points]
    assert judge_reply(item, "points", json.dumps(points)).right


def test_slots_are_judged_one_by_one():
    item = item_of("PickXtimes")
    answer = json.loads(item.answer)
    other = {**answer, "repeats": answer["repeats"] % 5 + 1}
    verdict = judge_reply(item, "slots", f"I think: ```json\n{json.dumps(other)}\n```")

    assert verdict.parts == {"color": True, "repeats": False}
    assert not verdict.right
    assert json.loads(verdict.understood) == other

    nonsense = judge_reply(item, "slots", "red, I guess")
    assert nonsense == (False, None, {"color": False, "repeats": False})
    assert judge_reply(item, "slots", json.dumps(answer)).right


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
)
def test_points_must_lie_in_the_masks_in_order(points, right, parts):
    item = item_of("PickXtimes")
    reply = json.dumps({"points": [{"x": x, "y": y} for x, y in points]})

    verdict = judge_reply(item, "points", reply)

    assert verdict.right == right
    assert list(verdict.parts.values()) == parts


def test_points_of_amounts_have_no_order():
    item = item_of("BinFill")
    assert not item.points_in_order

    swapped = [{"x": 30, "y": 40}, {"x": 10, "y": 40}]
    assert judge_reply(item, "points", json.dumps({"points": swapped})).right
    assert not judge_reply(item, "points", json.dumps({"points": [swapped[0]] * 2})).right


@pytest.mark.parametrize(
    "reply", ["", "[1, 2]", '{"points": 3}', '{"points": []}', '{"x": true, "y": 1}',
              '{"points": [{"x": "a", "y": 2}]}', '{"points": [{"x": NaN, "y": 2}]}',
              '{"points": [{"x": "nan", "y": 2}]}', '{"points": [{"x": 2, "y": 1e400}]}',
              '{"points": [{"x": "Infinity", "y": 2}]}', '{"x": 1, "y": 2, "x": 3}']
)  # fmt: skip
def test_replies_that_point_nowhere_are_no_answer(reply):
    verdict = judge_reply(item_of("PickXtimes"), "points", reply)
    assert verdict.understood is None
    assert not verdict.right


def test_scores_are_what_plain_counts_give():
    """All explicit and no direct answer is right, half of the items have none."""
    given = [
        Answer(item.id, "slots", item.answer if item.setting == "explicit" else "{}")
        for item in items()
        if item.episode < 4
    ]
    score, rows = rows_of(given, "slots")
    explicit = rows["explicit"]
    direct = rows["direct"]

    assert (explicit.summary.rate, direct.summary.rate, direct.summary.gap.value) == (1, 0, -1)
    assert direct.summary.counts.trials == 4 * len(TASKS)

    p_value = 2 * 0.5 ** (4 * len(TASKS))
    assert direct.summary.gap.p_value == pytest.approx(p_value)
    # Four settings are tested together; spatial has fewer tasks, so its p-value is larger.
    assert direct.summary.p_holm == pytest.approx(4 * p_value)
    assert (explicit.hidden, direct.hidden) == (None, 0)
    # Of three goals or letters, a rate of 0 is as far below chance as that allows.
    assert direct.corrected == pytest.approx(-direct.chance / (1 - direct.chance))
    assert score.unparsed == sum(item.setting != "explicit" for item in items()) / 2
    assert score.missing == sum(item.episode >= 4 for item in items())


@pytest.mark.parametrize("rule", ["first-mention", "surface", "command"])
def test_shortcuts_are_right_as_often_as_their_probability_says(rule):
    """The expected success of the listeners in `roboirg tables --floors`, or of a guess."""
    dataset = items(episodes=24, tasks=("PickXtimes", "VideoPlaceButton"))
    _, rows = rows_of(floor_answers(rule, dataset), "slots", dataset)

    for setting in ("direct", "reasoning", "contextual"):
        jobs = [
            Job(
                policy=rule,
                task=item.task,
                split="test",
                episode=item.episode,
                options=InstructionOptions(setting),
            )
            for item in dataset
            if item.setting == setting
        ]
        row = rows[setting]
        expected = row.command_chance if rule == "command" else float(floor_level(rule, jobs))
        assert float(row.summary.rate) == pytest.approx(expected, abs=0.15)

    assert rule != "command" or rows["explicit"].summary.rate == 1


def test_the_words_alone_are_learned_from_the_train_split():
    pytest.importorskip("sklearn")
    dataset = [item for item in items(("StopCube",), 50) if item.setting in ("explicit", "direct")]

    _, rows = rows_of(floor_answers("text-only", dataset), "slots", dataset)

    assert rows["explicit"].summary.rate > 0.9
    assert rows["direct"].summary.rate > rows["direct"].chance + 0.3


@pytest.mark.parametrize("name", sorted(set(FLOORS) - {"text-only"}))
def test_a_floor_answers_every_item_whatever_the_others_are(name):
    few = [item for item in items() if item.task == "StopCube" and item.episode < 2]
    found = list(floor_answers(name, few))

    assert {answer.id for answer in found} == {item.id for item in few}
    assert all(answer.reply in LETTERS for answer in found if answer.kind == "choice")
    assert set(found) <= set(floor_answers(name, items()))


def test_answers_are_read_in_every_form(tmp_path):
    first, second, third = items()[:3]
    path = tmp_path / "model.jsonl"
    written = [
        Answer(first.id, "slots", f"It is {first.answer}"),
        Answer(second.id, "choice", second.choice),
        Answer(third.id, "points", right_reply(third, "points")),
    ]
    write_answers(path, written)
    path.write_text(path.read_text() + "\n")
    found = read_answers(path, items())

    assert found == written

    known = {item.id: item for item in items()}
    for answer in found:
        assert judge_reply(known[answer.id], answer.kind, answer.reply).right


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
)
def test_bad_files_are_one_sentence(tmp_path, line, words):
    path = tmp_path / "answers.jsonl"
    path.write_text(line.replace("ID", items()[0].id))

    with pytest.raises(InvalidValueError, match=words):
        read_answers(path, items())
    with pytest.raises(InvalidValueError, match="cannot be read"):
        read_answers(tmp_path / "none.jsonl", items())


def run(*arguments):
    words = ["score", "grounding", *map(str, arguments)]
    return CliRunner().invoke(app, words, env={"COLUMNS": "120"})


def test_the_command_scores_compares_and_reports(tmp_path, snapshot):
    """Right, wrong, unusable and missing answers; tasks with more and with fewer of them."""
    data = tmp_path / "set"
    report = tmp_path / "report.md"
    floors = tmp_path / "floors"
    right = tmp_path / "right.v2.jsonl"
    mixed = tmp_path / "mixed.jsonl"
    some = []
    for number, item in enumerate(items()):
        if item.episode < 2 and (item.task, number % 3) != ("BinFill", 0):
            some.append(replace(item, video=f"{item.task}.mp4"))
    write_items(some, data)
    write_answers(right, [Answer(item.id, "slots", item.answer) for item in some])
    answers = [Answer(item.id, "choice", "A") for item in some if item.setting == "direct"]
    for number, item in enumerate(some):
        replies = (item.answer, item.goals[0], "No idea.", item.goals[-1], item.answer)
        if number % 7:
            answers.append(Answer(item.id, "slots", replies[number % 5]))
    write_answers(mixed, answers)

    done = run(right, mixed, "--data", data, "--floor", "chance",
               "--write-floors", floors, "--report", report)  # fmt: skip

    assert done.exit_code == 0, done.output
    assert done.output.replace(str(tmp_path), "FOLDER") == snapshot(name="printed")
    _, mixed_report = report.read_text().split("\n## mixed, slots\n")
    assert mixed_report.partition("\n## chance, slots")[0] == snapshot(name="report")
    assert len(read_answers(floors / "chance.jsonl", items())) == 3 * len(some)


def test_items_of_several_splits_are_not_scored_together():
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
def test_wrong_commands_are_one_sentence(tmp_path, arguments, words):
    write_items(items(), tmp_path)
    done = run("--data", tmp_path, *arguments)
    with pytest.raises(InvalidValueError, match=words):
        raise done.exception
