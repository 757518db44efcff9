"""What a vision-language model is asked about an episode: words, video, first picture, fields.

The listener and the grounding dataset ask the same question in the same words.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, TypeVar

from roboirg.policies.vlm.goal_schema import GoalSchema
from roboirg.policies.vlm.prompt_files import Prompts

PROMPTS = "listener"
"""Name of the prompts."""

Medium = TypeVar("Medium")


class QuestionTexts(NamedTuple):
    """The texts of a question, in the order in which they are read.

    Attributes:
        system: the system prompt.
        instruction: what was said to the robot.
        video: what comes before the video, or that there is none.
        now: what comes before the first picture.
        question: what is asked, after the picture.
    """

    system: str
    instruction: str
    video: str
    now: str
    question: str

    def parts(self, video: tuple[Medium, ...], picture: Medium) -> tuple[str | Medium, ...]:
        """Return the user's turn: texts, the parts of the video, and the first picture."""
        return (self.instruction, self.video, *video, self.now, picture, self.question)


def question_texts(
    prompts: Prompts,
    schema: GoalSchema,
    instruction: str,
    steps: int,
    reasoning: str | None = None,
) -> QuestionTexts:
    """Return the texts that ask for the goal of an instruction.

    Args:
        prompts: with the entries of ``listener.toml``.
        schema: of the task's goals.
        instruction: everything that was said.
        steps: control steps of the video; 0 without one.
        reasoning: meaning of the field in which the model may think; None without it.
    """
    fields = "\n".join(_describe_fields(prompts, schema, reasoning))
    video = prompts.fill("no_video")
    if steps:
        video = prompts.fill("video", steps=str(steps))
    return QuestionTexts(
        system=prompts.fill("system"),
        instruction=prompts.fill("instruction", instruction=instruction),
        video=video,
        now=prompts.fill("now"),
        question=prompts.fill("question", fields=fields),
    )


def _describe_fields(prompts: Prompts, schema: GoalSchema, reasoning: str | None) -> Iterator[str]:
    """Yield a line for each field of the answer: its name, its meaning and its values.

    The field in which to think comes first, if `reasoning` gives its meaning.
    """
    if reasoning is not None:
        yield f"- reasoning: {reasoning}"
    for field in schema.fields:
        meaning = prompts.fill(f"meanings.{field.kind}", color=field.name, thing=schema.thing)
        values = ", ".join(map(str, field.values))
        if field.lengths is None:
            values = prompts.fill("values.one", values=values)
        else:
            least, most = field.lengths
            values = prompts.fill("values.list", values=values, least=str(least), most=str(most))
        yield prompts.fill("field", name=field.name, meaning=meaning, values=values)
