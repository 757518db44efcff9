"""One question, one retry if the reply does not parse, and what it all cost."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from string import Template
from typing import Any, TypeVar

from roboirg.policies.planning.model_content import ChatTurn
from roboirg.policies.planning.models import Model, ModelOptions, ModelQuery, ModelReply, make_model

Value = TypeVar("Value")

MILLION = 1_000_000
SILENCE = "(no answer)"
"""Stands for an empty reply when it is quoted back; services refuse empty turns."""


class UnparsableReply(Exception):  # noqa: N818 - caught by `VLMQuery.ask`, which asks again
    """A reply is not what was asked for; the sentence tells the model why."""


@dataclass
class VLMQuery:
    """Asks one model and keeps the account of an episode.

    Attributes:
        options: of the model. The connection is made at the first question.
        again: what the model is told when its reply does not parse, with ``$why``.
        unparsed: questions that had no usable answer even at the second try.
    """

    options: ModelOptions
    again: Template
    calls: int = field(default=0, init=False)
    input_tokens: int = field(default=0, init=False)
    output_tokens: int = field(default=0, init=False)
    unparsed: int = field(default=0, init=False)
    _model: Model | None = field(default=None, init=False, repr=False)

    def ask(self, query: ModelQuery, parse: Callable[[str], Value]) -> Value | None:
        """What `parse` makes of the reply; None if it could make nothing of two of them.

        Raises:
            PolicyConnectionError: the service cannot be reached or is overloaded.
            PolicyTimeoutError: there was no answer in time.
            PolicyReplyError: the service answered with an error or with something else.
        """
        reply = self._answer(query)
        try:
            return parse(reply.text)
        except UnparsableReply as error:
            said = ChatTurn("model", (reply.text or SILENCE,))
            asked = ChatTurn("user", (self.again.substitute(why=str(error)),))
        try:
            second = self._answer(query._replace(turns=(*query.turns, said, asked)))
            return parse(second.text)
        except UnparsableReply:
            self.unparsed += 1
            return None

    def start(self) -> None:
        """A new episode begins: nothing has been asked."""
        self.calls = self.input_tokens = self.output_tokens = self.unparsed = 0

    def usage(self) -> dict[str, float]:
        """Calls, tokens and questions without a usable answer; the cost if prices are known."""
        usage: dict[str, float] = {
            "calls": self.calls,
            "input_tokens": self.input_tokens,
            "output_tokens": self.output_tokens,
            "unparsed": self.unparsed,
        }
        prices = self.options.input_price, self.options.output_price
        if prices != (None, None):
            into, out = (price or 0.0 for price in prices)
            usage["cost_usd"] = (self.input_tokens * into + self.output_tokens * out) / MILLION
        return usage

    def close(self) -> None:
        """Let go of the connection."""
        model, self._model = self._model, None
        if model is not None:
            model.close()

    def _answer(self, query: ModelQuery) -> ModelReply:
        if self._model is None:
            self._model = make_model(self.options)
        self.calls += 1
        reply = self._model.answer(query)
        self.input_tokens += reply.input_tokens
        self.output_tokens += reply.output_tokens
        return reply


def json_object(text: str) -> dict[str, Any]:
    """The JSON object in a reply, which may have words or a code fence around it.

    Raises:
        UnparsableReply: there is none.
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
    raise UnparsableReply("The reply holds no JSON object.")


def text_of(reply: dict[str, Any], name: str) -> str:
    """A field of a reply that has to hold words, in one line.

    Raises:
        UnparsableReply: it does not.
    """
    value = reply.get(name)
    if not isinstance(value, str) or not value.strip():
        raise UnparsableReply(f"The field {name!r} has to hold words.")
    return " ".join(value.split())
