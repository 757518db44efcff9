"""The scripted hands: follow subgoals in words with the motions of the scripted expert."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import Actions
from roboirg.core.conditions import Fact
from roboirg.core.episode import HANDLES_HELD, PICKS, ROBOT, Primitive
from roboirg.core.errors import MotionPlanningError
from roboirg.core.observations import Demonstration, Observation
from roboirg.core.subgoal_text import EMPTY_HAND, SCRIPTED_HANDS, UNKNOWN_WORDS, split_point
from roboirg.core.subgoal_words import WAIT_STEPS, Request, read_subgoal
from roboirg.policies.contract.base import AttachedPolicy, EndKind, SubgoalEnd

if TYPE_CHECKING:
    from roboirg.simulation.world import World

REACH_PIXELS = 24
"""Farthest that the origin of a thing may be from a point that means it."""
MOST_STEPS = 400
"""Control steps after which a motion is given up."""

_EFFECTS: dict[str, tuple[str, ...]] = {
    "pick_cube": ("picked",),
    "pick_container": ("lifted",),
    "place_on": ("placed",),
    "drop_into": ("binned",),
    "put_into": ("binned",),
    "move_over": ("over",),
    "put_down": ("lying", "put_down"),
    "hover": ("hovering",),
}
"""Facts that come of a motion; pressing has an event instead, and waiting has none."""


class RefusedError(Exception):
    """A subgoal fits nothing or several things; caught by `ScriptedHands.follow`."""


@dataclass
class _Underway:
    """The motion that is being made.

    Attributes:
        subgoal: that asked for it.
        motion: what is done.
        thing: name of the object that was meant.
        chunks: its moves.
        since: control steps of the world at its beginning.
        next: the move that comes next, once it is planned.
    """

    subgoal: str
    motion: Primitive
    thing: str | None
    chunks: Iterator[NDArray[np.float64]]
    since: int
    next: NDArray[np.float64] | None = None


class ScriptedHands(AttachedPolicy):
    """Executes subgoals of RoboMME's grammar on what their words or their point select.

    Privileged: it reads the poses of all objects, but neither the goal nor the instruction. A
    motion that has begun is carried to its end; what is named meanwhile is not followed. The motion
    just done is not repeated until another was made, so that a subgoal may stand. A refusal takes
    no control step.

    Attributes:
        endings: how each subgoal ended, in order.
    """

    cameras: tuple[str, ...] = ()
    version = SCRIPTED_HANDS
    metadata: ClassVar[Mapping[str, str]] = {"hands": "scripted"}

    def __init__(self) -> None:
        self.endings: list[SubgoalEnd] = []

    def reset(self, instruction: str, demonstration: Demonstration) -> None:  # noqa: ARG002
        """Begin an episode; the instruction is the planner's."""
        from roboirg.simulation.expert.primitives import MotionPrimitives

        self.endings = []
        self._underway: _Underway | None = None
        self._last: _Underway | None = None
        self._expert, self._began = MotionPrimitives(self._world), self._world.elapsed

    def usage(self) -> dict[str, float]:
        """Return how many subgoals were refused, and how many came to nothing."""
        ends = Counter(one.how for one in self.endings)
        refused = ends["refused"]
        return {"refused": refused, "missed": ends.total() - ends["done"] - refused}

    def follow(self, subgoal: str) -> None:
        """Begin the motion of a subgoal, or refuse it; without effect while a motion is made."""
        self.settle()
        if self._underway is not None:
            return
        if self._last is not None and _says_the_same(subgoal, self._last.subgoal):
            self._report(subgoal, "done", thing=self._last.thing)
            return
        try:
            motion, thing = self._find_motion(subgoal)
        except RefusedError as error:
            self._report(subgoal, "refused", str(error))
            return
        if self._last is not None and _act_of(motion) == _act_of(self._last.motion):
            self._report(subgoal, "done", thing=thing)
            return
        if motion.kind == "hold":
            moves = iter([self._still(motion.steps)] if motion.steps else [])
        else:
            moves = self._expert.execute(motion)
        self._underway = _Underway(subgoal, motion, thing, moves, self._world.elapsed)

    def settle(self) -> None:
        """Plan the next move of the motion under way, and report the motion if it is over."""
        now = self._underway
        if now is None or now.next is not None:
            return
        how: EndKind | None = None
        if self._world.elapsed - now.since > MOST_STEPS and now.motion.kind != "hold":
            how, why = "time-out", f"it took more than {MOST_STEPS} steps"
        else:
            try:
                now.next = next(now.chunks, None)
                if now.next is None:
                    how, why = self._outcome(now)
            except MotionPlanningError as error:
                how, why = "blocked", str(error)
        if how is not None:
            self._underway = None
            self._last = now if how == "done" and now.motion.kind != "hold" else None
            self._report(now.subgoal, how, why, now.thing)

    def act(self, observation: Observation) -> Actions:  # noqa: ARG002
        """Return the next move; without a motion, actions that hold still."""
        self.settle()
        if self._underway is None or self._underway.next is None:
            return self._still(WAIT_STEPS)
        rows, self._underway.next = self._underway.next, None
        return rows

    @property
    def _world(self) -> World:
        return self.env.session.world

    def _report(self, subgoal: str, how: EndKind, why: str = "", thing: str | None = None) -> None:
        step = self._world.elapsed - self._began
        self.endings.append(SubgoalEnd(subgoal, how, why, thing, step))

    def _find_motion(self, subgoal: str) -> tuple[Primitive, str | None]:
        """Return the motion of a subgoal, and the name of the object that it means."""
        from roboirg.simulation.expert.things import held_thing
        from roboirg.tasks.choices import choices_of

        request = read_subgoal(subgoal)
        if request is None:
            raise RefusedError(UNKNOWN_WORDS)
        held = held_thing(self._world)
        if request.kind in HANDLES_HELD and held is None:
            raise RefusedError(EMPTY_HAND)
        thing = None if request.thing is None else self._select(request)
        match request.kind:
            case "hold":
                return Primitive("hold", ROBOT, steps=request.steps), None
            case "press":  # the point may be that of a target
                is_meant = request.thing == "button"
                button = str(thing) if is_meant else self._select(Request("press", "button"))
                is_above = Fact("hovering", ROBOT, button) in self._world.facts
                return Primitive("press_below" if is_above else "press", button), thing
            case "put_down":  # at the height at which this task's expert lets go
                motions = (one.primitives[0] for one in choices_of(self.env.episode))
                usual = Primitive("put_down", ROBOT).height
                height = next((one.height for one in motions if one.kind == "put_down"), usual)
                return Primitive("put_down", str(held), height=height), held
            case kind if kind in HANDLES_HELD:
                return Primitive(kind, str(held), thing), thing
            case kind:
                return Primitive(kind, str(thing)), thing

    def _select(self, request: Request) -> str:
        """Return the name of the object that the point means, or else the words."""
        from roboirg.simulation.expert.things import nearest_thing, present_things

        things = present_things(self._world, (str(request.thing),))
        if request.point is not None:
            found = nearest_thing(things, request.point)
            if found is None or found[1] > REACH_PIXELS:
                row, column = request.point
                raise RefusedError(
                    f"no {request.thing} is within {REACH_PIXELS} pixels of <{row}, {column}>"
                )
            return found[0].item.name
        fits = [one.item for one in things if request.color in (None, one.item.color)]
        if request.side is not None and fits:
            position = self._world.bodies
            by_y = sorted(fits, key=lambda one: position[one.name].position.y)
            fits = [by_y[0 if request.side == "right" else -1]]
        if len(fits) != 1:
            count = "nothing fits" if not fits else f"{len(fits)} things fit"
            side = request.side and f"{request.side}-side"
            meant = " ".join(word for word in (side, request.color, request.thing) if word)
            raise RefusedError(f"{count} the words {meant!r}; a point would say which")
        return fits[0].name

    def _still(self, steps: int) -> NDArray[np.float64]:
        """Return actions that keep the arm and the gripper as they are."""
        arm = self._world.robot.arm_positions
        return np.tile(np.append(arm, self._expert.gripper), (steps, 1))

    def _outcome(self, now: _Underway) -> tuple[EndKind, str]:
        """Return how a motion ended that was made to its end, and why it had no effect."""
        session, motion = self.env.session, now.motion
        if motion.kind in ("press", "press_below"):
            late = (one for one in session.events if one.step > now.since and one.holds)
            came = any(one.fact == Fact("pressed", motion.subject) for one in late)
        else:
            is_hover = motion.kind == "hover"
            things = (ROBOT, motion.subject) if is_hover else (motion.subject, motion.place)
            wanted = {Fact(kind, *things) for kind in _EFFECTS.get(motion.kind, ())}
            came = not wanted or not wanted.isdisjoint(session.world.facts)
        if came:
            return "done", ""
        is_pick = motion.kind in PICKS
        return "missed", "nothing is in the gripper" if is_pick else "the motion had no effect"


def _says_the_same(subgoal: str, other: str) -> bool:
    """Return whether two subgoals have the same words, and points that may mean the same thing."""
    (words, point), (other_words, other_point) = split_point(subgoal), split_point(other)
    if point is None or other_point is None:
        return subgoal == other
    return words == other_words and math.dist(point, other_point) <= REACH_PIXELS


def _act_of(motion: Primitive) -> tuple[str, ...]:
    """Return what a motion does, however it gets there."""
    return motion.kind.removesuffix("_below"), motion.subject, motion.place or ""
