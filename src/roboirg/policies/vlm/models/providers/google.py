"""Google's models: ``generateContent`` of the Gemini API."""

from __future__ import annotations

import base64
import json
import math
from typing import Any
from urllib.parse import quote

from roboirg.policies.vlm.model_content import Part
from roboirg.policies.vlm.models.model import (
    HttpRequest,
    ModelOptions,
    ModelProvider,
    ModelQuery,
    ModelReply,
    given,
    reported_count,
)
from roboirg.util.media import Picture, encode_png
from roboirg.util.reply_reading import CUT_OFF, with_thoughts


def write(query: ModelQuery, options: ModelOptions, key: str) -> HttpRequest:
    """Return the request for a query in the form of Gemini's API, with pictures and clips inside.

    Nothing is uploaded to the file service, so nothing remains there when an episode ends early.
    """
    name = options.model
    if not name.startswith(("models/", "tunedModels/")):
        name = f"models/{name}"
    headers = {
        "x-goog-api-key": key,
        "X-Server-Timeout": str(math.ceil(options.timeout_s)),
    }
    contents: list[dict[str, Any]] = []
    for turn in query.turns:
        parts = [_part(part, options) for part in turn.parts]
        contents.append({"parts": parts, "role": turn.role})
    body = {
        "contents": contents,
        "systemInstruction": {"parts": [{"text": query.system}], "role": "user"},
        "generationConfig": given(
            temperature=options.temperature,
            maxOutputTokens=options.max_output_tokens,
            responseMimeType=query.schema and "application/json",
            responseJsonSchema=query.schema,
        ),
    }
    url = f"{options.url}/v1/{quote(name, safe='/:')}:generateContent"
    return HttpRequest(url, headers, json.dumps(body).encode())


def read(reply: Any) -> ModelReply:  # noqa: ANN401 - depends on what the server sends
    """Return the text of a reply's first candidate with its thoughts, and the tokens of both.

    Thoughts are parts of the text that are marked, and they are paid for like the answer.
    """
    first = (reply.get("candidates") or [{}])[0]
    parts = first.get("content", {}).get("parts", [])
    answer = "".join(part.get("text", "") for part in parts if not part.get("thought"))
    thoughts = [part for part in parts if part.get("thought")]
    # The service leaves out what is 0.
    usage = reply.get("usageMetadata")
    output_tokens = reported_count(usage, "candidatesTokenCount", absent=0)
    output_tokens += reported_count(usage, "thoughtsTokenCount", absent=0)
    text = with_thoughts(answer, thoughts)
    if first.get("finishReason") == "MAX_TOKENS":
        text += CUT_OFF
    return ModelReply(text, reported_count(usage, "promptTokenCount"), output_tokens)


def _part(part: Part, options: ModelOptions) -> dict[str, Any]:
    """Return a text, picture or clip as a part of Gemini's request.

    ``{"text": "…"}``, or ``{"inlineData": …}`` with the file inside.
    """
    if isinstance(part, str):
        return {"text": part}
    if isinstance(part, Picture):
        return {"inlineData": _blob(encode_png(part), "image/png")}
    clip: dict[str, Any] = {"inlineData": _blob(part.file, "video/mp4")}
    if options.sampling_fps is not None:
        clip["videoMetadata"] = {"fps": options.sampling_fps}
    return clip


def _blob(content: bytes, kind: str) -> dict[str, str]:
    """Return a file as Gemini's API takes it within a request, in URL-safe Base64."""
    return {"data": base64.urlsafe_b64encode(content).decode(), "mime_type": kind}


PROVIDER = ModelProvider(
    name="google",
    home="https://generativelanguage.googleapis.com",
    key_variable="GOOGLE_API_KEY",
    write=write,
    read=read,
)
