"""A process that plays one episode of the VLM listener; its model is asked in the parent."""

from __future__ import annotations

from collections.abc import Mapping
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from roboirg.core.errors import PolicyConnectionError
from roboirg.core.policy_ref import PRIVILEGED
from roboirg.policies.vlm.models import ModelOptions, ModelQuery, ModelReply
from roboirg.policies.vlm.models.providers.chat_completions import chat_messages
from roboirg.policies.vlm.vlm_listener import ListenerOptions, VLMListener
from roboirg.records.record import Job
from roboirg.records.record_codec import encode

if TYPE_CHECKING:
    Pipe = Connection[Any, Any]
    """Not at run time: before Python 3.13 the class takes no parameters."""


class ModelRequest(NamedTuple):
    """A query on its way to the parent.

    Attributes:
        messages: as OpenAI's chat completions take them.
        schema: JSON schema of the reply; None for free text.
    """

    messages: list[dict[str, Any]]
    schema: Mapping[str, Any] | None


class PipeModel:
    """A model behind a pipe.

    Args:
        pipe: to the parent.
        options: how clips are sent.
    """

    def __init__(self, pipe: Pipe, options: ModelOptions) -> None:
        self._pipe = pipe
        self._options = options

    def answer(self, query: ModelQuery) -> ModelReply:
        """Send a query to the parent process, and return its reply; see `Model`.

        Raises:
            PolicyConnectionError: the parent has ended the episode.
        """
        messages = chat_messages(query, self._options)
        self._pipe.send(ModelRequest(messages, query.schema))
        try:
            reply: ModelReply = self._pipe.recv()
            return reply
        except EOFError as error:
            raise PolicyConnectionError("Inspect ended the episode.") from error


class PipedListener(VLMListener):
    """The VLM listener of this process, which `play` gives its pipe and options.

    A policy is made from its name, so these are the class's.
    """

    pipe: Pipe
    chosen: ListenerOptions

    def __init__(self, seed: int = 0) -> None:
        super().__init__(self.chosen, seed, lambda options: PipeModel(self.pipe, options))


def play(pipe: Pipe, job: Job, options: ListenerOptions) -> None:
    """Play an episode; send model requests, and at last its record as JSON text.

    Args:
        pipe: to the parent.
        job: the episode; its policy's spec is `PipedListener`.
        options: of the listener.
    """
    from roboirg.runs.play.rollout import EpisodeRunner

    PipedListener.pipe = pipe
    PipedListener.chosen = options
    record, _ = EpisodeRunner(Path()).play_once(job)
    pipe.send(encode(record).decode())


SPEC = f"{PRIVILEGED}{PipedListener.__module__}:{PipedListener.__name__}"
