"""The task in the real Inspect: `make integrations` runs this in its environment."""

import pytest

pytest.importorskip("inspect_ai", reason="Inspect is not installed here; run `make integrations`")

from inspect_ai.log import read_eval_log
from page_commands import check_versions, run_page
from planning_fakes import TOKENS, fake_vlm, words_of
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


@pytest.mark.parametrize("samples", SAMPLES)
def test_the_page_s_commands_have_the_outcomes_of_our_runner(model, ours, tmp_path, samples):
    """The page's commands are played by Inspect with a scripted model, right in every other
    episode. Replaced are the tasks, and how many episodes are played, and how many at a time.
    `ours` has outcomes of our runner with the same model: they agree in success and steps. The
    model is told neither setting nor seed, and is asked once an episode.
    """
    model.requests.clear()
    more = f"-T episodes={PER_TASK} -T max_steps={MAX_STEPS}"

    run_page(
        "Inspect",
        tmp_path,
        {"tasks=all": f"tasks={','.join(PLAYED)} {more} --max-samples {samples} --display plain"},
        OPENAI_BASE_URL=f"{model.url}/v1",
        OPENAI_API_KEY="none",
    )

    (path,) = (tmp_path / "logs").glob("*.eval")
    log = read_eval_log(str(path))
    successes = 0
    found = []
    for sample in log.samples:
        (score,) = sample.scores.values()
        record = score.metadata["record"]
        assert record["options"]["setting"] == SETTING
        assert record["usage"]["input_tokens"] == TOKENS[0]
        is_success = record["outcome"] == "success"
        found.append((record["task"], record["episode"], is_success, record["steps"]))
        successes += score.value
        check_not_told(model, SETTING, str(record["seed"]))
    assert sorted(found) == sorted(ours)
    assert successes == sum(is_success for _, _, is_success, _ in ours)
    assert any("accuracy" in score.metrics for score in log.results.scores)
    assert len(model.requests) == EPISODES


def check_not_told(model, *secrets):
    """Check that no request to the model had these words."""
    told = "\n".join(map(words_of, model.requests))
    for secret in secrets:
        assert secret not in told


def test_the_page_names_the_version_that_is_played():
    check_versions("Inspect")
