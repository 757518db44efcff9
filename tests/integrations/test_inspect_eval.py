"""The task in the real Inspect: `make integrations` runs this in its environment."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("inspect_ai", reason="Inspect is not installed here; run `make integrations`")

import inspect_ai
from inspect_ai.log import read_eval_log
from inspect_ai.model import ModelOutput, ModelUsage, get_model

from roboirg.episodes.splits import get_episode
from roboirg.evaluation.rollout import play_episode
from roboirg.integrations.result_import import ImportOptions, import_results
from roboirg.policies.planning.goal_schema import goal_schema
from roboirg.policies.planning.models import ModelOptions, ModelReply
from roboirg.policies.planning.vlm_listener import ListenerOptions, VLMListener
from roboirg.records.record import Job, Record
from roboirg.records.store import read_records

pytestmark = pytest.mark.sim

HERE = Path(__file__).parent
TASK, SETTING, MAX_STEPS = "VideoUnmask", "spatial", 110
EPISODES = int(os.environ.get("ROBOIRG_EQUALITY_EPISODES", "4"))


def replies():
    """Return what the model says: the right goal, then that of the episode before, in turn."""
    texts = {goal: text for text, goal in goal_schema(TASK).goals.items()}
    goals = [get_episode(TASK, "test", index).goal for index in range(EPISODES)]
    return [texts[goals[index - index % 2]] for index in range(EPISODES)]


class KnownListener(VLMListener):
    """Our listener in front of a model with known replies."""

    reply = ""

    def __init__(self, seed=0):
        options = ListenerOptions(model=ModelOptions(model="known"))
        super().__init__(options, seed, lambda _: self)

    def answer(self, query):
        return ModelReply(self.reply)

    def close(self):
        pass


def test_outcomes_are_those_of_our_runner(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(HERE))
    import test_inspect_eval as module

    ours = []
    for index, text in enumerate(replies()):
        monkeypatch.setattr(module.KnownListener, "reply", text)
        job = Job(
            policy="test_inspect_eval:KnownListener", task=TASK, split="test", setting=SETTING,
            episode=index, max_steps=MAX_STEPS,
        )  # fmt: skip
        ours.append(play_episode(job))
    assert {one.outcome for one in ours} == {"success", "failure"}, ours
    outputs = [ModelOutput.from_content("mockllm/model", text) for text in replies()]
    for output in outputs:  # otherwise the mock model downloads a tokenizer to count
        output.usage = ModelUsage(input_tokens=7, output_tokens=3, total_tokens=10)
    (log,) = inspect_ai.eval(
        "roboirg/listener",
        model=get_model("mockllm/model", custom_outputs=outputs),
        task_args={
            "tasks": TASK, "setting": SETTING, "episodes": EPISODES, "max_steps": MAX_STEPS,
        },
        max_samples=1, display="plain", log_dir=str(tmp_path),
    )  # fmt: skip
    assert log.status == "success", log.error
    scores = [next(iter(one.scores.values())) for one in log.samples]
    records = [Record.model_validate(one.metadata["record"]) for one in scores]
    assert [one.outcome for one in records] == [one.outcome for one in ours]
    assert [one.steps for one in records] == [one.steps for one in ours]
    assert {one.usage["input_tokens"] for one in records} == {7}
    assert [one.value for one in scores] == [one.outcome == "success" for one in ours]
    convert = [
        str(Path(sys.executable).with_name("inspect")), "log", "convert", str(tmp_path),
        "--to", "json", "--output-dir", str(tmp_path / "json"),
    ]  # fmt: skip
    subprocess.run(convert, check=True, capture_output=True)
    (path,) = (tmp_path / "json").glob("*.json")
    assert import_results("inspect", path, tmp_path / "run", ImportOptions("gpt")) == EPISODES
    imported = read_records(tmp_path / "run")
    assert [one.model_copy(update={"policy": records[0].policy}) for one in imported] == records
    metrics = {one.name: one.metrics for one in log.results.scores}
    assert any("accuracy" in one for one in metrics.values())
    for sample, record in zip(log.samples, records, strict=True):
        told = json.dumps([message.model_dump(mode="json") for message in sample.messages[:2]])
        assert SETTING not in told
        assert str(record.seed) not in told
        assert record.instruction[0].text.split(".")[0] in told


def test_the_entry_point_is_found_by_inspect_s_command(tmp_path):
    command = [
        str(Path(sys.executable).with_name("inspect")), "eval", "roboirg/listener",
        "--model", "mockllm/model", "--display", "plain", "--log-dir", str(tmp_path),
        "-T", f"tasks={TASK}", "-T", "episodes=1", "-T", "max_steps=20",
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
    (sample,) = read_eval_log(str(path)).samples
    assert sample.id == f"{TASK}-contextual-000"
    (score,) = sample.scores.values()
    assert score.value == 0
    assert score.explanation == "not done after 20 steps"
    assert score.metadata["record"]["usage"]["unparsed"] == 1
