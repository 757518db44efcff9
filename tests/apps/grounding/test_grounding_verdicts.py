"""Inspect and our scores give the same verdict on the same answers."""

import functools

import numpy as np
import pytest
from made_items import items_of
from msgspec.structs import replace
from planning_fakes import fake_vlm, make_listener, stand_in, words_of

from roboirg.apps.grounding.answer_scores import score_answers
from roboirg.apps.grounding.items.answer_file import Answer
from roboirg.apps.grounding.items.grounding_item import write_items
from roboirg.apps.grounding.items.media_store import store_content
from roboirg.apps.grounding.items.verdicts import judge_reply, right_reply
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.shortcuts.command_chance import is_right
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.media import Picture, encode_png
from roboirg.util.reply_reading import CUT_OFF

PICTURE = encode_png(Picture(np.zeros((256, 256, 3), np.uint8)))


@functools.cache
def items():
    """The items of the first episode of each task, in all settings."""
    found = []
    for task in all_tasks():
        found += items_of(task, 0)[1]
    return found


@functools.cache
def replies():
    """By what is asked: right, wrong and unusable answers."""
    found = {}
    for number, item in enumerate(items()):
        wrong = next(goal for goal in goal_schema(item.task).goals if goal not in item.answers)
        found[asked(item)] = (f"I see. {item.answer}", wrong, "No idea.")[number % 3]
    return found


def asked(item):
    """The words of the instruction and of the question, by which a scripted model knows an item."""
    return item.said, item.slots_question


@functools.cache
def own_verdicts():
    """Our verdicts on the scripted replies about slots, by the items' ids."""
    answers = [Answer(item.id, "slots", replies()[asked(item)]) for item in items()]
    (score,) = score_answers(items(), answers, "scripted")
    return {item.id: verdict for item, verdict in score.judged}


def test_the_listener_is_asked_what_the_dataset_asks_and_takes_its_answer():
    """A vision-language listener plays: a model reads the instruction and names the goal. Here the
    model is a server that always replies with the right answer of an item of the dataset, so the
    goal is right.

    The request that the server got has the texts of the item in their order: what was said, what
    the pictures show, and the question.
    """
    item = next(item for item in items() if item.setting == "direct")
    episode = get_episode(item.task, item.split, item.episode)
    with fake_vlm([item.answer]) as server:
        goal = make_listener(server).decide(stand_in(episode, item.setting), item.text)
        assert is_right(goal, episode)
        system, user = server.requests[0]["messages"]

    texts = [part["text"] for part in user["content"] if part["type"] == "text"]

    assert texts == [item.said, item.shown, item.now, item.slots_question]
    assert item.slots_system in words_of({"messages": [system]})


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """The folder of a dataset of the items, all with one black picture."""
    folder = tmp_path_factory.mktemp("inspect") / "set"
    stored = store_content(folder, "pictures", PICTURE, ".png")
    write_items([replace(item, picture=stored) for item in items()], folder)
    return folder


def run_inspect(data, replies_of, logs, question="slots", stop_reason="stop", **options):
    """Run our task in Inspect with a model that answers by `replies_of`; return the log."""
    inspect_ai = pytest.importorskip("inspect_ai")
    from inspect_ai.model import ModelOutput, ModelUsage, get_model

    from roboirg.apps.grounding.inspect_grounding import roboirg_grounding

    def reply(messages, tools, tool_choice, config):
        found = ModelOutput.from_content(
            "mockllm/model", replies_of(messages), stop_reason=stop_reason
        )
        found.usage = ModelUsage(input_tokens=1, output_tokens=1, total_tokens=2)
        return found

    (log,) = inspect_ai.eval(
        roboirg_grounding(data=str(data), question=question, **options),
        model=get_model("mockllm/model", custom_outputs=reply),
        display="none",
        log_dir=str(logs),
        log_format="json",
    )
    assert log.status == "success", log.error
    return log


@pytest.fixture(scope="module")
def scripted_log(data, tmp_path_factory):
    """Inspect's log of a model that gives `replies`: right, wrong and unusable ones by turns."""

    def reply(messages):
        texts = [part.text for part in messages[1].content if part.type == "text"]
        return replies()[texts[0], texts[-1]]

    return run_inspect(data, reply, tmp_path_factory.mktemp("logs"))


