"""Make failures whose cause is known: the oracle's motions in the simulator, disturbed on purpose.

A cause is a function that plays with `Hands`, marked with its truth: the kind and the name of the
failure that was made (not what the acts look like), ``success`` for a control, or ``unscored`` for
what acts cannot show. A course that succeeds though it was to fail is not kept.

    @cause("execution", "missed_grasp", "PickXtimes", "VideoRepick")
    def misses_the_first_and_goes_on(hands: Hands) -> None:
        first, *rest = hands.stages
        hands.do(first, beside=0.04)  # the whole motion 4 cm beside its object
        hands.play(rest)

`hands.stages` are those of the episode; `hands.stages_of(goal)` those of another goal of the scene
(`hands.other_goals`). What the scene does not offer is refused with `need(...)`, and the cause is
then not played there. A cause ends where the episode does; if it returns before, the arm rests
until time is up. Then ``play_cause(cause, episode)`` returns the course of facts to store, and
`write_courses` and `read_courses` keep many of them in a file. Give causes names of their own: they
are the rows of a table.
"""

from __future__ import annotations

import json
import lzma
import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from roboirg.core.conditions import Fact
from roboirg.core.episode import Goal, Primitive, Stage
from roboirg.core.errors import MotionPlanningError
from roboirg.core.motions import Point
from roboirg.judging import Event
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode

TIME = 1300
"""Steps that a cause has, unless it says otherwise."""
OPEN = 1.0
CLOSED = -1.0


class NotOfferedError(Exception):
    """The scene does not offer what a cause needs."""


class OverError(Exception):
    """The episode has ended."""


class Course(NamedTuple):
    """What happened in an episode, and what was made to happen.

    Attributes:
        cause: name of the cause.
        kind: of the failure that was made: grounding, execution, undecided; ``success`` of a
            control; ``unscored``.
        failure: its name, or None if only the kind counts.
        where: task, split and index of the episode.
        status: how it ended: success, failure, timeout.
        start: steps of the world before the policy's turn.
        elapsed: steps of the world in all.
        words: the judge's cause, if it gave one.
        declared: what a listener understood, as `Hands.declare` got it; None if nothing was said.
        events: facts that changed.
        attempts: the same of facts of attempts.
    """

    cause: str
    kind: str
    failure: str | None
    where: tuple[str, str, int]
    status: str
    start: int
    elapsed: int
    words: str | None
    declared: Mapping[str, Any] | None
    events: tuple[Event, ...]
    attempts: tuple[Event, ...]

    @property
    def episode(self):
        return get_episode(*self.where)


class Cause(NamedTuple):
    """One way to fail, as `cause` marks it."""

    name: str
    kind: str
    failure: str | None
    tasks: tuple[str, ...]
    play: Callable[[Hands], None]
    time: int


CAUSES = []


def cause(kind, failure, *tasks, time=TIME):
    """Mark a function as a cause of a failure in some tasks, with the steps that it has."""

    def keep(play):
        CAUSES.append(Cause(play.__name__, kind, failure, tasks, play, time))
        return play

    return keep


def need(offered):
    """Refuse a scene that does not offer something."""
    if not offered:
        raise NotOfferedError


