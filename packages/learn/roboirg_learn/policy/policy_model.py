"""What a policy has learned, in one file of plain tensors, and an episode as it sees it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from roboirg.extension.episodes import goal_schema
from roboirg.extension.sight import points_of
from roboirg_learn.listener.listener_net import ListenerNet
from roboirg_learn.listener.object_relations import ObjectsInView, rank
from roboirg_learn.listener.vocabulary import ListenerInput, Vocabulary, parts_of
from roboirg_learn.policy.body_net import BodyAnswer, BodyNet
from roboirg_learn.policy.memories import Carried
from roboirg_learn.policy.moves import Move, waypoint
from roboirg_learn.policy.planner_history import PlannedNumbers, context_size
from roboirg_learn.policy.policy_data import EpisodeNumbers, LookHistory, to_batch
from roboirg_learn.policy.policy_plan import HANDS, PLANNERS, WORDLESS
from roboirg_learn.policy.sight import Sight
from roboirg_learn.policy.subgoals import ASKED_NUMBERS, SubgoalForm
from roboirg_learn.policy.task_net import TaskNet
from roboirg_learn.policy.thing_detector import ThingDetector
from roboirg_learn.policy.tracks import LookTokens
from roboirg_learn.trained_file import load_nets, load_trained, save_trained

FORMAT = "roboirg-policy-2"
FIRST_LOOKS = (0, 5)
"""Looks at which the reader of words sees a video, two seconds apart; else it sees the first."""
_BATCH = 32

Kind = Move | SubgoalForm
"""What a network chooses among: kinds of waypoints, or forms of subgoals."""
Pictures = Sequence[NDArray[np.uint8]]


class PolicyModel(NamedTuple):
    """A trained policy.

    Attributes:
        sight: classes of things, and the heights at which they stand.
        detector: finds them.
        vocabulary: of words, classes, tasks and parts of goals.
        task_net: names the task from words and the first looks.
        reader: understands the goal from the same.
        corners: (4, 2) of the area where things stand, m.
        moves: kinds of waypoints.
        memory: what it remembers; a name of `MEMORIES`.
        body: chooses the next waypoint.
        about: how it was trained, for records.
        forms: of the subgoals that its planner names.
        planner: names the next subgoal; None if it has none, and then its body follows none.
    """

    sight: Sight
    detector: ThingDetector
    vocabulary: Vocabulary
    task_net: TaskNet
    reader: ListenerNet
    corners: NDArray[np.float64]
    moves: tuple[Move, ...]
    memory: str
    body: BodyNet
    about: dict[str, Any]
    forms: tuple[SubgoalForm, ...] = ()
    planner: BodyNet | None = None

    def understand(self, text: str, looks: Sequence[LookTokens]) -> NDArray[np.float32]:
        """Return the task and the goal that an instruction means, as `goal_numbers` does.

        Args:
            text: everything that was said.
            looks: the first one, and a later one of the video if there is one.
        """
        heard = "" if self.about["words"] == WORDLESS else text
        seen = seen_things(looks, self.corners, self.sight.classes)
        with torch.no_grad():
            task = self.vocabulary.tasks[int(self.task_net([heard], [seen])[0].argmax())]
            (scores,) = self.reader([ListenerInput(task, heard, seen)])
        answer = list(goal_schema(task).goals)[int(scores.argmax())]
        return goal_numbers(task, answer, self.vocabulary)


def seen_things(
    looks: Sequence[LookTokens], corners: NDArray[np.float64], classes: Sequence[str]
) -> ObjectsInView:
    """Return what is seen at one or two looks, for the reader."""
    places = np.concatenate([one.places for one in looks]).astype(np.float64)
    return rank([one.classes for one in looks], places, corners, classes)


def goal_numbers(task: str, answer: str, vocabulary: Vocabulary) -> NDArray[np.float32]:
    """Return 1 for the task and for each part of an answer, else 0: (tasks + parts,)."""
    found = np.zeros(vocabulary.goal_size, np.float32)
    found[vocabulary.tasks.index(task)] = 1.0
    for part in parts_of(answer):
        found[len(vocabulary.tasks) + vocabulary.parts.index(part)] = 1.0
    return found


class NetworkChoice(NamedTuple):
    """What a network chooses.

    Attributes:
        kind: number of the kind of waypoint, or of the form of a subgoal.
        thing: track of the thing; None where there is none.
        keys: places among the recent looks of those to be kept.
    """

    kind: int
    thing: int | None
    keys: tuple[int, ...]


class SeenEpisode:
    """One episode as a policy sees it.

    Args:
        model: the policy.

    Attributes:
        video_looks: number of looks at the video.
    """

    def __init__(self, model: PolicyModel) -> None:
        self._model = model
        self._history = LookHistory()
        self._first: list[LookTokens] = []
        self._carried: dict[BodyNet, tuple[NDArray[np.float32], Carried]] = {}
        self.video_looks = 0

    def look(
        self,
        pictures: Pictures,
        tools: Sequence[NDArray[np.floating[Any]]],
        *,
        is_video: bool,
    ) -> None:
        """See pictures of the front camera.

        Args:
            pictures: in the order of time.
            tools: (7,) the tool's pose and a finger's opening at each.
            is_video: whether they are of the video.
        """
        for start in range(0, len(pictures), _BATCH):
            part = slice(start, start + _BATCH)
            found = self._model.detector.find(pictures[part])
            for things, tool in zip(found, tools[part], strict=True):
                places = self._model.sight.places(things.classes, things.points)
                tokens = LookTokens(things.classes, places, things.turns)
                if len(self._history) in (FIRST_LOOKS if is_video else FIRST_LOOKS[:1]):
                    self._first.append(tokens)
                self._history.add(tokens, tool, is_video=is_video)
        self.video_looks += len(pictures) if is_video else 0

    def understand(self, text: str) -> NDArray[np.float32]:
        """Return the goal that an instruction means, as `PolicyModel.understand` does."""
        return self._model.understand(text, self._first)

    @property
    def looks(self) -> int:
        """Number of looks so far."""
        return len(self._history)

    @torch.no_grad()
    def choose(
        self, net: BodyNet, goal: NDArray[np.float32], planned: PlannedNumbers | None
    ) -> NetworkChoice:
        """Return what a network, body or planner, chooses after the last look."""
        nothing = np.array([-1])
        now = np.array([len(self._history) - 1])
        looks = self._history.numbers()
        numbers = EpisodeNumbers(looks, goal, now, nothing, nothing, nothing, planned)
        goal_before, carried = self._carried.get(net, (goal, Carried()))
        if not np.array_equal(goal, goal_before):
            carried = Carried()
        self._carried[net] = goal, carried
        answer: BodyAnswer = net(to_batch([numbers]), carried)
        kind = int(answer.moves[0, 0].argmax())
        thing = int(answer.things[0, 0, kind].argmax())
        keys = () if answer.keys is None else np.flatnonzero(answer.keys[0, 0].numpy() > 0)
        return NetworkChoice(
            kind, thing if thing < self._history.tracks.count else None, tuple(keys)
        )

    def point(self, thing: int) -> NDArray[np.float64]:
        """Return column and row in the front picture of a thing, where it was last seen."""
        tracks, heights = self._history.tracks, self._model.sight.heights
        height = heights[tracks.classes[thing]]
        return points_of(np.append(tracks.places[thing].astype(np.float64), height))

    def decide(
        self,
        goal: NDArray[np.float32],
        tool: NDArray[np.floating[Any]],
        planned: PlannedNumbers | None = None,
    ) -> NDArray[np.float64]:
        """Return the next waypoint (7), after the last look.

        Args:
            goal: as `understand` returns it.
            tool: (7,) of the last look.
            planned: the subgoal to follow, for hands.
        """
        chosen = self.choose(self._model.body, goal, planned)
        move, tracks = self._model.moves[chosen.kind], self._history.tracks
        if not move.at_thing or chosen.thing is None:
            here = np.asarray(tool[:2], np.float64)
            return waypoint(move, tool, here, np.array([1.0, 0.0]))
        return waypoint(move, tool, tracks.places[chosen.thing], tracks.turns[chosen.thing])


def save_policy(model: PolicyModel, path: Path) -> None:
    """Write a trained policy.

    Raises:
        InvalidValueError: the file cannot be written.
    """
    content: dict[str, Any] = {
        "format": FORMAT,
        "classes": list(model.sight.classes),
        "heights": torch.from_numpy(np.asarray(model.sight.heights)),
        "vocabulary": model.vocabulary.content,
        "corners": torch.from_numpy(model.corners),
        "moves": [list(move) for move in model.moves],
        "memory": model.memory,
        "about": model.about,
        "detector": model.detector.state_dict(),
        "task_net": model.task_net.state_dict(),
        "encoders": model.reader.settings,
        "reader": model.reader.state_dict(),
        "body": model.body.state_dict(),
        "forms": [form.words for form in model.forms],
    }
    if model.planner is not None:
        content["planner"] = model.planner.state_dict()
    save_trained(content, path)


def load_policy(path: Path) -> PolicyModel:
    """Return a trained policy; nothing of the file is executed.

    Raises:
        InvalidValueError: the file is none.
    """
    return load_trained(path, "policy", FORMAT, _read)


def _read(content: Mapping[str, Any]) -> PolicyModel:
    vocabulary = Vocabulary.of(content["vocabulary"])
    moves = tuple(Move(*move) for move in content["moves"])
    sight = Sight(tuple(content["classes"]), content["heights"].numpy())
    detector = ThingDetector(len(sight.classes))
    reader = ListenerNet(vocabulary, content["encoders"])
    task_net = TaskNet(vocabulary)
    memory = content["memory"]
    body = make_body(sight, vocabulary, moves, HANDS if memory in PLANNERS else memory)
    nets: dict[str, Any] = {
        "detector": detector,
        "task_net": task_net,
        "reader": reader,
        "body": body,
    }
    forms = tuple(map(SubgoalForm, content.get("forms", ())))
    planner = make_body(sight, vocabulary, forms, memory) if memory in PLANNERS else None
    if planner is not None:
        nets["planner"] = planner
    load_nets(nets, content)
    corners = content["corners"].numpy()
    return PolicyModel(
        sight, detector, vocabulary, task_net, reader, corners, moves, memory, body,
        content["about"], forms, planner,
    )  # fmt: skip


def make_body(sight: Sight, vocabulary: Vocabulary, moves: Sequence[Kind], memory: str) -> BodyNet:
    """Return an untrained body for these classes, goals and kinds, or an untrained planner."""
    planner = dict.fromkeys(PLANNERS, context_size(len(moves)))
    context = {HANDS: ASKED_NUMBERS, **planner}.get(memory, 0)
    at_things = [move.at_thing for move in moves]
    return BodyNet(len(sight.classes), vocabulary.goal_size, at_things, memory, context)
