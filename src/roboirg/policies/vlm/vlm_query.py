"""Query a model, with one retry if the reply does not parse, and count the cost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from string import Template
from typing import TypeVar

from roboirg.policies.vlm.model_content import ChatTurn
from roboirg.policies.vlm.models import Model, ModelOptions, ModelQuery, ModelReply, make_model
from roboirg.policies.vlm.models.paid_model import PaidModel, cost_of
from roboirg.util.json_reply import UnparsableReplyError

Value = TypeVar("Value")

SILENCE = "(no answer)"
"""Stands for an empty reply when it is quoted back; services refuse empty turns."""


@dataclass
class VLMQuery:
    """Queries one model and counts the cost of an episode.

    Attributes:
        options: of the model, which is connected at the first query.
        again: prompt for the second try, with ``$why``.
        connect: connects the model.
        calls: requests, second tries included.
        input_tokens, output_tokens: of all calls.
        unparsed: queries without a usable reply even at the second try.
        cost_usd: of all calls; None if the prices are not known.
    """

    options: ModelOptions
    again: Template
    connect: Callable[[ModelOptions], Model] = make_model
    calls: int = field(default=0, init=False)
    input_tokens: int = field(default=0, init=False)
    output_tokens: int = field(default=0, init=False)
    unparsed: int = field(default=0, init=False)
    cost_usd: float | None = field(default=None, init=False)
    _model: PaidModel | None = field(default=None, init=False, repr=False)

    def ask(self, query: ModelQuery, parse: Callable[[str], Value]) -> Value | None:
        """Return the parsed reply; None if `parse` rejects two replies.

        Raises:
            PolicyConnectionError: the service cannot be reached or is overloaded.
            PolicyTimeoutError: there was no reply in time.
            PolicyReplyError: the service replied with an error or with something else.
        """
        reply = self._request(query)
        try:
            return parse(reply.text)
        except UnparsableReplyError as error:
            rejected = ChatTurn("model", (reply.text or SILENCE,))
            retry = ChatTurn("user", (self.again.substitute(why=str(error)),))
        try:
            second = self._request(query._replace(turns=(*query.turns, rejected, retry)))
            return parse(second.text)
        except UnparsableReplyError:
            self.unparsed += 1
            return None

    def start(self) -> None:
        """Reset the counts for a new episode."""
        self.calls = self.input_tokens = self.output_tokens = self.unparsed = 0
        self.cost_usd = cost_of(self.options)
        if self._model is not None:
            self._model.start()

    def usage(self) -> dict[str, float]:
        """Return calls, tokens and queries without a usable reply; the cost if prices are known.

        What was ``stored`` by an earlier try cost nothing again; ``anew`` is what was stored with
        something else sent; ``answered_s`` the time that its answers took, and ``waited_s`` that in
        queues and while it was busy.
        """
        usage: dict[str, float] = {
            "calls": self.calls,
            "input_tokens": self.input_tokens,
            "output_tokens": self.output_tokens,
            "unparsed": self.unparsed,
        }
        if self.cost_usd is not None:
            usage["cost_usd"] = self.cost_usd
        if self._model is not None:
            usage |= {name: count for name, count in self._model.counts().items() if count}
        return usage

    def close(self) -> None:
        model, self._model = self._model, None
        if model is not None:
            model.close()

    def _request(self, query: ModelQuery) -> ModelReply:
        if self._model is None:
            self._model = PaidModel(self.connect(self.options), self.options)
        self.calls += 1
        reply = self._model.answer(query)
        self.input_tokens += reply.input_tokens
        self.output_tokens += reply.output_tokens
        if self.cost_usd is not None:
            self.cost_usd += cost_of(self.options, reply) or 0.0
        return reply
