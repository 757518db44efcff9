"""The task in the real Inspect: `make integrations` runs this in its environment."""

import os
import subprocess
import sys
from pathlib import Path

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
    TASKS,
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
    scores = [next(iter(one.scores.values())) for one in log.samples]
    records = [one.metadata["record"] for one in scores]
    found = [(one["task"], one["episode"], one["outcome"] == "success", one["steps"])
             for one in records]  # fmt: skip
    assert sorted(found) == sorted(ours)
    assert {one["options"]["setting"] for one in records} == {SETTING}
    assert {one["usage"]["input_tokens"] for one in records} == {TOKENS[0]}
    assert sum(one.value for one in scores) == sum(success for _, _, success, _ in ours)
    assert any("accuracy" in one.metrics for one in log.results.scores)
    told = "\n".join(map(words_of, model.requests))
    assert len(model.requests) == EPISODES
    for secret in (SETTING, *(str(one["seed"]) for one in records)):
        assert secret not in told


def test_the_page_names_the_version_that_is_played():
    check_versions("Inspect")


def test_the_entry_point_plays_several_tasks_by_inspect_s_command(tmp_path):
    command = [
        str(Path(sys.executable).with_name("inspect")), "eval", "roboirg/listener",
        "--model", "mockllm/model", "--display", "plain", "--log-dir", str(tmp_path),
        "-T", f"tasks={','.join(TASKS[::3])}", "-T", "episodes=1", "-T", "max_steps=20",
    ]  # fmt: skip
    # Inspect's mock model counts tokens with a tokenizer that it downloads; here it counts letters.
    counter = tmp_path / "offline" / "tiktoken.py"
    counter.parent.mkdir()
    counter.write_text(
        "class Letters:\n"
        "    def encode(self, text, **_):\n"
        "        return list(text)\n"
        "def get_encoding(_):\n"
        "    return Letters()\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(counter.parent)}
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, cwd=tmp_path, env=environment
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    (path,) = tmp_path.glob("*.eval")
    samples = read_eval_log(str(path)).samples
    names = [f"{one}-contextual-000" for one in TASKS[::3]]
    assert sorted(one.id for one in samples) == sorted(names)
    for sample in samples:
        (score,) = sample.scores.values()
        assert score.value == 0
        assert score.explanation == "not done after 20 steps"
        assert score.metadata["record"]["usage"]["unparsed"] == 1