class Hands:
    """The oracle's hands in one episode, which can be disturbed.

    Attributes:
        episode: what is played.
        stages: what is meant.
        rng: for whatever a cause draws; the same in each run.
        slower: how many times slower than the oracle everything is done.
    """

    def __init__(self, episode, time):
        import roboirg

        self.env = roboirg.make(episode, cameras=(), max_steps=time)
        _, info = self.env.reset()
        self.start = int(info["elapsed_steps"])
        self.episode, self.stages, self.slower = episode, episode.stages, 1
        self.rng = np.random.default_rng(episode.seed)
        self.declared = None
        self._expert = _disturbed_expert(self.env.session.world)

    # What there is

    @property
    def other_goals(self):
        """All other goals of the scene."""
        goals = get_task(self.episode.task).goals(self.episode.scene)
        return [goal for goal in goals if goal != self.episode.goal]

    def stages_of(self, goal):
        return get_task(self.episode.task).stages(self.episode.scene, goal)

    def others(self, name):
        """Names of the other objects of the same kind that are there, the nearest first."""
        same = self.episode.scene.of_kind(self.episode.scene[name].kind)
        absent = self.env.session.world.absent
        names = [thing.name for thing in same if thing.name != name and thing.name not in absent]
        return sorted(names, key=lambda other: math.dist(self.at(other), self.at(name)))

    def at(self, name):
        """Where an object is now, m."""
        return self.env.session.world.bodies[name].position

    def picks(self):
        """Indices of the stages that pick something up."""
        return [i for i, stage in enumerate(self.stages) if stage.primitive.kind.startswith("pick")]

    @property
    def step(self):
        """Steps of the world so far; those of `Primitive.steps` are counted in the same way."""
        return self.env.session.world.elapsed

    # What they do

    def play(self, stages):
        """Do stages as the oracle does, each once."""
        for stage in stages:
            self.do(stage)

    def do(
        self,
        what,
        *,
        beside=0.0,
        until=1.0,
    ):
        """Do a stage or a primitive, disturbed.

        Args:
            what: a stage of any goal, or a `Primitive("pick_cube", name)` and the like.
            beside: by how much the whole motion is beside its object or place, m, in the direction
                in which the least is in the way.
            until: share of the motion's pieces after which it is broken off.
        """
        primitive = what.primitive if isinstance(what, Stage) else what
        about = str(primitive.place or primitive.subject)
        self._expert.shift = self._free_way(about, beside)
        pieces = _PIECES.get(primitive.kind, 4)
        for number, rows in enumerate(self._expert.execute(primitive)):
            if number >= until * pieces:
                break
            self.execute(rows)
        self._expert.shift = (0.0, 0.0)

    def execute(self, rows):
        """Execute joint targets and gripper, (n, 8), perhaps more slowly."""
        if self.slower != 1:
            rows = np.repeat(rows, self.slower, axis=0)
        self.env.step_chunk(rows)
        if self.env.status != "ongoing":
            raise OverError

    def go(self, point):
        """Move the tool in a straight line, fingers down, m; the gripper stays as it is."""
        self.execute(self._expert.way(Point(*point)))

    def grip(self, gripper):
        """Open (+1) or close (-1) the fingers, or in between."""
        self.execute(self._expert.gripping(gripper))

    def wait(self, steps):
        """Rest."""
        self.execute(np.repeat(self._expert.here()[None], steps, axis=0))

    def tremble(self, steps):
        """Shake all joints about where they are, by up to 0.02 rad."""
        rows = np.repeat(self._expert.here()[None], steps, axis=0)
        rows[:, :-1] += self.rng.uniform(-0.02, 0.02, rows[:, :-1].shape)
        self.execute(rows)

    def snatch(self, name, times=1, beside=0.03):
        """Go for a thing with closing fingers that miss it, the hand up again after each time."""
        kind = "pick_container" if self.episode.scene[name].kind == "container" else "pick_cube"
        for _ in range(times):
            self.do(Primitive(kind, name), beside=beside)

    def declare(self, goal, *, impossible=False):
        """Say what a listener understood: a goal, or None for no answer."""
        slots = dict(goal.as_mapping()) if isinstance(goal, Goal) else goal
        self.declared = {"understood": slots, "impossible": impossible}

    def _free_way(self, name, distance):
        """Return the vector of a length that leads farthest from all other objects."""
        if not distance:
            return 0.0, 0.0
        x, y, _ = self.at(name)
        others = self._places_of_others(name)

        def space(way):
            right, ahead = way
            gaps = [math.dist((x + right, y + ahead), place) for place in others]
            # Not out of the arm's reach, or under it.
            too_far = max(0.0, x + right - 0.15)
            too_near = max(0.0, -0.2 - x - right)
            return min((*gaps, 0.3)) - too_far - too_near

        ways = []
        for turn in np.arange(0.0, 2 * math.pi, math.pi / 8):
            ways.append((distance * math.cos(turn), distance * math.sin(turn)))
        return max(ways, key=space)

    def _places_of_others(self, name):
        """Return where on the table all other objects stand that have a height."""
        world = self.env.session.world
        return [
            body.position[:2]
            for other, body in world.bodies.items()
            if other != name and other not in world.absent and body.item.kind not in _FLAT
        ]


