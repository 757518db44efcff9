"""The scripted hands: follow subgoals in words with the motions of the scripted expert.

A subgoal such as ``pick up the red cube at <120, 87>`` (row and column in the front picture)
becomes a motion of the expert, a *primitive* (`roboirg.core.episode.Primitive`). A motion is made
of moves, chunks of actions (n, 8), which are planned one by one.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
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
    from roboirg.simulation.expert.things import Thing
    from roboirg.simulation.world import World

REACH_PIXELS = 24
"""Farthest in the front picture that the origin of an object may be from a point that means it."""
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
"""Facts of which a motion brings about one, by kind; a press has an event instead, a wait none."""


class RefusedError(Exception):
    """A subgoal fits no object, or several; its text says why. Caught by `ScriptedHands.follow`."""


class _Meant(NamedTuple):
    """The motion that a subgoal asks for, and the name of the object that it means, if any.

    ``pick up the red cube`` -> ``Primitive("pick_cube", "cube_red")`` and ``"cube_red"``.
    """

    motion: Primitive
    thing: str | None


class _Outcome(NamedTuple):
    """How a motion ended, ``done`` or ``missed``, and why in words if it had no effect."""

    how: EndKind
    why: str = ""


@dataclass
class _Underway:
    """The motion that is being made.

    Attributes:
        subgoal: that asked for it.
        motion: what is done.
        thing: name of the object that was meant; None for a wait.
        moves: those that are not planned yet, each (n, 8) actions.
        since: control steps of the world at its beginning.
        next_move: the move that is planned and not made yet; None if none is.
    """

    subgoal: str
    motion: Primitive
    thing: str | None
    moves: Iterator[NDArray[np.float64]]
    since: int
    next_move: NDArray[np.float64] | None = None


class ScriptedHands(AttachedPolicy):
    """Executes subgoals of RoboMME's grammar on what their words or their point select.

    Privileged: it reads the poses of all objects, but neither the goal nor the instruction.

    At any time, either no motion is under way or one is. `follow` begins one, `act` returns its
    moves one after the other, and `settle` finds its end: it is called by both, and by a planner
    before it reads `endings`. A motion that has begun is carried to its end; what is named
    meanwhile is not followed. The motion just done is not repeated until another was made, so that
    a planner may name its subgoal again. A refusal takes no control step.

    Attributes:
        endings: how each subgoal of the episode ended, in order.
    """

    cameras: tuple[str, ...] = ()
    version = SCRIPTED_HANDS
    metadata: ClassVar[Mapping[str, str]] = {"hands": "scripted"}

    def __init__(self) -> None:
        self.endings: list[SubgoalEnd] = []

    def reset(self, instruction: str, demonstration: Demonstration) -> None:  # noqa: ARG002
        """Begin an episode, without a motion; the instruction is for the planner."""
        from roboirg.simulation.expert.primitives import MotionPrimitives

        self.endings = []
        self._underway: _Underway | None = None
        self._last: _Underway | None = None  # the motion just done
        self._expert = MotionPrimitives(self._world)
        self._first_step = self._world.elapsed

    def usage(self) -> dict[str, float]:
        """Return how many subgoals were refused, and how many were tried without effect."""
        counts = Counter(end.how for end in self.endings)
        refused = counts["refused"]
        return {"refused": refused, "missed": counts.total() - counts["done"] - refused}

    def follow(self, subgoal: str) -> None:
        """Begin the motion of a subgoal, or report at once how it ended; ignored during a motion.

        A subgoal that was just done, in the same words or as the same act, is reported as ``done``
        again without a motion. One that fits no object, or several, is reported as ``refused``.
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
        """Plan the next move of the motion under way; if there is none, end it and report how.

        It does nothing without a motion, or while a planned move is still to be made.
        """
        underway = self._underway
        if underway is None or underway.next_move is not None:
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
        """Return the next move, (n, 8) actions; without a motion, actions that hold still."""
        self.settle()
        if self._underway is None or self._underway.next_move is None:
            return self._still(WAIT_STEPS)
        actions = self._underway.next_move
        self._underway.next_move = None
        return actions

    @property
    def _world(self) -> World:
        return self.env.session.world

    def _report(self, subgoal: str, outcome: _Outcome, thing: str | None = None) -> None:
        """Add how a subgoal ended to `endings`, at the present control step of the episode."""
        step = self._world.elapsed - self._first_step
        self.endings.append(SubgoalEnd(subgoal, outcome.how, outcome.why, thing, step))

    def _advance(self, underway: _Underway) -> _Outcome | None:
        """Plan the next move of a motion; return how the motion ended, or None if it goes on.

        It ends when its moves are made, when a move cannot be planned (``blocked``), or after
        `MOST_STEPS` (``time-out``); a wait may take longer.
        """
        steps = self._world.elapsed - underway.since
        if steps > MOST_STEPS and underway.motion.kind != "hold":
            return _Outcome("time-out", f"it took more than {MOST_STEPS} steps")
        try:
            underway.next_move = next(underway.moves, None)
        except MotionPlanningError as error:
            return _Outcome("blocked", str(error))
        if underway.next_move is not None:
            return None
        if self._had_effect(underway):
            return _Outcome("done")
        if underway.motion.kind in PICKS:
            return _Outcome("missed", "nothing is in the gripper")
        return _Outcome("missed", "the motion had no effect")

    def _find_motion(self, subgoal: str) -> _Meant:
        """Return the motion that a subgoal asks for, and the name of the object that it means.

        A motion that handles what is held has that as its subject, and the object as its place:
        ``place it on the target`` -> ``Primitive("place_on", "cube_red", "target")``.

        Raises:
            RefusedError: the words are not read, the hand is empty, or no single object fits.
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
        """Return the motion that presses a button, straight down if the tool hovers above it.

        `thing` is the name of the object that the subgoal means. In *press the button to stop the
        cube on the target* that may be the target; then the scene's only button is pressed.
        """
        button = thing
        if request.thing != "button":
            button = self._select(Request("press", "button"))
        is_above = Fact("hovering", ROBOT, button) in self._world.facts
        return Primitive("press_below" if is_above else "press", button)

    def _release_height(self) -> float:
        """Return the tool height, m, at which this task's expert lets go of what it puts down."""
        from roboirg.tasks.choices import choices_of

        for choice in choices_of(self.env.episode):
            motion = choice.primitives[0]
            if motion.kind == "put_down":
                return motion.height
        return Primitive("put_down", ROBOT).height

    def _select(self, request: Request) -> str:
        """Return the name of the object that a request means: by its point, or else by its words.

        Raises:
            RefusedError: nothing is near the point, or the words fit no object or several.
        """
        from roboirg.simulation.expert.things import nearest_thing, present_things

        things = present_things(self._world, (str(request.thing),))
        if request.point is None:
            return self._select_by_words(request, things)
        nearest = nearest_thing(things, request.point)
        if nearest is not None and nearest.distance <= REACH_PIXELS:
            return nearest.thing.item.name
        row, column = request.point
        raise RefusedError(
            f"no {request.thing} is within {REACH_PIXELS} pixels of <{row}, {column}>"
        )

    def _select_by_words(self, request: Request, things: Sequence[Thing]) -> str:
        """Return the name of the only one of some things that the words of a request fit.

        They may name a color, and a side: *the right-side red cube* is the red one farthest to the
        robot's right.

        Raises:
            RefusedError: they fit no object or several.
        """
        fits = [thing.item for thing in things if request.color in (None, thing.item.color)]
        if request.side is not None:
            bodies = self._world.bodies
            # y is positive to the robot's left, so this is the order from right to left.
            fits.sort(key=lambda item: bodies[item.name].position.y)
            fits = fits[:1] if request.side == "right" else fits[-1:]
        if len(fits) == 1:
            return fits[0].name
        count = f"{len(fits)} things fit" if fits else "nothing fits"
        raise RefusedError(f"{count} the words {_words_of(request)!r}; a point would say which")

    def _still(self, steps: int) -> NDArray[np.float64]:
        """Return actions (`steps`, 8) that keep the arm and the gripper as they are."""
        arm = self._world.robot.arm_positions
        return np.tile(np.append(arm, self._expert.gripper), (steps, 1))

    def _had_effect(self, underway: _Underway) -> bool:
        """Return whether a motion that was made to its end has had its effect.

        A press has it if the button was down at any time since the motion began. For other motions,
        one of the facts in `_EFFECTS` must hold now; those without any, such as waits, always have
        their effect.
        """
        motion = underway.motion
        session = self.env.session
        if motion.kind in ("press", "press_below"):
            facts_since = {
                event.fact
                for event in session.events
                if event.holds and event.step > underway.since
            }
            return Fact("pressed", motion.subject) in facts_since
        things = (motion.subject, motion.place)
        if motion.kind == "hover":
            things = (ROBOT, motion.subject)
        effects = {Fact(kind, *things) for kind in _EFFECTS.get(motion.kind, ())}
        return not effects or not effects.isdisjoint(session.world.facts)


def _words_of(request: Request) -> str:
    """Return the object of a request in words, for a refusal: ``left-side red cube``."""
    words = [request.color, request.thing]
    if request.side:
        words.insert(0, f"{request.side}-side")
    return " ".join(word for word in words if word)


def _says_the_same(subgoal: str, other: str) -> bool:
    """Return whether two subgoals mean the same: equal words, and points near each other.

    ``pick up the cube at <120, 87>`` and ``pick up the cube at <122, 90>`` do. Without a point in
    one of them, the texts must be equal.
    """
    words, point = split_point(subgoal)
    other_words, other_point = split_point(other)
    if point is None or other_point is None:
        return subgoal == other
    return words == other_words and math.dist(point, other_point) <= REACH_PIXELS


def _act_of(motion: Primitive) -> tuple[str, ...]:
    """Return what a motion does, for comparison: its kind, subject and place.

    ``press_below``, which presses from a hover, counts as ``press``.
    """
    return motion.kind.removesuffix("_below"), motion.subject, motion.place or ""
