"""Planners with a known fault, as replies of a model to the stateless planner."""

import json
import time

from planning_fakes import Late, fake_vlm

from roboirg.core.episode import Goal
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.play.rollout import play_episode
from roboirg.evaluation.play.rollout_result import make_record
from roboirg.evaluation.records.record import Job
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
    goal = episode.goal
    color, repeats = goal.text("color"), goal.number("repeats")
    right = list(replies_of(episode, goal))
    others = [one.color for one in episode.scene.of_kind("cube") if one.color != color]
    match fault:
        case "none":
            return [*right, "done"]
        case "wrong count":
            other = repeats - 1 if repeats > 1 else repeats + 1
            return [*replies_of(episode, Goal.of(color=color, repeats=other)), "done"]
        case "stopped early":
            return [*right[:2], "done"]
        case "wrong thing":
            wrong = Goal.of(color=others[0], repeats=repeats) if others else None
            return wrong and [*replies_of(episode, wrong), "done"]
        case "refused":
            return ["put it into the bin"]
        case "unreadable":
            return ["la la la"]
        case "went on too long":
            return [one for _ in range(40) for one in (right[0], "put it down")]
        case "never":
            return [Late(NEVER)]
        case "late":
            return [Late(1.5)]
    raise ValueError(fault)


def record_of(fault, index):
    """The record of an episode with a planner with a fault; None if it leaves no room for it."""
    replies = with_fault(fault, get_episode(TASK, "test", index))
    if replies is None:
        return None
    with fake_vlm(replies) as server:
        spec = f"planner:stateless?base_url={server.url}/v1&timeout_s=1&retries=0&model=stub"
        job = Job(policy=spec, task=TASK, split="test", episode=index,
                  options=InstructionOptions("explicit"))  # fmt: skip
        return make_record(job, play_episode(job), started_at=time.strftime("%FT%TZ"))


def replies_from(path):
    """The replies in a file, one JSON text a line: a stub server that answers from a file."""
    return [json.loads(line) for line in path.read_text().splitlines()]
