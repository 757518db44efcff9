"""Find a JSON object, and words in it, in what a model replied."""

from __future__ import annotations

import json
from typing import Any


class UnparsableReplyError(Exception):
    """A reply is unusable; `VLMQuery.ask` sends the message to the model and asks again."""


def json_object(text: str) -> dict[str, Any]:
    """Return the JSON object in a reply, which may have words or a code fence around it.

    Raises:
        UnparsableReplyError: there is none.
    """
    decoder = json.JSONDecoder()
    start = text.find("{")
    while start >= 0:
        try:
            found, _ = decoder.raw_decode(text, start)
        except (ValueError, RecursionError):
            start = text.find("{", start + 1)
            continue
        if isinstance(found, dict):
            return found
    raise UnparsableReplyError("The reply holds no JSON object.")


def text_of(reply: dict[str, Any], name: str) -> str:
    """Return a text field of a reply, in one line.

    Raises:
        UnparsableReplyError: there is no such text.
    """
    value = reply.get(name)
    if not isinstance(value, str) or not value.strip():
        raise UnparsableReplyError(f"The field {name!r} has to hold words.")
    return " ".join(value.split())
