"""The VLM listener as a task of Inspect: its model names the goal, the expert executes it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import anyio
import msgspec
from inspect_ai import Task, task
from inspect_ai.dataset import MemoryDataset, Sample
from inspect_ai.model import (
    ChatMessage,
    ChatMessageAssistant,
    ChatMessageSystem,
    ChatMessageUser,
    Content,
    ContentImage,
    ContentText,
    GenerateConfig,
    Model,
    ModelOutput,
    ResponseSchema,
    get_model,
)
from inspect_ai.scorer import Score, Scorer, Target, accuracy, grouped, scorer, stderr
from inspect_ai.solver import Generate, Solver, TaskState, solver
from inspect_ai.util import JSONSchema

from roboirg.apps.integrations.inspect.episode_process import SPEC, ModelRequest, play
from roboirg.core.environment_options import MAX_STEPS, EnvironmentOptions
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.errors import RoboIRGError
from roboirg.core.instruction_options import DEFAULT_DELIVERY, InstructionOptions
from roboirg.policies.by_name.finding import read_policy
from roboirg.policies.vlm.models import ModelOptions, ModelReply
from roboirg.policies.vlm.vlm_listener import ListenerOptions
from roboirg.records.record import Job
from roboirg.tasks import find_tasks
from roboirg.tasks.splits.splits import split_size
from roboirg.util.child_process import ChildExit, ChildProcess
from roboirg.util.reply_reading import CUT_OFF

RECORD = "record"
"""Under this key the metadata of a score hold our record."""
SUCCESS = "success"
VIA = "http://inspect"
"""Address of the model in records: it is Inspect that knows the real one."""


@task  # type: ignore[untyped-decorator] # Inspect is not installed where this is checked
def listener(
    setting: str = "contextual",
    tasks: str | list[str] = "all",
    split: str = "test",
    episodes: int = 50,
    delivery: str = DEFAULT_DELIVERY,
    max_steps: int = MAX_STEPS,
    frames: int = 16,
    think: bool = False,
    structured: bool = True,
) -> Task:
    """Instructions whose goal a vision-language model names and the scripted expert executes.

    Args:
        setting: name of a setting, such as contextual or direct-rival.
        tasks: names of tasks or suites, separated by commas, or a list of them.
        split: train, val, test or random.
        episodes: number of episodes of each task, from 0 on.
        delivery: prompt or turns.
        max_steps: control steps of an episode.
        frames: most pictures of the video.
        think: whether the answer begins with a field in which the model may think.
        structured: whether to send the JSON schema of the answer.
    """
    count = min(episodes, split_size(split))
    names = tasks.split(",") if isinstance(tasks, str) else tasks
    policy = read_policy(SPEC, "vlm-listener")
    samples = []
    for name in find_tasks(names):
        for episode in range(count):
            job = Job(
                policy=policy.name,
                ref=policy,
                task=name,
                split=split,
                episode=episode,
                options=InstructionOptions(setting, delivery=delivery),
                environment=EnvironmentOptions(max_steps),
            )
            samples.append(_sample(job))
    return Task(
        dataset=MemoryDataset(samples, name="roboirg"),
        solver=play_with_model(frames=frames, think=think, structured=structured),
        scorer=grounds_reference(),
        version=ENVIRONMENT_VERSION,
    )


def _sample(job: Job) -> Sample:
    """Return an episode as Inspect takes it."""
    from roboirg.runs.job_instruction import instruct_job

    return Sample(
        input=instruct_job(job).text,
        target=SUCCESS,
        id=f"{job.task}-{job.setting}-{job.episode:03d}",
        metadata={"task": job.task, "setting": job.setting, "job": msgspec.to_builtins(job)},
    )


@solver  # type: ignore[untyped-decorator]
def play_with_model(frames: int = 16, think: bool = False, structured: bool = True) -> Solver:
    """Play the sample's episode in a process of its own and ask the evaluated model there.

    Args:
        frames: most pictures of the video.
        think: whether the answer begins with a field in which the model may think.
        structured: whether to send the JSON schema of the answer.
    """

    async def solve(state: TaskState, generate: Generate) -> TaskState:  # noqa: ARG001
        """Play the sample's job; store the record, and return the goal as the state's output."""
        model = get_model()
        model_options = ModelOptions(
            model=str(model), base_url=VIA, structured=structured, clip_frames=frames
        )
        options = ListenerOptions(model=model_options, frames=frames, reasoning=think)
        job = msgspec.convert(state.metadata["job"], Job)
        job = msgspec.structs.replace(job, policy=f"vlm-listener:inspect?model={model}")
        record = await _play(model, job, options, state)
        if record["outcome"] == "error":
            raise RoboIRGError(record["cause"])  # Inspect counts errors apart
        state.store.set(RECORD, record)
        goal = record["policy_metadata"].get("understood")
        state.output = ModelOutput.from_content(str(model), json.dumps(goal))
        return state

    return solve


async def _play(
    model: Model, job: Job, options: ListenerOptions, state: TaskState
) -> dict[str, Any]:
    """Play an episode in a process of its own and return its record.

    The process sends requests to the model, each of which is answered here, and at last the record.
    Whatever happens, the process is ended.

    Raises:
        RoboIRGError: the process was lost.
    """
    # The kernel ends the child with the thread that started it, so that must be this one.
    child = ChildProcess.spawn(play, job, options)
    try:
        while True:
            message = await anyio.to_thread.run_sync(child.receive, abandon_on_cancel=True)
            if isinstance(message, ChildExit):
                raise RoboIRGError(f"The process of {state.sample_id} was lost: {message}.")
            if not isinstance(message, ModelRequest):
                record: dict[str, Any] = json.loads(message)
                return record
            reply = await _ask(model, message, options, state)
            await anyio.to_thread.run_sync(child.send, reply)
    finally:
        child.end()


async def _ask(
    model: Model, request: ModelRequest, options: ListenerOptions, state: TaskState
) -> ModelReply:
    """Return the model's reply to a request of the playing process.

    The state's messages become those of this request and the reply. Inspect keeps a model's
    thoughts apart, so the reply has none.
    """
    config = GenerateConfig()
    if request.schema is not None and options.model.structured:
        json_schema = JSONSchema.model_validate(request.schema)
        answer = ResponseSchema(name="answer", json_schema=json_schema)
        config = GenerateConfig(response_schema=answer)
    messages = [_chat_message(message) for message in request.messages]
    output = await model.generate(messages, config=config)
    state.messages = messages
    text = output.completion
    if output.choices:
        state.messages = [*messages, output.message]
        if output.stop_reason == "max_tokens":
            text += CUT_OFF
    usage = output.usage
    if usage is None:
        return ModelReply(text)
    return ModelReply(text, usage.input_tokens, usage.output_tokens)


def _chat_message(message: dict[str, Any]) -> ChatMessage:
    """Return a message of OpenAI's chat completions as Inspect's.

    ``{"role": "system", "content": "…"}``; a user's content is a list of texts and pictures.
    """
    content = message["content"]
    if message["role"] == "system":
        return ChatMessageSystem(content=content)
    if message["role"] == "assistant":
        return ChatMessageAssistant(content=content)
    return ChatMessageUser(content=list(_contents(content)))


def _contents(pieces: list[dict[str, Any]]) -> Iterator[Content]:
    """Yield the texts and pictures of a user's message as Inspect's, in order."""
    for piece in pieces:
        if piece["type"] == "text":
            yield ContentText(text=piece["text"])
        else:
            yield ContentImage(image=piece["image_url"]["url"])


@scorer(  # type: ignore[untyped-decorator]
    metrics=[accuracy(), stderr(), grouped(accuracy(), "task"), grouped(accuracy(), "setting")]
)
def grounds_reference() -> Scorer:
    """Score 1 if the episode succeeded, else 0; the explanation says why it failed."""

    async def score(state: TaskState, target: Target) -> Score:  # noqa: ARG001
        """Score the record that the solver has stored; 0 without one."""
        record = state.store.get(RECORD)
        if record is None:
            return Score(value=0, explanation="The episode was not played.")
        attribution = record["attribution"] or {}
        return Score(
            value=int(record["outcome"] == SUCCESS),
            answer=state.output.completion,
            explanation=record["cause"] or SUCCESS,
            metadata={"failure": attribution.get("failure"), RECORD: record},
        )

    return score
