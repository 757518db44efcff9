"""Forty replies in the styles of model families, as servers send them, and how each is to be read.

Written for these tests; the right answers are B, the goal `BLUE_TWICE` and the subgoal `PICK`.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from roboirg.policies.vlm.models import ModelOptions

BLUE_TWICE = '{"color": "blue", "repeats": 2}'
RED_ONCE = '{"color": "red", "repeats": 1}'
PICK = "pick up the blue cube"
UNREADABLE = None


class StyledReply(NamedTuple):
    """One reply.

    Attributes:
        style: who answers so.
        question: letter, goal or subgoal.
        reading: what the reply means; `UNREADABLE` if it must be counted as that.
        content: of a message of OpenAI's API; with Google's, the parts of the candidate.
        more: other fields of the message.
        ended: why the server ended the reply.
    """

    style: str
    question: str
    reading: str | None
    content: Any
    more: Mapping[str, Any] = MappingProxyType({})
    ended: str = "stop"

    def options(self):
        """Options of a model whose server replies so."""
        provider = "google" if self.style.startswith("Gemini") else "openai"
        return ModelOptions(provider=provider, model="m", base_url="http://127.0.0.1:9")

    def body(self):
        """The reply in JSON, as the server sends it."""
        if self.style.startswith("Gemini"):
            candidate = {"content": {"parts": self.content}, "finishReason": self.ended.upper()}
            return {"candidates": [candidate]}
        message = {"role": "assistant", "content": self.content, **self.more}
        return {"choices": [{"message": message, "finish_reason": self.ended}]}


def thinking(text):
    return {"type": "thinking", "thinking": text}


def text(words):
    return {"type": "text", "text": words}


FORTY = (
    # GPT
    StyledReply("GPT, letter and sentence", "letter", "B", "B\nThe green cube is meant."),
    StyledReply("GPT, the same with an A", "letter", "A", "A\nThe green cube is meant."),
    StyledReply("GPT, list of the options first", "letter", "B",
                "Option A is a red cube. Option B is a blue cube.\n\n**Answer: B**"),
    StyledReply("GPT, list of the options alone", "letter", UNREADABLE,
                "A. Put the red cube there.\nB. Put the blue cube there."),
    StyledReply("GPT, structured", "goal", BLUE_TWICE, BLUE_TWICE),
    StyledReply("GPT, refusal", "goal", UNREADABLE, None, {"refusal": "I cannot help with that."}),
    StyledReply("GPT, summary of its reasoning apart", "letter", "B", "(B)",
                {"reasoning": "The answer is A. Or not."}),
    StyledReply("gpt-oss, channels left in", "letter", "B",
                "<|channel|>analysis<|message|>The answer is A?<|end|><|start|>assistant"
                "<|channel|>final<|message|>B<|return|>"),
    StyledReply("gpt-oss, cut off in its analysis", "letter", UNREADABLE,
                "<|channel|>analysis<|message|>The answer is A, or perhaps", ended="length"),
    # Claude
    StyledReply("Claude, thinking part and text part", "goal", BLUE_TWICE,
                [thinking(f"First I thought {RED_ONCE}."), text(BLUE_TWICE)]),
    StyledReply("Claude, redacted thinking", "letter", "B",
                [{"type": "redacted_thinking", "data": "QUJD"}, text("The answer is **B**.")]),
    StyledReply("Claude, thinking without an answer", "goal", UNREADABLE,
                [thinking(f"It must be {BLUE_TWICE}.")], ended="length"),
    StyledReply("Claude, tags in the text", "letter", "B",
                "<thinking>\nThe answer is A. No.\n</thinking>\n\n<answer>B</answer>"),
    StyledReply("Claude, fence and explanation", "goal", BLUE_TWICE,
                f"I see two visits.\n\n```json\n{BLUE_TWICE}\n```\n\nThe {{blue}} cube is meant."),
    StyledReply("Claude, article at the beginning", "letter", UNREADABLE,
                "A blue cube is what the speaker means."),
    StyledReply("Claude, A with a reason", "letter", "A", "A, because it was named first."),
    StyledReply("Claude, undecided", "letter", UNREADABLE, "The answer is A or B."),
    # Gemini
    StyledReply("Gemini, thought apart", "goal", BLUE_TWICE,
                [{"text": f"**Planning** {RED_ONCE}", "thought": True}, {"text": BLUE_TWICE}]),
    StyledReply("Gemini, thought alone", "goal", UNREADABLE,
                [{"text": f"It is {BLUE_TWICE}", "thought": True}], ended="max_tokens"),
    StyledReply("Gemini, text in two parts", "goal", BLUE_TWICE,
                [{"text": '{"color": "blue",'}, {"text": ' "repeats": 2}'}]),
    StyledReply("Gemini, object in a list", "goal", BLUE_TWICE, [{"text": f"[{BLUE_TWICE}]"}]),
    StyledReply("Gemini, two objects in a list", "goal", UNREADABLE,
                [{"text": f"[{RED_ONCE}, {BLUE_TWICE}]"}]),
    StyledReply("Gemini, bold", "letter", "B", [{"text": "**B. Put the blue cube there.**"}]),
    StyledReply("Gemini, cut off in a text", "goal", UNREADABLE,
                [{"text": f'{RED_ONCE}? No. {{"color": "bl'}], ended="max_tokens"),
    # Qwen and DeepSeek
    StyledReply("DeepSeek, thoughts in the text", "goal", BLUE_TWICE,
                f"<think>\n{RED_ONCE}? Wait.\n</think>\n\n{BLUE_TWICE}"),
    StyledReply("DeepSeek, first tag in the prompt", "letter", "B",
                "The answer is A. Wait, no.\n</think>\n\nB"),
    StyledReply("DeepSeek, thoughts in a field", "goal", BLUE_TWICE, BLUE_TWICE,
                {"reasoning_content": f"Perhaps {RED_ONCE}."}),
    StyledReply("DeepSeek, cut off while it thinks", "goal", UNREADABLE,
                f"<think>\nIt is {BLUE_TWICE}, let me check", ended="length"),
    StyledReply("Qwen, box", "letter", "B", "So it is the blue one.\n\n$$\\boxed{\\text{B}}$$"),
    StyledReply("Qwen, corrects itself", "goal", BLUE_TWICE,
                f"{RED_ONCE}\nWait, it was blue.\n{BLUE_TWICE}<|im_end|>"),
    StyledReply("Qwen, whole numbers as decimals", "goal", BLUE_TWICE,
                '{"color": "Blue", "repeats": 2.0}'),
    StyledReply("Qwen, numbers as texts", "goal", BLUE_TWICE, '{"color": "blue", "repeats": "2"}'),
    StyledReply("Qwen, subgoal after thoughts", "subgoal", PICK,
                f"<think>put it down\ndone</think>\n\n{PICK.capitalize()}.<|im_end|>"),
    # Llama, InternVL, Mistral
    StyledReply("Llama, sentence", "letter", "B", "The correct answer is (B) Put the blue cube."),
    StyledReply("Llama, single quotes", "goal", UNREADABLE, "{'color': 'blue', 'repeats': 2}"),
    StyledReply("Llama, two answers", "letter", UNREADABLE,
                "The answer is A. Let me look again. The answer is B."),
    StyledReply("Llama, truth for a number", "goal", UNREADABLE,
                '{"color": "blue", "repeats": true}'),
    StyledReply("InternVL, letter in JSON", "letter", "B",
                '```json\n{"reasoning": "The answer A is red.", "answer": "B"}\n```'),
    StyledReply("InternVL, subgoal in a fence", "subgoal", PICK,
                f"The cube is free.\n```\n{PICK}\n```"),
    StyledReply("Magistral, list of parts in the thoughts", "goal", BLUE_TWICE,
                [thinking([text(f"{RED_ONCE}?")]), text(f"My answer: {BLUE_TWICE}</s>")]),
)  # fmt: skip
