"""The listener, Inspect and our scores give the same verdict on the same two hundred answers."""

import functools
import itertools
import json

import numpy as np
import pytest
from msgspec.structs import replace
from planning_fakes import fake_vlm, make_listener, stand_in

from roboirg.apps.grounding.answer_scores import score_answers
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.grounding_items.answer_file import Answer
from roboirg.evaluation.grounding_items.grounding_item import PointTarget, write_items
from roboirg.evaluation.grounding_items.item_builder import make_items, wanted_options
from roboirg.evaluation.grounding_items.media_store import EpisodeMedia, store_content
from roboirg.language import plain_settings
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.shortcuts.command_chance import is_right
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.media import Picture, encode_png

NUMBER = 200
PICTURE = encode_png(Picture(np.zeros((256, 256, 3), np.uint8)))


@functools.cache
def items(count=NUMBER):
    point = PointTarget(kind="cube", x=0, y=0, size=(256, 256), counts=[0, 1, 256**2 - 1])
    name = "pictures/black.png"
    media = EpisodeMedia(name, None, (), 0, (point,))
    found = []
    for index, task in itertools.product(range(20), all_tasks()):
        episode = get_episode(task, "test", index)
        options = wanted_options(
            episode, plain_settings(), ("implicit",), InstructionOptions(), every_variant=False
        )
        found += make_items(episode, media, list(options))
        if len(found) >= count:
            break
    return found[:count]


@functools.cache
def replies():
    """By item: right, wrong, of no scene, and unusable answers, in many shapes."""
    rng = np.random.default_rng(22)
    found = {}
    for number, item in enumerate(items()):
        goals = list(goal_schema(item.task).goals)
        other = goals[int(rng.integers(len(goals)))]
        within = item.goals[int(rng.integers(len(item.goals)))]
        answer = json.loads(item.answer)
        shapes = (
            item.answer,
            f"I see. ```json\n{item.answer}\n```",
            other,
            within,
            item.answer.upper().replace("NULL", "null"),
            json.dumps({**answer, "why": "because"}),
            json.dumps(dict(list(answer.items())[1:])),
            json.dumps(dict.fromkeys(answer, 1)),
            "No idea.",
            "",
        )
        found[item.id] = shapes[number % len(shapes)]
    return found


@functools.cache
def own_verdicts():
    answers = [Answer(name, "slots", reply) for name, reply in replies().items()]
    (score,) = score_answers(items(), answers, "scripted")
    return {item.id: verdict.right for item, verdict in score.judged}


def listener_verdict(policy, item):
    episode = get_episode(item.task, item.split, item.episode)
    goal = policy.decide(stand_in(episode, item.setting), item.text)
    return goal is not None and is_right(goal, episode)


@pytest.mark.slow
def test_the_listener_and_our_scores_agree():
    assert len(items()) == NUMBER
    assert 40 < sum(own_verdicts().values()) < 160
    with fake_vlm(["{}"]) as server:
        policy = make_listener(server)
        for item in items():
            server.answer = lambda _body, item=item: replies()[item.id]
            assert listener_verdict(policy, item) == own_verdicts()[item.id], item.id


def test_the_listener_is_asked_what_the_dataset_asks():
    item = next(one for one in items(5) if one.setting == "direct")
    with fake_vlm([item.answer]) as server:
        policy = make_listener(server)
        assert listener_verdict(policy, item)
        system, user = server.requests[0]["messages"]
    texts = [part["text"] for part in user["content"] if part["type"] == "text"]
    assert texts == [item.said, item.shown, item.now, item.slots_question]
    assert system["content"] == item.slots_system or item.slots_system in json.dumps(
        system["content"], ensure_ascii=False
    ).replace("\\n", "\n")


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inspect") / "set"
    stored = store_content(folder, "pictures", PICTURE, ".png")
    write_items([replace(item, picture=stored) for item in items()], folder)
    return folder


def run_inspect(data, replies_of, logs, question="slots", **options):
    inspect_ai = pytest.importorskip("inspect_ai")
    from inspect_ai.model import ModelOutput, ModelUsage, get_model

    from roboirg.apps.integrations.inspect.inspect_grounding import roboirg_grounding

    def reply(messages, tools, tool_choice, config):
        found = ModelOutput.from_content("mockllm/model", replies_of(messages))
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


def test_inspect_and_our_scores_agree(data, tmp_path):
    pytest.importorskip("inspect_ai")
    from roboirg.apps.integrations.inspect.inspect_grounding import log_answers

    by_question = {(item.said, item.slots_question): item.id for item in items()}
    tries = []

    def scripted(messages):
        texts = [part.text for part in messages[1].content if part.type == "text"]
        tries.append(len(messages))
        return replies()[by_question[texts[0], texts[-1]]]

    # Two items of one task may have the same words; their answers are then the same too.
    wanted = {item.id: replies()[by_question[item.said, item.slots_question]] for item in items()}
    log = run_inspect(data, scripted, tmp_path)
    answers = [Answer(name, "slots", reply) for name, reply in wanted.items()]
    (score,) = score_answers(items(), answers, "scripted")
    ours = {item.id: verdict.right for item, verdict in score.judged}
    theirs = {str(one.id): bool(one.scores["right"].value) for one in log.samples}
    assert theirs == ours
    assert len(theirs) == NUMBER
    assert {one.id: one.reply for one in log_answers(log)} == wanted
    unusable = sum(verdict.understood is None for _, verdict in score.judged)
    assert tries.count(4) == unusable > 0  # each of them was asked once more
    metrics = log.results.scores[0].metrics
    assert metrics["accuracy"].value == pytest.approx(sum(ours.values()) / NUMBER)
    assert metrics["direct"].value > 0


@pytest.mark.parametrize("question", ["choice", "points"])
def test_inspect_asks_the_other_questions(data, tmp_path, question):
    pytest.importorskip("inspect_ai")
    right = {item.question(question) + item.said: item for item in items()}

    def scripted(messages):
        content = messages[1].content
        assert sum(part.type == "image" for part in content) == 1
        item = right[content[-1].text + content[0].text]
        return item.choice if question == "choice" else '{"x": 0, "y": 0}'

    log = run_inspect(
        data, scripted, tmp_path, question, settings="direct", tasks="PickXtimes,StopCube"
    )
    assert {one.metadata["setting"] for one in log.samples} == {"direct"}
    assert log.results.scores[0].metrics["accuracy"].value == 1


def test_inspect_says_what_is_wrong(data):
    pytest.importorskip("inspect_ai")
    from roboirg.apps.integrations.inspect.inspect_grounding import roboirg_grounding
    from roboirg.core.errors import InvalidValueError

    with pytest.raises(InvalidValueError, match="no question 'poem'"):
        roboirg_grounding(data=str(data), question="poem")
    with pytest.raises(InvalidValueError, match="has no items with the settings sung"):
        roboirg_grounding(data=str(data), settings="sung")
