"""Google's models, through Google's client library."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from roboirg.core.errors import (
    ModelBusyError,
    PolicyConnectionError,
    PolicyReplyError,
    RoboIRGError,
)
from roboirg.core.extras import extra_needed
from roboirg.policies.vlm.model_content import Part
from roboirg.policies.vlm.models.model import ModelOptions, ModelQuery, ModelReply
from roboirg.policies.vlm.models.response_limits import (
    PLAIN_HEADERS,
    call_with_timeout,
    limit_response,
    retry_after_s,
    timeout_error,
)
from roboirg.util.media import Picture, encode_png

if TYPE_CHECKING:
    from google.genai import types

BUSY = (408, 429, 502, 503, 504)
"""HTTP statuses of a service that is up but cannot answer now."""
MAX_ERROR_LENGTH = 300


class GoogleModel:
    """Sends queries through ``google-genai``, with pictures and clips inside the request.

    Nothing is uploaded to the file service, so nothing remains there when an episode ends early.
    """

    def __init__(self, options: ModelOptions) -> None:
        with extra_needed("Models of provider 'google' need the library google-genai", "vlm"):
            from google import genai
            from google.genai import errors, types
        self._options = options
        self._key = options.key()
        self._errors = errors
        self._name = f"Model {options.model!r} at {options.address()}"
        http = types.HttpOptions(
            headers=dict(PLAIN_HEADERS),
            client_args={"event_hooks": {"response": [limit_response]}},
            base_url=options.base_url,
            timeout=int(1000 * options.timeout_s),
            retry_options=types.HttpRetryOptions(attempts=1),
        )
        self._client = genai.Client(vertexai=False, api_key=self._key, http_options=http)

    def answer(self, query: ModelQuery) -> ModelReply:
        """Send a query; see `Model`."""
        contents = self._contents(query)
        config = self._config(query)

        def send() -> types.GenerateContentResponse:
            return self._client.models.generate_content(
                model=self._options.model, contents=contents, config=config
            )

        try:
            return _read(call_with_timeout(self._options.timeout_s, send, self._name))
        except RoboIRGError:
            raise
        except Exception as error:  # noqa: BLE001 - errors of its HTTP client pass through the library
            # Not chained: the service's message may hold the key, and tracebacks are recorded.
            raise self._convert_error(error) from None

    def close(self) -> None:
        self._client.close()

    def _contents(self, query: ModelQuery) -> list[Any]:
        from google.genai import types

        return [
            types.Content(role=turn.role, parts=[self._part(part) for part in turn.parts])
            for turn in query.turns
        ]

    def _part(self, part: Part) -> types.Part:
        from google.genai import types

        if isinstance(part, str):
            return types.Part(text=part)
        if isinstance(part, Picture):
            return types.Part(inline_data=types.Blob(data=encode_png(part), mime_type="image/png"))
        fps = self._options.sampling_fps
        return types.Part(
            inline_data=types.Blob(data=part.file, mime_type="video/mp4"),
            video_metadata=None if fps is None else types.VideoMetadata(fps=fps),
        )

    def _config(self, query: ModelQuery) -> types.GenerateContentConfig:
        from google.genai import types

        options = self._options
        structured = query.schema is not None and options.structured
        return types.GenerateContentConfig(
            system_instruction=query.system,
            temperature=options.temperature,
            max_output_tokens=options.max_output_tokens,
            response_mime_type="application/json" if structured else None,
            response_json_schema=query.schema if structured else None,
        )

    def _convert_error(self, error: Exception) -> RoboIRGError:
        kind = type(error).__name__
        words = " ".join(str(error).replace(self._key, "…").split())[:MAX_ERROR_LENGTH]
        if "Timeout" in kind and "Connect" not in kind:
            return timeout_error(self._name, self._options.timeout_s)
        if isinstance(error, self._errors.APIError):
            if error.code in BUSY:
                headers = getattr(error.response, "headers", {})
                wanted = retry_after_s(headers)
                return ModelBusyError(f"{self._name} is not available: {words}", wanted)
            return PolicyReplyError(f"{self._name} refused or failed: {words}")
        if type(error).__module__.startswith(("httpx", "httpcore", "requests", "builtins")) and (
            isinstance(error, OSError) or "Connect" in kind or "Protocol" in kind or "Read" in kind
        ):
            return PolicyConnectionError(f"{self._name} cannot be reached ({kind}: {words}).")
        return PolicyReplyError(f"{self._name} replied with something else ({kind}: {words}).")


def _read(response: types.GenerateContentResponse) -> ModelReply:
    """Return the text of the first candidate; thoughts are left out but counted as output."""
    candidates = response.candidates or []
    content = candidates[0].content if candidates else None
    parts = (content.parts or []) if content is not None else []
    text = "".join(part.text for part in parts if part.text and not part.thought)
    usage = response.usage_metadata
    if usage is None:
        return ModelReply(text)
    output = (usage.candidates_token_count or 0) + (usage.thoughts_token_count or 0)
    return ModelReply(text, usage.prompt_token_count or 0, output)