def test_inspect_and_our_scores_have_the_same_verdict_on_each_reply(scripted_log):
    """In `scripted_log`, Inspect judged right, wrong and unusable replies; `own_verdicts` are those
    of `score_answers` on the same replies, by the items' ids. The accuracy is the share of right
    ones; a third of them is right in *direct*, which has an accuracy of its own."""
    expected = {name: verdict.right for name, verdict in own_verdicts().items()}

    found = {}
    for sample in scripted_log.samples:
        found[str(sample.id)] = bool(sample.scores["right"].value)

    metrics = scripted_log.results.scores[0].metrics
    assert found == expected
    assert metrics["accuracy"].value == pytest.approx(np.mean(list(expected.values())))
    assert metrics["direct"].value > 0


def test_the_answers_of_an_inspect_log_are_the_replies_of_the_model(scripted_log):
    """`replies` has what the scripted model says about each item."""
    from roboirg.apps.grounding.inspect_grounding import log_answers

    given = {answer.id: answer.reply for answer in log_answers(scripted_log)}

    assert given == {item.id: replies()[asked(item)] for item in items()}


def test_inspect_asks_for_an_unusable_reply_once_more(scripted_log):
    """A conversation has three messages: the system's, the question and the reply. With a second
    request and its reply, it has five. A verdict in which nothing was understood is of an unusable
    reply."""
    verdicts = own_verdicts()

    asked_twice = {str(sample.id) for sample in scripted_log.samples if len(sample.messages) == 5}

    assert asked_twice
    assert asked_twice == {name for name in verdicts if verdicts[name].understood is None}


@pytest.mark.parametrize("question", ["choice", "points"])
def test_inspect_asks_the_other_questions(data, tmp_path, question):
    """The first text of a request is the instruction, its last the question, which tell the item;
    between them is one picture, as the dataset has no video here.

    A scripted model gives the right reply, so the accuracy is 1. Options leave of the dataset the
    items of one task in *direct*.
    """
    pytest.importorskip("inspect_ai")
    item_by_texts = {(item.said, item.question(question)): item for item in items()}

    def reply(messages):
        said, *between, asked_last = messages[1].content
        assert [part.type for part in between].count("image") == 1
        return right_reply(item_by_texts[said.text, asked_last.text], question)

    log = run_inspect(data, reply, tmp_path, question, settings="direct", tasks="PickXtimes")

    assert {sample.metadata["setting"] for sample in log.samples} == {"direct"}
    assert log.results.scores[0].metrics["accuracy"].value == 1


def test_inspect_says_what_is_wrong(data):
    """A question and a setting that do not exist are refused by their names."""
    pytest.importorskip("inspect_ai")
    from roboirg.apps.grounding.inspect_grounding import roboirg_grounding
    from roboirg.core.errors import InvalidValueError

    with pytest.raises(InvalidValueError, match="no question 'poem'"):
        roboirg_grounding(data=str(data), question="poem")
    with pytest.raises(InvalidValueError, match="has no items with the settings sung"):
        roboirg_grounding(data=str(data), settings="sung")


@pytest.mark.parametrize(
    ("question", "reply", "understood"),
    [
        ("choice", "Answer: A. But wait,", None),
        ("slots", 'It may be {"color": "red"}, or', None),
        ("slots", '{"color": "red", "repeats": 2}', '{"color": "red", "repeats": 2}'),
    ],
    ids=["a draft of a letter", "a draft of slots", "whole slots, cut off after them"],
)
def test_a_draft_that_was_cut_off_is_no_answer(question, reply, understood):
    """Another answer may have followed, so it is unreadable instead of right or wrong."""
    item = next(item for item in items() if item.task == "PickXtimes")

    verdict = judge_reply(item, question, reply + CUT_OFF)

    assert verdict.understood == understood


def test_inspect_marks_replies_that_reached_the_limit_of_tokens(data, tmp_path):
    """The model stops in "Answer: A. But" for its limit; the draft is marked, and not right."""
    pytest.importorskip("inspect_ai")
    from roboirg.apps.grounding.inspect_grounding import log_answers

    log = run_inspect(
        data,
        lambda _messages: "Answer: A. But",
        tmp_path,
        question="choice",
        stop_reason="max_tokens",
        settings="direct",
        tasks="StopCube",
    )

    assert {answer.reply for answer in log_answers(log)} == {"Answer: A. But" + CUT_OFF}
    assert log.results.scores[0].metrics["accuracy"].value == 0