_FLAT = ("target", "site", "marker", "shuttle", "hidden_cube")
_PIECES = {"pick_cube": 6, "pick_container": 6, "place_on": 4, "put_into": 4, "drop_into": 3}
"""Trajectories that a primitive yields; four where it is not said."""


def _disturbed_expert(world):
    from roboirg.simulation.expert.primitives import STRAIGHT_DOWN, MotionPrimitives
    from roboirg.simulation.physics_settings import GRIPPER_STEPS

    class Disturbed(MotionPrimitives):
        """Primitives that go beside what they mean."""

        shift = (0.0, 0.0)

        def execute(self, primitive):
            if primitive.kind == "pick_cube" and self.shift != (0.0, 0.0):
                return self._grasp_and_lift(primitive.subject, OPEN)  # once
            return super().execute(primitive)

        def _position(self, name):
            place = super()._position(name)
            return Point(place.x + self.shift[0], place.y + self.shift[1], place.z)

        def way(self, point):
            return self._move(point, STRAIGHT_DOWN)

        def gripping(self, gripper):
            return np.tile(self._grip(gripper)[:1], (GRIPPER_STEPS, 1))

        def here(self):
            return np.append(world.robot.arm_positions, self._gripper)

    return Disturbed(world)


def play_cause(cause, episode):
    """Play a cause in an episode; None if the scene does not offer it, or the arm cannot do it."""
    hands = Hands(episode, cause.time)
    try:
        cause.play(hands)
        while True:
            hands.wait(50)
    except (NotOfferedError, MotionPlanningError):
        return None
    except OverError:
        pass
    env = hands.env
    return Course(
        cause.name,
        cause.kind,
        cause.failure,
        (episode.task, episode.split, episode.index),
        env.status,
        hands.start,
        env.session.world.elapsed,
        env.cause,
        hands.declared,
        tuple(env.events),
        tuple(env.attempts),
    )


def play_causes(causes, indices, scenes):
    """Play each cause in the first scenes of each of its tasks that offer it."""
    for cause in causes:
        for task in cause.tasks:
            found = 0
            for index in indices:
                if found == scenes:
                    break
                course = play_cause(cause, get_episode(task, "test", index))
                if course is not None and (course.status == "success") <= (
                    course.kind in ("success", "unscored")
                ):
                    found += 1
                    yield course


def write_courses(path, courses):
    """Write courses, compressed."""
    lines = []
    for course in courses:
        *rest, events, attempts = course
        shortened = [*map(_short, events)], [*map(_short, attempts)]
        lines.append(json.dumps([*rest, *shortened]))
    path.write_bytes(lzma.compress("\n".join(lines).encode(), preset=9))


def read_courses(path):
    """Read what `write_courses` wrote."""
    found = []
    for line in lzma.decompress(path.read_bytes()).decode().splitlines():
        *rest, events, attempts = json.loads(line)
        rest[3] = tuple(rest[3])
        parts = (tuple(map(_event, part)) for part in (events, attempts))
        found.append(Course(*rest, *parts))
    return found


def _short(event):
    return [event.step, *event.fact, int(event.holds)]


def _event(short):
    step, kind, subject, place, holds = short
    return Event(step, Fact(kind, subject, place), bool(holds))
