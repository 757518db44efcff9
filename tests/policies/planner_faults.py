"""Planners with a known fault, as replies of a model to the stateless planner."""

from pathlib import Path

from planning_fakes import Late, fake_vlm

from roboirg.core.episode import Goal
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.play.rollout import EpisodeRunner
from roboirg.evaluation.records.record import Job
from roboirg.policies.by_name.finding import read_policy
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode

TASK = "PickXtimes"
NEVER = 10.0
"""Seconds: longer than the planner waits."""


def replies_of(episode, goal):
    """One line per stage of a goal, a cube being on the target once it was picked."""
    from roboirg.simulation.expert.things import origin_pixel
    from roboirg.simulation.world import World

    world = World(episode.scene, visible=False)
    placed = set()
    for stage in get_task(episode.task).stages(episode.scene, goal):
        thing = "target" if stage.points_at in placed else stage.points_at
        placed.add(stage.points_at)
        row, column = (round((one + 0.5) / 0.256) for one in origin_pixel(world.bodies[thing]))
        yield stage.subgoal.replace("{at}", f"at <{row}, {column}>")


def with_fault(fault, episode):
    """The replies of a model with a fault, or None if the episode leaves no room for it."""
    color, repeats = episode.goal.text("color"), episode.goal.number("repeats")
    others = [one.color for one in episode.scene.of_kind("cube") if one.color != color]
    if fault == "wrong thing" and not others:
        return None
    right = list(replies_of(episode, episode.goal))
    meant = {
        "wrong count": (color, repeats - 1 if repeats > 1 else repeats + 1),
        "wrong thing": (others[0] if others else color, repeats),
    }.get(fault, (color, repeats))
    other = list(replies_of(episode, Goal.of(color=meant[0], repeats=meant[1])))
    return {
        "stopped early": [*right[:2], "done"],
        "refused": ["put it into the bin"],
        "unreadable": ["la la la"],
        "went on too long": [right[0], "put it down"] * 40,
        "never": [Late(NEVER)],
        "late": [Late(1.5)],
    }.get(fault, [*other, "done"])


def record_of(fault, index):
    """The record of an episode with a planner with a fault; None if it leaves no room for it."""
    replies = with_fault(fault, get_episode(TASK, "test", index))
    if replies is None:
        return None
    with fake_vlm(replies) as server:
        seconds = 1 if fault in ("never", "late") else 60
        model = f"base_url={server.url}/v1&model=stub&timeout_s={seconds}&retries=0"
        spec = f"planner:stateless?{model}&observe_every=400"  # few pictures are drawn
        job = Job(policy=spec, ref=read_policy(spec), task=TASK, split="test", episode=index,
                  options=InstructionOptions("explicit"))  # fmt: skip
        return EpisodeRunner(Path()).play_once(job)[0]
