"""Play episodes without a simulator: methods that change facts as the world would.

Every method takes at least one control step. The judge looks on from the first moment and nothing
more happens after its verdict.
"""

from __future__ import annotations

from roboirg.core.conditions import Fact, facts_of
from roboirg.core.motions import Shuttle
from roboirg.judging import (
    Judge,
    Status,
    attribute_failure,
    changes,
)

NEAR_SHARE = 0.07
"""Of a pass, before and after its middle, in which the shuttle is near its target."""


def judged(stages, scene, *steps):
    """The judge after an evaluation of each set of facts, from step 0 on."""
    judge = Judge(stages, scene)
    for step, facts in enumerate(steps):
        judge.update(step, frozenset(facts))
    return judge


def named_facts(stages):
    """All facts that the conditions of stages name."""
    found = []
    for stage in stages:
        for condition in (stage.expects, *stage.forbids):
            found += facts_of(condition)
    return found


class Staged:
    """One episode, its demonstration already shown; the policy's turn begins."""

    def __init__(self, episode):
        self.episode = episode
        self.judge = Judge((*episode.demonstration, *episode.stages), episode.scene)
        self.events = []
        self.attempts = []
        self.tried = set()
        self.tried_before = frozenset()
        self.step = -1
        self.now = set()
        self.before = frozenset()

        self.intent = None
        kinds = {"cube": "lying", "tape": "lying", "container": "put_down"}
        for item in episode.scene.objects:
            if item.kind in kinds:
                self.now.add(Fact(kinds[item.kind], item.name))
        self.wait()
        self._show()
        self.wait()
        self.policy_start = self.step

    def _show(self):
        """Whatever the video is about; only its end matters here."""
        for stage in self.episode.demonstration:
            shown = set(self.now) | {stage.expects}
            rest = self.now
            self.now = shown
            for _ in range(stage.lasting + 1):
                self.wait()
            self.now = rest
        assert self.judge.index == len(self.episode.demonstration)

    def wait(self, steps=1):
        """Let time pass."""
        for _ in range(steps):
            if self.judge.status is not Status.ONGOING:
                break
            self.step += 1
            self._run_shuttle()
            facts = frozenset(self.now)
            self.events += changes(self.step, self.before, facts)
            self.before = facts
            tried = frozenset(self.tried)
            self.attempts += changes(self.step, self.tried_before, tried)
            self.tried_before = tried
            self.judge.update(self.step, facts)
        return self

    def until(self, step):
        """Let time pass until a step since reset."""
        return self.wait(step - self.step)

    def _run_shuttle(self):
        for run in self.episode.scene.motions:
            if not isinstance(run, Shuttle):
                continue
            if any(event.fact == Fact("pressed", "button") for event in self.events):
                continue
            near = Fact("near", run.subject, "target")
            phase = (self.step / run.interval) % 1.0
            self.now.discard(near)
            if abs(phase - 0.5) <= NEAR_SHARE and self.step < run.passes * run.interval:
                self.now.add(near)
                if run.stopped_by in self.now:
                    self.now.add(Fact("stopped", run.subject, "target"))

    def change(self, *begun, ended=()):
        """Facts begin and cease to hold, and it is a step later."""
        self.now = (self.now - set(ended)) | set(begun)
        return self.wait()

    def attempt(self, *facts, steps=1):
        """Facts of attempts hold for some steps, and then no longer."""
        self.tried |= set(facts)
        self.wait(steps)
        self.tried -= set(facts)
        return self.wait()

    def rest(self, steps=250):
        """The hand stays where it is."""
        self.wait(60).tried.add(Fact("lingering", "robot"))
        return self.wait(steps)

    def reach(self, name):
        return self.change(Fact("reached", name))

    def miss(self, name):
        """The fingers close on nothing next to it and the hand goes away."""
        return self.attempt(Fact("clutched", name)).wait(5)

    def lift(self, name):
        gone = tuple(f for f in self.now if f.subject == name and f.kind in RESTING)
        self.reach(name).change(Fact("held", name), ended=gone)
        return self.wait(3).change(self._up(name))

    def _up(self, name):
        kind = self.episode.scene[name].kind
        return Fact("lifted" if kind == "container" else "picked", name)

    def put(self, name, place=None):
        """Lower it, let go, and take the hand away."""
        rest = "put_down" if self.episode.scene[name].kind == "container" else "lying"
        self.change(ended=(self._up(name),)).wait(3)
        there = () if place is None else (Fact("placed", name, place),)
        self.change(Fact(rest, name), *there, ended=(Fact("held", name),))
        return self.change(ended=(Fact("reached", name),))

    def fill(self, name, place):
        """Let it fall in; in a bin it is gone at once."""
        self.change(ended=(self._up(name), Fact("held", name), Fact("reached", name))).wait(2)
        return self.change(Fact("binned", name, place))

    def carry(self, name, place):
        """Bring it over a place from afar, and away again."""
        over = Fact("over", name, place)
        return self.wait(20).change(over).wait(3).change(ended=(over,))

    def press(self, name="button"):
        hover = Fact("hovering", "robot", name)
        down = Fact("pressed", name)
        return self.change(hover).change(down).wait(2).change(ended=(down,)).change(ended=(hover,))

    def hover(self, name="button"):
        return self.change(Fact("hovering", "robot", name))

    def do(self, stage, instead=None):
        """A stage of a plan as the oracle does it, with some names taken for others."""
        kind, subject, place, steps, _ = stage.primitive
        swap = instead or {}
        subject = swap.get(subject, subject)
        place = swap.get(str(place), str(place))
        match kind:
            case "pick_cube" | "pick_container":
                self.lift(subject)
            case "place_on":
                self.put(subject, place)
            case "drop_into" | "put_into":
                self.fill(subject, place)
            case "move_over":
                self.carry(subject, place)
            case "put_down":
                self.put(subject)
            case "press":
                self.press(subject)
            case "press_below":
                self.until(steps - 1).press(subject)
            case "hover":
                self.hover(subject)
            case "hold_until":
                self.until(steps)
            case _:
                self.wait(steps + 2)
        return self.wait()

    def perform(self, stages):
        for stage in stages:
            self.do(stage)
        return self

    def finding(self, *, timed_out=True, cause=None):
        """What is said of it if time is up now, unless there is a verdict."""
        ongoing = self.judge.status is Status.ONGOING
        return attribute_failure(
            self.episode,
            self.events,
            timed_out=ongoing and timed_out,
            policy_start_step=self.policy_start,
            elapsed_steps=self.step,
            cause=self.judge.cause or cause,
            attempts=self.attempts,
            intent=self.intent,
        )


RESTING = ("lying", "put_down", "placed")
