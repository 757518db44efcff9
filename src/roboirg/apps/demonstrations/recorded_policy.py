"""The policy that plays what a run's records hold, in joint angles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import find_action_space
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.observations import Demonstration, Observation
from roboirg.evaluation.records.action_log import read_actions
from roboirg.evaluation.records.record import Record
from roboirg.evaluation.records.store import read_records
from roboirg.policies.by_name.policy_kinds import PolicyKind, PolicyMaker
from roboirg.tasks.choices import choices_of

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv


class RecordedPolicy:
    """Plays the stored actions of an episode, whatever space they are in.

    So what a policy did in way points or tool poses can be exported as a demonstration. Of several
    records of an episode it takes the newest success, best in the setting and form that are played.
    Privileged: it knows the arm's own joints.

    Args:
        folder: of the run.
        name: of the policy whose records count; None for any.

    Raises:
        StoreError: the folder holds no records.
    """

    cameras: ClassVar[tuple[str, ...]] = ()
    demonstration_frames: ClassVar[str] = "none"

    def __init__(self, folder: Path, name: str | None = None) -> None:
        self._folder = folder
        self._records = [one for one in read_records(folder) if name in (None, one.policy)]
        self._env: RoboIRGEnv | None = None
        self._rows: Iterator[NDArray[np.float64]] = iter(())

    def attach(self, env: RoboIRGEnv) -> None:
        """Receive the environment whose arm moves."""
        self._env = env

    def reset(self, instruction: str, demonstration: Demonstration) -> None:  # noqa: ARG002
        """Find the record of the episode.

        Raises:
            InvalidValueError: there is none with actions.
            StoreError: the actions cannot be read.
        """
        if self._env is None:
            raise RuntimeError("RecordedPolicy needs attach(env) before reset().")
        record = self._find(self._env)
        self._rows = _joint_rows(self._env, self._folder, str(record.action_log))

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:  # noqa: ARG002
        """Return the next joint targets.

        Raises:
            InvalidValueError: the actions end before the episode does.
        """
        rows = next(self._rows, None)
        if rows is None:
            raise InvalidValueError("The recorded actions end before the episode does.")
        return rows

    def _find(self, env: RoboIRGEnv) -> Record:
        episode, said = env.episode, env.instruction
        found = [
            one
            for one in self._records
            if (one.task, one.split, one.episode) == (episode.task, episode.split, episode.index)
            and one.action_log is not None
        ]
        if not found:
            raise InvalidValueError(f"{self._folder} has no record of {episode.key} with actions.")
        return max(
            enumerate(found),
            key=lambda one: (
                one[1].outcome == "success",
                (one[1].setting, one[1].form) == (said.setting, said.form),
                one[0],
            ),
        )[1]


def _joint_rows(env: RoboIRGEnv, folder: Path, digest: str) -> Iterator[NDArray[np.float64]]:
    from roboirg.simulation.controllers import make_controller

    log = read_actions(folder, digest)
    choices = choices_of(env.episode)
    controller = make_controller(find_action_space(log.space), env.session.world, choices)
    for row in log.rows:
        yield from controller.trajectories(row)


def _recorded(spec: str, name: str, options: Mapping[str, str]) -> PolicyMaker:
    for option in options.keys() - {"policy"}:
        raise UnknownNameError("option of recorded:", option, ["policy"])
    if not name:
        raise InvalidValueError(f"Policy {spec!r} names no folder of a run.")
    return lambda _seed: RecordedPolicy(Path(name), options.get("policy"))


KIND = PolicyKind("recorded", _recorded)
"""``recorded:RUN?policy=NAME``: the stored actions of a run."""
