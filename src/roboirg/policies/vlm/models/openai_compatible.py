"""Endpoints with OpenAI's API: OpenAI itself, vLLM, and many others."""

from __future__ import annotations

import base64
import weakref
from collections.abc import Iterator
from typing import Any

from roboirg.core.errors import (
    ModelBusyError,
    PolicyConnectionError,
    PolicyReplyError,
    RoboIRGError,
)
from roboirg.core.extras import extra_needed
from roboirg.policies.vlm.model_content import ChatTurn, Part
from roboirg.policies.vlm.models.model import ModelOptions, ModelQuery, ModelReply
from roboirg.policies.vlm.models.response_limits import (
    PLAIN_HEADERS,
    call_with_timeout,
    limit_response,
    retry_after_s,
    timeout_error,
)
from roboirg.util.media import Clip, Picture, encode_png, sample_evenly

OPENAI = "https://api.openai.com/v1"
BUSY = frozenset({408, 409, 429, 502, 503, 504})
"""HTTP statuses of a service that is up but cannot answer now."""
MAX_ERROR_LENGTH = 300


class OpenAIModel:
    """Sends queries through the ``openai`` library's chat completions."""

    def __init__(self, options: ModelOptions) -> None:
        with extra_needed("Models of provider 'openai' need its client library", "vlm"):
            import openai
        self._openai = openai
        self._options = options
        self._key = options.key()
        self._name = f"Model {options.model!r} at {options.address()}"
        self._client = openai.OpenAI(
            api_key=self._key,
            base_url=options.base_url or OPENAI,
            timeout=options.timeout_s,
            max_retries=0,
            default_headers=PLAIN_HEADERS,
            http_client=openai.DefaultHttpxClient(event_hooks={"response": [limit_response]}),
        )
        # Without a close() the connection ends with this object, as with the library's own client.
        weakref.finalize(self, self._client.close)

    def answer(self, query: ModelQuery) -> ModelReply:
        """Send a query; see `Model`."""
        request = self._request(query)

        def send() -> Any:  # noqa: ANN401 - depends on what the server sends
            return self._client.chat.completions.create(**request)

        try:
            return self._read(call_with_timeout(self._options.timeout_s, send, self._name))
        except (self._openai.OpenAIError, ValueError) as error:
            # The library passes errors of malformed JSON through.
            # Not chained: the service's message may hold the key, and tracebacks are recorded.
            raise self._convert_error(error) from None

    def close(self) -> None:
        self._client.close()

    def _request(self, query: ModelQuery) -> dict[str, Any]:
        options = self._options
        request: dict[str, Any] = {
            "model": options.model,
            "messages": chat_messages(query, options),
        }
        if options.temperature is not None:
            request["temperature"] = options.temperature
        if options.max_output_tokens is not None:
            request["max_tokens"] = options.max_output_tokens
        if query.schema is not None and options.structured:
            form = {"name": "answer", "strict": True, "schema": dict(query.schema)}
            request["response_format"] = {"type": "json_schema", "json_schema": form}
        return request

    def _read(self, completion: Any) -> ModelReply:  # noqa: ANN401 - depends on what the server sends
        try:
            text = completion.choices[0].message.content or ""
            usage = completion.usage
            if usage is None:
                return ModelReply(str(text))
            return ModelReply(str(text), int(usage.prompt_tokens), int(usage.completion_tokens))
        except (AttributeError, IndexError, TypeError, ValueError) as error:
            raise PolicyReplyError(
                f"{self._name} replied with something other than a chat completion "
                f"({type(error).__name__}: {error})."
            ) from None

    def _convert_error(self, error: Exception) -> RoboIRGError:
        openai = self._openai
        if isinstance(error, openai.APITimeoutError):
            return timeout_error(self._name, self._options.timeout_s)
        # The library says nothing about a connection that failed; its cause does.
        unreachable = isinstance(error, openai.APIConnectionError)
        reason = (error.__cause__ or error) if unreachable else error
        words = " ".join(str(reason).replace(self._key, "…").split())[:MAX_ERROR_LENGTH]
        if unreachable:
            return PolicyConnectionError(
                f"{self._name} cannot be reached ({type(reason).__name__}: {words})."
            )
        if isinstance(error, openai.APIStatusError) and error.status_code in BUSY:
            wanted = retry_after_s(error.response.headers)
            return ModelBusyError(f"{self._name} is not available: {words}", wanted)
        if isinstance(error, openai.APIStatusError):
            return PolicyReplyError(f"{self._name} refused or failed: {words}")
        return PolicyReplyError(f"{self._name} replied with something else ({words}).")


def chat_messages(query: ModelQuery, options: ModelOptions) -> list[dict[str, Any]]:
    """Return a query as the messages of OpenAI's chat completions."""
    system = {"role": "system", "content": query.system}
    return [system, *(_message(turn, options) for turn in query.turns)]


def _message(turn: ChatTurn, options: ModelOptions) -> dict[str, Any]:
    if turn.role == "model":
        return {"role": "assistant", "content": "".join(map(str, turn.parts))}
    content = [piece for part in turn.parts for piece in _pieces(part, options)]
    return {"role": "user", "content": content}


def _pieces(part: Part, options: ModelOptions) -> Iterator[dict[str, Any]]:
    if isinstance(part, str):
        yield {"type": "text", "text": part}
    elif isinstance(part, Picture):
        yield _image(part)
    elif options.video == "mp4":
        yield {"type": "video_url", "video_url": {"url": _data_url("video/mp4", part.file)}}
    else:
        yield from map(_image, _pictures(part, options.clip_frames))


def _pictures(clip: Clip, most: int) -> list[Picture]:
    return [Picture(pixels) for pixels in sample_evenly(clip.frames, most)]


def _image(picture: Picture) -> dict[str, Any]:
    return {"type": "image_url", "image_url": {"url": _data_url("image/png", encode_png(picture))}}


def _data_url(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
