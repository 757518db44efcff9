"""Endpoints with OpenAI's API: OpenAI itself, vLLM, and many others."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from typing import Any

from roboirg.policies.vlm.model_content import ChatTurn, Part
from roboirg.policies.vlm.models.model import (
    HttpRequest,
    ModelOptions,
    ModelProvider,
    ModelQuery,
    ModelReply,
    given,
    reported_count,
)
from roboirg.util.media import Picture, encode_png, sample_evenly
from roboirg.util.reply_reading import CUT_OFF, with_thoughts

_ANSWERS = frozenset({"text", "output_text"})
"""Types of parts that are answers; all others are thoughts, or nothing that can be read."""


def write(query: ModelQuery, options: ModelOptions, key: str) -> HttpRequest:
    """Return the HTTP request for a query, in the form of OpenAI's chat completions.

    Options that are None are left out of the body, so that the service's defaults count. The bytes
    for equal queries are equal.
    """
    response_format = None
    if query.schema:
        form = {"name": "answer", "strict": True, "schema": query.schema}
        response_format = {"type": "json_schema", "json_schema": form}
    body = given(
        model=options.model,
        messages=chat_messages(query, options),
        max_tokens=options.max_output_tokens,
        response_format=response_format,
        temperature=options.temperature,
    )
    text = json.dumps(body, ensure_ascii=False, separators=(",", ":"))
    headers = {"Authorization": f"Bearer {key}"}
    return HttpRequest(f"{options.url}/chat/completions", headers, text.encode())


def read(reply: Any) -> ModelReply:  # noqa: ANN401 - depends on what the server sends
    """Return the text of a reply's first choice with its thoughts, and the tokens of both.

    Servers differ: a text comes whole or in parts, and thoughts as parts or in a field apart.
    """
    choice = reply["choices"][0]
    message = choice["message"]
    parts = message.get("content") or ""
    if isinstance(parts, str):
        parts = [{"type": "text", "text": parts}]
    answer = "".join(part["text"] for part in parts if part["type"] in _ANSWERS)
    thoughts = [part for part in parts if part["type"] not in _ANSWERS]
    said_apart = message.get("reasoning_content") or message.get("reasoning")
    if said_apart:
        thoughts.append(said_apart)
    text = with_thoughts(answer, thoughts)
    if choice.get("finish_reason") == "length":
        text += CUT_OFF
    usage = reply.get("usage")
    return ModelReply(
        text,
        reported_count(usage, "prompt_tokens"),
        reported_count(usage, "completion_tokens"),
    )


def chat_messages(query: ModelQuery, options: ModelOptions) -> list[dict[str, Any]]:
    """Return a query as the messages of OpenAI's chat completions."""
    messages: list[dict[str, Any]] = [{"role": "system", "content": query.system}]
    for turn in query.turns:
        messages.append(_message(turn, options))
    return messages


def _message(turn: ChatTurn, options: ModelOptions) -> dict[str, Any]:
    """Return a turn of the conversation as a message; those of the model are texts only.

    ``{"role": "user", "content": [{"type": "text", "text": "…"}, …]}``
    """
    if turn.role == "model":
        return {"role": "assistant", "content": "".join(map(str, turn.parts))}
    pieces: list[dict[str, Any]] = []
    for part in turn.parts:
        pieces += _pieces(part, options)
    return {"role": "user", "content": pieces}


def _pieces(part: Part, options: ModelOptions) -> Iterator[dict[str, Any]]:
    """Yield the pieces of a message that hold a part: a text, a picture, or a clip.

    A clip is one video, or several pictures, as the options say.
    """
    if isinstance(part, str):
        yield {"type": "text", "text": part}
    elif isinstance(part, Picture):
        yield _image(part)
    elif options.video == "mp4":
        yield {"type": "video_url", "video_url": {"url": _data_url("video/mp4", part.file)}}
    else:
        for frame in sample_evenly(part.frames, options.clip_frames):
            yield _image(Picture(frame))


def _image(picture: Picture) -> dict[str, Any]:
    """Return a picture as a piece of a message, with the PNG inside."""
    return {"type": "image_url", "image_url": {"url": _data_url("image/png", encode_png(picture))}}


def _data_url(kind: str, content: bytes) -> str:
    """Return a file as a URL that holds it: ``"data:image/png;base64,iVBOR…"``."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


PROVIDER = ModelProvider(
    name="openai",
    home="https://api.openai.com/v1",
    key_variable="OPENAI_API_KEY",
    write=write,
    read=read,
)
