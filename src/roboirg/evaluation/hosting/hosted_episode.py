"""One episode in the policy's process: its policy, its random numbers, its shared memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from numpy.typing import NDArray

from roboirg.core.inference_facts import inference_facts
from roboirg.evaluation.hosting.messages import (
    Acted,
    Ask,
    Call,
    Opened,
    Told,
    map_block,
    unpack_payload,
)
from roboirg.evaluation.policy_calls import check_rows, dump_metadata, policy_subgoal, policy_usage
from roboirg.policies.by_name.loading import make_policy, policy_version
from roboirg.policies.contract.base import close_policy, tell_policy
from roboirg.policies.contract.policy_needs import PolicyNeeds
from roboirg.policies.contract.random_state import RandomState

AskWorld = Callable[[Ask], Call]
"""Sends a question to the world of an episode in a call, and returns its answer."""


class HostedDemonstration(Mapping[str, NDArray[Any]]):
    """A demonstration whose pictures are drawn by the world when they are read, and then kept.

    They can be read while a call of the policy is under way.

    Args:
        fields: names of all fields.
        arrays: those that are already here.
        fetch: draws fields and returns them.
    """

    def __init__(
        self,
        fields: Sequence[str],
        arrays: Mapping[str, NDArray[Any]],
        fetch: Callable[[Sequence[str]], Mapping[str, NDArray[Any]]],
    ) -> None:
        self._fields, self._arrays, self._fetch = tuple(fields), dict(arrays), fetch

    def __getitem__(self, field: str) -> NDArray[Any]:
        """Return a field for all steps; raises KeyError if it does not exist."""
        if field not in self._arrays and field in self._fields:
            self._arrays.update(self._fetch([field]))
        return self._arrays[field]

    def draw(self) -> None:
        """Fetch all fields that are not here, drawn together."""
        missing = [field for field in self._fields if field not in self._arrays]
        if missing:
            self._arrays.update(self._fetch(missing))

    @property
    def length(self) -> int:
        """Control steps in the video."""
        return len(self["joint_positions"])

    def __iter__(self) -> Iterator[str]:
        return iter(self._fields)

    def __len__(self) -> int:
        """Return the number of fields; `length` is the number of control steps."""
        return len(self._fields)

    def __reduce__(self) -> tuple[type[dict[str, Any]], tuple[dict[str, Any]]]:
        self.draw()
        return dict, (dict(self),)


class HostedEpisode:
    """Carries out the calls of one episode.

    Args:
        call: ``spec`` and ``seed`` of the policy.
        block: descriptor of the shared memory.
        ask: sends questions to the world.
        read_fields: names of the demonstration's fields that any episode has read; grows.

    Attributes:
        policy: the policy of this episode.
        random: its random numbers.
    """

    def __init__(self, call: Call, block: int, ask: AskWorld, read_fields: dict[str, None]) -> None:
        self._ask, self._read_fields = ask, read_fields
        self._block = map_block(block)
        self.random = RandomState(call.seed)
        with self.random:
            self.policy = make_policy(call.spec, call.seed)
        # Pixels of subgoals are for privileged policies, and those have no host.
        self._needs = replace(PolicyNeeds.of(self.policy), grounded=False)

    def describe(self, spec: str) -> Opened:
        """Return what the world must know of the policy."""
        together = callable(getattr(self.policy, "act_together", None))
        return Opened(self._needs, policy_version(spec), together, tuple(self._read_fields))

    def reset(self, call: Call) -> Told:
        """Begin the episode; returns the policy's metadata."""
        value = self.read(call)
        demonstration = HostedDemonstration(value["fields"], value["arrays"], self._fetch)
        self.policy.reset(value["instruction"], demonstration)
        return Told(dump_metadata(self.policy), inference=inference_facts(self.policy))

    def act(self, call: Call) -> Acted:
        """Return the next actions."""
        return self.actions(self.policy.act(self.read(call)))

    def actions(self, rows: Any) -> Acted:  # noqa: ANN401 - whatever the policy returned
        """Return a policy's actions, checked, for a message."""
        chunk = check_rows(rows, self._needs.action_space)
        latency_s = float(getattr(self.policy, "latency_s", 0.0))
        subgoal = policy_subgoal(self.policy)
        return Acted(chunk.tobytes(), chunk.shape[1], latency_s, subgoal)

    def hear(self, call: Call) -> Told:
        """Let the policy hear what was said; returns its metadata."""
        tell_policy(self.policy, call.utterances)
        return Told(dump_metadata(self.policy))

    def usage(self, _call: Call) -> Told:
        """Return the cost of the episode."""
        return Told(usage=policy_usage(self.policy))

    def close(self, _call: Call) -> Told:
        """End the episode."""
        self._block.close()
        close_policy(self.policy)
        return Told()

    def read(self, message: Call) -> Any:  # noqa: ANN401 - whatever the world has packed
        """Return the value of a message; what does not fit into shared memory comes in parts."""
        data = bytearray(self._block[: message.size])
        while len(data) < message.size:
            self._ask(Ask(0, start=len(data)))
            data += self._block[: message.size - len(data)]
        return unpack_payload(message.tree, data)

    def _fetch(self, fields: Sequence[str]) -> Mapping[str, NDArray[Any]]:
        self._read_fields.update(dict.fromkeys(fields))
        found: Mapping[str, NDArray[Any]] = self.read(self._ask(Ask(0, tuple(fields))))
        return found
