"""The scripted hands: follow subgoals in words with the motions of the scripted expert.

A subgoal such as ``pick up the red cube at <120, 87>`` becomes a motion of the expert, a
*primitive* (`roboirg.core.episode.Primitive`), whose moves are planned one by one.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, NamedTuple

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


class _Meant(NamedTuple):
    """The motion that a subgoal asks for, and the name of the object that it means, if any."""

    motion: Primitive
    thing: str | None


class _Outcome(NamedTuple):
    """How a motion ended, and why if it had no effect."""

    how: EndKind
    why: str = ""


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
        self._expert = MotionPrimitives(self._world)
        self._began = self._world.elapsed

    def usage(self) -> dict[str, float]:
        """Return how many subgoals were refused, and how many came to nothing."""
        counts = Counter(end.how for end in self.endings)
        refused = counts["refused"]
        return {"refused": refused, "missed": counts.total() - counts["done"] - refused}

    def follow(self, subgoal: str) -> None:
        """Begin the motion of a subgoal, or report at once how it ended; ignored during a motion.

        A subgoal that was just done, in the same words or as the same act, is reported as done
        again, so that a planner may repeat it. One that fits no thing or several is refused.
        """
        self.settle()
        if self._underway is not None:
            return
        last = self._last
        if last is not None and _says_the_same(subgoal, last.subgoal):
            self._report(subgoal, _Outcome("done"), last.thing)
            return
        try:
            motion, thing = self._find_motion(subgoal)
        except RefusedError as error:
            self._report(subgoal, _Outcome("refused", str(error)))
            return
        if last is not None and _act_of(motion) == _act_of(last.motion):
            self._report(subgoal, _Outcome("done"), thing)
            return

        if motion.kind != "hold":
            moves = self._expert.execute(motion)
        elif motion.steps:
            moves = iter([self._still(motion.steps)])
        else:
            moves = iter([])
        self._underway = _Underway(subgoal, motion, thing, moves, self._world.elapsed)

    def settle(self) -> None:
        """Plan the next move of the motion under way, and report the motion if it is over."""
        underway = self._underway
        if underway is None or underway.next is not None:
            return
        outcome = self._advance(underway)
        if outcome is None:
            return
        self._underway = None
        self._last = None
        if outcome.how == "done" and underway.motion.kind != "hold":
            self._last = underway
        self._report(underway.subgoal, outcome, underway.thing)

    def act(self, observation: Observation) -> Actions:  # noqa: ARG002
        """Return the next move; without a motion, actions that hold still."""
        self.settle()
        if self._underway is None or self._underway.next is None:
            return self._still(WAIT_STEPS)
        actions = self._underway.next
        self._underway.next = None
        return actions

    @property
    def _world(self) -> World:
        return self.env.session.world

    def _report(self, subgoal: str, outcome: _Outcome, thing: str | None = None) -> None:
        step = self._world.elapsed - self._began
        self.endings.append(SubgoalEnd(subgoal, outcome.how, outcome.why, thing, step))

    def _advance(self, underway: _Underway) -> _Outcome | None:
        """Plan the next move of a motion; return how the motion ended, or None if it goes on."""
        steps = self._world.elapsed - underway.since
        if steps > MOST_STEPS and underway.motion.kind != "hold":
            return _Outcome("time-out", f"it took more than {MOST_STEPS} steps")
        try:
            underway.next = next(underway.chunks, None)
        except MotionPlanningError as error:
            return _Outcome("blocked", str(error))
        if underway.next is not None:
            return None
        if self._had_effect(underway):
            return _Outcome("done")
        if underway.motion.kind in PICKS:
            return _Outcome("missed", "nothing is in the gripper")
        return _Outcome("missed", "the motion had no effect")

    def _find_motion(self, subgoal: str) -> _Meant:
        """Return the motion that a subgoal asks for, and the name of the object that it means.

        A motion that handles what is held has that as its subject, and the object as its place.

        Raises:
            RefusedError: it fits nothing or several things.
        """
        from roboirg.simulation.expert.things import held_thing

        request = read_subgoal(subgoal)
        if request is None:
            raise RefusedError(UNKNOWN_WORDS)
        held = held_thing(self._world)
        kind = request.kind
        if kind in HANDLES_HELD and held is None:
            raise RefusedError(EMPTY_HAND)
        if kind == "hold":
            return _Meant(Primitive("hold", ROBOT, steps=request.steps), None)

        thing = None if request.thing is None else self._select(request)
        if kind == "press":
            return _Meant(self._press(request, str(thing)), thing)
        if kind == "put_down":
            return _Meant(Primitive("put_down", str(held), height=self._release_height()), held)
        if kind in HANDLES_HELD:
            return _Meant(Primitive(kind, str(held), thing), thing)
        return _Meant(Primitive(kind, str(thing)), thing)

    def _press(self, request: Request, thing: str) -> Primitive:
        """Return the press of a button, from where the tool is if it hovers above it already.

        *Press the button to stop the cube on the target* means the target, and its point may be
        that of the target; then the scene's only button is pressed.
        """
        button = thing
        if request.thing != "button":
            button = self._select(Request("press", "button"))
        is_above = Fact("hovering", ROBOT, button) in self._world.facts
        return Primitive("press_below" if is_above else "press", button)

    def _release_height(self) -> float:
        """Return the height at which this task's expert lets go of what it puts down."""
        from roboirg.tasks.choices import choices_of

        for choice in choices_of(self.env.episode):
            motion = choice.primitives[0]
            if motion.kind == "put_down":
                return motion.height
        return Primitive("put_down", ROBOT).height

    def _select(self, request: Request) -> str:
        """Return the name of the object that a request means: by its point, else by its words.

        Raises:
            RefusedError: nothing is near the point, or the words fit nothing or several things.
        """
        from roboirg.simulation.expert.things import nearest_thing, present_things

        things = present_things(self._world, (str(request.thing),))
        if request.point is not None:
            nearest = nearest_thing(things, request.point)
            if nearest is not None:
                thing, pixels = nearest
                if pixels <= REACH_PIXELS:
                    return thing.item.name
            row, column = request.point
            raise RefusedError(
                f"no {request.thing} is within {REACH_PIXELS} pixels of <{row}, {column}>"
            )

        fits = [thing.item for thing in things if request.color in (None, thing.item.color)]
        if request.side is not None and fits:
            bodies = self._world.bodies
            # From right to left: the one with the least y is farthest to the right.
            in_order = sorted(fits, key=lambda item: bodies[item.name].position.y)
            fits = in_order[:1] if request.side == "right" else in_order[-1:]
        if len(fits) == 1:
            return fits[0].name
        count = f"{len(fits)} things fit" if fits else "nothing fits"
        raise RefusedError(f"{count} the words {_words_of(request)!r}; a point would say which")

    def _still(self, steps: int) -> NDArray[np.float64]:
        """Return actions that keep the arm and the gripper as they are."""
        arm = self._world.robot.arm_positions
        return np.tile(np.append(arm, self._expert.gripper), (steps, 1))

    def _had_effect(self, underway: _Underway) -> bool:
        """Return whether a motion that was made to its end has had its effect.

        A press has it if the button was pressed since it began, as that is over at once. For other
        motions, one of the facts in `_EFFECTS` must hold now.
        """
        motion = underway.motion
        session = self.env.session
        if motion.kind in ("press", "press_below"):
            pressed = Fact("pressed", motion.subject)
            late = [event for event in session.events if event.step > underway.since]
            return any(event.holds and event.fact == pressed for event in late)
        things = (motion.subject, motion.place)
        if motion.kind == "hover":
            things = (ROBOT, motion.subject)
        effects = {Fact(kind, *things) for kind in _EFFECTS.get(motion.kind, ())}
        return not effects or not effects.isdisjoint(session.world.facts)


def _words_of(request: Request) -> str:
    """Return the object of a request as its words give it, such as ``left-side red cube``."""
    words = [request.color, request.thing]
    if request.side is not None:
        words.insert(0, f"{request.side}-side")
    return " ".join(word for word in words if word)


def _says_the_same(subgoal: str, other: str) -> bool:
    """Return whether two subgoals mean the same: equal words, and points near each other.

    Without a point in one of them, the texts must be equal.
    """
    words, point = split_point(subgoal)
    other_words, other_point = split_point(other)
    if point is None or other_point is None:
        return subgoal == other
    return words == other_words and math.dist(point, other_point) <= REACH_PIXELS


def _act_of(motion: Primitive) -> tuple[str, ...]:
    """Return what a motion does, however it gets there: ``press_below``, from a hover, presses."""
    return motion.kind.removesuffix("_below"), motion.subject, motion.place or ""
