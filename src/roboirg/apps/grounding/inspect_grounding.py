"""The grounding dataset as a task of Inspect.

```sh
inspect eval roboirg/apps/grounding/inspect_grounding.py -T data=grounding --model openai/gpt-4o
```

The slots question is the listener's, second try included, and verdicts are those of
`roboirg score grounding`.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path

from inspect_ai import Task, task
from inspect_ai.dataset import MemoryDataset, Sample
from inspect_ai.log import EvalLog
from inspect_ai.model import (
    ChatMessageSystem,
    ChatMessageUser,
    Content,
    ContentImage,
    ContentText,
    ModelOutput,
)
from inspect_ai.scorer import Score, Scorer, Target, accuracy, grouped, scorer, stderr
from inspect_ai.solver import Generate, Solver, TaskState, solver

from roboirg.apps.grounding.items.answer_file import Answer
from roboirg.apps.grounding.items.grounding_item import (
    QUESTION_KINDS,
    GroundingItem,
    QuestionKind,
    read_items,
)
from roboirg.apps.grounding.items.verdicts import judge_reply, right_reply
from roboirg.core.errors import InvalidValueError, known_name
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.policies.vlm.listener_query import PROMPTS, QuestionTexts
from roboirg.policies.vlm.prompt_files import load_prompts
from roboirg.policies.vlm.vlm_query import SILENCE
from roboirg.runs.plan.option_parsing import means_all, parse_names
from roboirg.util.reply_reading import CUT_OFF, UnparsableReplyError, check_whole

EPISODE = "episode"


@task
def roboirg_grounding(
    data: str = "grounding", question: str = "slots", settings: str = "all", tasks: str = "all"
) -> Task:
    """Ask one kind of question about every item of an exported dataset: a task of Inspect.

    Args:
        data: folder that `roboirg export grounding` wrote.
        question: slots, choice or points.
        settings: names of settings, separated by commas, or all.
        tasks: names of tasks, separated by commas, or all.

    Raises:
        InvalidValueError: the folder holds no dataset, or none of its items is selected.
        UnknownNameError: there is no such question.
    """
    kind = known_name("question", question, QUESTION_KINDS)
    samples = []
    for item in _items(data).values():
        is_chosen = _selects(settings, item.setting) and _selects(tasks, item.task)
        if is_chosen:
            samples.append(_sample(item, kind, Path(data)))
    if not samples:
        raise InvalidValueError(
            f"{data!r} has no items with the settings {settings} and the tasks {tasks}."
        )
    return Task(
        dataset=MemoryDataset(samples, name=f"roboirg_grounding_{kind}"),
        solver=ask(data, kind),
        scorer=right(data, kind),
        metadata={"question": kind},
    )


@solver
def ask(data: str, question: str) -> Solver:
    """Return a solver that asks the model, and asks once more if its answer cannot be used.

    Only answers in JSON (slots) are asked for again, with the reason, as the listener does.

    Args:
        data: folder of the dataset.
        question: slots, choice or points.
    """
    again = load_prompts(PROMPTS)["again"]

    async def solve(state: TaskState, generate: Generate) -> TaskState:
        """Ask once, and once more if the answer is no readable JSON; the last answer counts."""
        state = await generate(state)
        if question == "slots":
            item = _items(data)[str(state.sample_id)]
            reply = _reply_text(state.output)
            try:
                check_whole(reply)
                goal_schema(item.task).read(reply)
            except UnparsableReplyError as error:
                if not state.output.completion:
                    # Services refuse an empty message as part of the conversation.
                    state.messages[-1].content = SILENCE
                state.messages.append(ChatMessageUser(content=again.substitute(why=str(error))))
                state = await generate(state)
        return state

    return solve


@scorer(metrics=[accuracy(), stderr(cluster=EPISODE), grouped(accuracy(), "setting")])
def right(data: str, question: str) -> Scorer:
    """Return a scorer as of `roboirg score grounding`: 1 if all of a reply is right, else 0.

    Args:
        data: folder of the dataset.
        question: slots, choice or points.
    """
    kind = known_name("question", question, QUESTION_KINDS)

    async def score(state: TaskState, target: Target) -> Score:
        """Judge the model's last answer as `roboirg score grounding` does."""
        item = _items(data)[str(state.sample_id)]
        verdict = judge_reply(item, kind, _reply_text(state.output))
        return Score(
            value=float(verdict.right),
            answer=verdict.understood,
            explanation=f"Meant: {target.text}",
            metadata={"parts": dict(verdict.parts)},
        )

    return score


def log_answers(log: EvalLog) -> list[Answer]:
    """Return the answers of a log, for `write_answers` and `roboirg score grounding`."""
    asked = str((log.eval.metadata or {}).get("question"))
    kind = known_name("question", asked, QUESTION_KINDS)
    answers = []
    for sample in log.samples or ():
        answers.append(Answer(str(sample.id), kind, _reply_text(sample.output)))
    return answers


def _reply_text(output: ModelOutput) -> str:
    """Return what a model replied, marked if the limit of tokens cut it off."""
    if output.stop_reason == "max_tokens":
        return output.completion + CUT_OFF
    return output.completion


def _sample(item: GroundingItem, kind: QuestionKind, folder: Path) -> Sample:
    """Return one question of an item as a sample of Inspect: messages, right reply and metadata.

    Args:
        item: with the instruction and the names of its pictures.
        kind: slots, choice or points.
        folder: of the dataset, with the pictures.
    """
    texts = QuestionTexts(
        item.system_prompt(kind), item.said, item.shown, item.now, item.question(kind)
    )
    frames = tuple(_picture(folder / path) for path in item.frames)
    parts = texts.parts(frames, _picture(folder / item.picture))
    content = [_as_content(part) for part in parts]
    return Sample(
        input=[ChatMessageSystem(content=texts.system), ChatMessageUser(content=content)],
        target=right_reply(item, kind),
        id=item.id,
        metadata={
            "task": item.task,
            "setting": item.setting,
            "form": item.form,
            EPISODE: f"{item.task}/{item.split}/{item.episode}",
            "pattern": item.pattern,
        },
    )


def _as_content(part: str | ContentImage) -> Content:
    """Return a text or a picture as a part of a message."""
    return ContentText(text=part) if isinstance(part, str) else part


def _picture(path: Path) -> ContentImage:
    """Return a picture file as Inspect sends it to a model."""
    return ContentImage(image=str(path.resolve()))


@functools.cache
def _items(data: str) -> Mapping[str, GroundingItem]:
    """Return the items of a dataset's folder by their ids; read once for each folder."""
    return {item.id: item for item in read_items(Path(data))}


def _selects(names: str, name: str) -> bool:
    """Return whether a name is in a list of names with commas, or the list is ``all``."""
    return means_all(names) or name in parse_names("name", names)
