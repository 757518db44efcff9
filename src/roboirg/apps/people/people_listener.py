"""The policy of people as listeners: what a person answered, executed by the scripted expert."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboirg.apps.people.listener_answers import (
    PersonAnswered,
    person_name,
    read_events,
    standing_answers,
)
from roboirg.core.episode import Goal
from roboirg.core.errors import InvalidValueError
from roboirg.policies.builtin.scripted import ScriptedPolicy
from roboirg.policies.by_name.policy_specs import PolicyKind, PolicyMaker
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.util.short_hash import short_hash

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv
    from roboirg.evaluation.records.record import Job

STUDY_FILE = "study.json"


class PeopleListener(ScriptedPolicy):
    """Executes the goals that people named in a study; only the hands are privileged.

    The job's policy seed is the number of the person who is heard, of those who were asked about an
    episode. If the answer means no goal of the scene, the robot holds still.

    Args:
        folder: of the study.
        seed: not used.

    Raises:
        InvalidValueError: the folder holds no study.
    """

    demonstration_frames = "none"

    def __init__(self, folder: Path, seed: int = 0) -> None:
        super().__init__(seed)
        self.version = f"study {short_hash(study_content(folder))}"
        self._folder = folder
        self._answer: PersonAnswered | None = None
        self._person = 0

    def take_job(self, job: Job) -> None:
        """Learn which person is heard."""
        self._person = job.policy_seed

    @property
    def metadata(self) -> dict[str, Any]:
        """Who answered what, how fast, and after how many times of watching the video."""
        one = self._answer
        if one is None:
            return {}
        return {
            "person": person_name(one.person),
            "objects": list(one.objects),
            "values": one.values,
            "seconds": one.seconds,
            "plays": one.plays,
        }

    def decide(self, env: RoboIRGEnv, instruction: str) -> Goal | None:  # noqa: ARG002
        """Return the goal that was answered; None if the scene does not have it."""
        one = self._answer = self._find(env)
        return None if one.goal is None else goal_schema(one.task).goals[one.goal]

    def _find(self, env: RoboIRGEnv) -> PersonAnswered:
        episode, said = env.episode, env.instruction
        wanted = (episode.task, episode.split, episode.index, said.setting, said.form)
        for one in standing_answers(read_events(self._folder)):
            if (
                (one.task, one.split, one.episode, one.setting, one.form) == wanted
                and one.kind == "item"
                and one.policy_seed == self._person
            ):
                return one
        raise InvalidValueError(
            f"No person of this policy seed has answered {episode.key} in {said.setting}."
        )


def study_content(folder: Path) -> bytes:
    """Return the file of a study.

    Raises:
        InvalidValueError: the folder holds none.
    """
    path = folder / STUDY_FILE
    try:
        return path.read_bytes()
    except OSError as error:
        raise InvalidValueError(
            f"{str(folder)!r} holds no study of listeners ({error.strerror}: {path}); make one "
            "with: roboirg listen plan."
        ) from error


def _people(spec: str, name: str, options: Mapping[str, str]) -> PolicyMaker:
    if not name or options:
        raise InvalidValueError(f"Policy {spec!r} is not people:FOLDER, the folder of a study.")
    return lambda seed: PeopleListener(Path(name), seed)


KIND = PolicyKind("people", _people)
"""``people:FOLDER``: people name the goal, in a study of `roboirg listen`."""
