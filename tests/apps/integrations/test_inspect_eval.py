"""The task in the real Inspect: `make integrations` runs this in its environment."""

import pytest

pytest.importorskip("inspect_ai", reason="Inspect is not installed here; run `make integrations`")

from inspect_ai.log import read_eval_log
from page_commands import check_versions, run_page
from planning_fakes import fake_vlm, words_of
from replay_table import (
    EPISODES,
    MANY,
    MAX_STEPS,
    PER_TASK,
    PLAYED,
    SETTING,
    cases,
    own_outcomes,
)

from roboirg.language import instruct
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.tasks.splits.splits import get_episode

pytestmark = pytest.mark.sim

SAMPLES = [1, 2, 8] if MANY else [2]
"""Episodes at a time."""


@pytest.fixture(scope="module")
def replies():
    """By what is said: the right goal in every other episode, else a wrong one."""
    found = {}
    for task, index in cases():
        episode = get_episode(task, "test", index)
        goals = goal_schema(task).goals.items()
        is_right = index % 2 == 0
        text = next(text for text, goal in goals if (goal == episode.goal) == is_right)
        found[instruct(episode, SETTING).text] = text
    assert len(found) == EPISODES
    return found


@pytest.fixture(scope="module")
def model(replies):
    """A server that knows the replies."""

    def answer(body):
        (reply,) = [reply for text, reply in replies.items() if text in words_of(body)]
        return reply

    with fake_vlm(answer) as server:
        yield server


@pytest.fixture(scope="module")
def ours(model):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("OPENAI_API_KEY", "none")
        spec = f"vlm-listener:openai?base_url={model.url}/v1&model=gpt-4o"
        return own_outcomes(spec, meshes="faithful")


@pytest.fixture(scope="module", params=SAMPLES)
def inspect_log(model, request, tmp_path_factory):
    """Inspect's log of the page's command, in which the server of `model` replies.

    The page says `tasks=all`; instead, the episodes of `cases` are played, as many at a time as the
    parameter says.
    """
    model.requests.clear()
    folder = tmp_path_factory.mktemp("inspect")
    options = f"-T episodes={PER_TASK} -T max_steps={MAX_STEPS} --max-samples {request.param}"
    run_page(
        "Inspect",
        folder,
        {"tasks=all": f"tasks={','.join(PLAYED)} {options} --display plain"},
        OPENAI_BASE_URL=f"{model.url}/v1",
        OPENAI_API_KEY="none",
    )
    (path,) = (folder / "logs").glob("*.eval")
    return read_eval_log(str(path))


def records_in(log):
    """Return our record of each episode, which Inspect keeps in the metadata of the score."""
    scores = [score for sample in log.samples for score in sample.scores.values()]
    return [score.metadata["record"] for score in scores]


def test_inspect_and_our_runner_agree_on_success_and_steps_of_each_episode(inspect_log, ours):
    """`inspect_log` is of the documented command, `ours` of our own runner.

    The model of both is one scripted server, which names the right goal in every other episode, so
    there are successes and failures. Each entry is the task, the episode, whether it succeeded, and
    its steps.
    """
    found = []
    for record in records_in(inspect_log):
        is_success = record["outcome"] == "success"
        found.append((record["task"], record["episode"], is_success, record["steps"]))

    assert sorted(found) == sorted(ours)


def test_a_success_scores_1_and_a_failure_0_and_inspect_reports_the_accuracy(inspect_log):
    """`inspect_log` is of the documented command with a scripted model, right in every other
    episode; each of its samples is one episode, with one score and our record in its metadata."""
    scores = [score for sample in inspect_log.samples for score in sample.scores.values()]

    assert scores
    for score in scores:
        assert score.value == (score.metadata["record"]["outcome"] == "success")
    assert any("accuracy" in result.metrics for result in inspect_log.results.scores)


def test_the_model_is_asked_once_an_episode_and_told_neither_setting_nor_seed(model, inspect_log):
    """`model` is the scripted server that kept the requests of the command behind `inspect_log`;
    it counts 100 input tokens for each reply, and a record has those of its episode.

    The command says `setting=contextual`. With this name or the seed, a model could know more than
    it is told in words.
    """
    told = "\n".join(words_of(request) for request in model.requests)

    assert len(model.requests) == len(inspect_log.samples)
    for record in records_in(inspect_log):
        assert record["usage"]["input_tokens"] == 100
        assert record["options"]["setting"] == "contextual"
        assert "contextual" not in told
        assert str(record["seed"]) not in told


def test_the_page_names_the_version_that_is_played():
    check_versions("Inspect")
