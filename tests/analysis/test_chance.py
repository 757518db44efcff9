"""The expected success of the listeners against the listeners themselves, and by hand."""

from __future__ import annotations

from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
from flat_jobs import job_of

from roboirg.analysis.measures.chance import CHANCE, floor_level
from roboirg.policies import make_policy
from roboirg.policies.builtin.listeners import ForgetfulPolicy
from roboirg.records.record import Job
from roboirg.runs.job_instruction import instruct_job
from roboirg.shortcuts import SURFACE_RULES
from roboirg.tasks import all_tasks, get_task
from roboirg.tasks.splits.splits import get_episode


def job(task: str, setting: str, episode: int = 2, **fields: object) -> Job:
    usual = {"policy": "any", "split": "test", **fields}
    return job_of(task=task, setting=setting, episode=episode, **usual)


def version_of(told: Job) -> str:
    return str(instruct_job(told).metadata["language_version"])


@pytest.mark.parametrize(
    ("task", "setting"),
    [("PickXtimes", "spatial"), ("VideoUnmask", "direct"), ("BinFill", "reasoning")],
)
def test_it_is_what_the_forgetful_listener_comes_to(task: str, setting: str) -> None:
    """Its own decisions, with 400 seeds in one episode; only its hands are left out."""
    # Where the context names the candidates, the level is a guess among them.
    played = next(
        one
        for one in (job(task, setting, index) for index in range(2, 50))
        if not instruct_job(one).metadata["candidates"]
    )
    episode = get_episode(task, "test", played.episode)
    env = SimpleNamespace(episode=episode, instruction=instruct_job(played))
    wanted = get_task(task).stages(episode.scene, episode.goal)
    right = [
        get_task(task).stages(episode.scene, ForgetfulPolicy(seed=seed).decide(env, "")) == wanted  # type: ignore[arg-type]
        for seed in range(400)
    ]
    level = float(floor_level(CHANCE, [played]))
    assert np.mean(right) == pytest.approx(level, abs=0.01 + 3 * np.sqrt(level * (1 - level) / 400))


@pytest.mark.parametrize(
    ("task", "setting"),
    [("PickXtimes", "direct"), ("VideoUnmask", "reasoning"), ("StopCube", "reasoning")],
)
@pytest.mark.parametrize("rule", SURFACE_RULES)
def test_floors_are_what_the_shortcut_listeners_come_to(rule: str, task: str, setting: str) -> None:
    """Their own decisions, with 100 seeds; a goal that the scene lacks is none."""
    played = job(task, setting, episode=3)
    episode, instruction = get_episode(task, "test", 3), instruct_job(played)
    env = SimpleNamespace(episode=episode, instruction=instruction)
    goals = [make_policy(rule, seed).decide(env, instruction.text) for seed in range(100)]
    level = float(floor_level(rule, [played]))
    assert np.mean([goal == episode.goal for goal in goals]) == pytest.approx(
        level, abs=3 * np.sqrt(level * (1 - level) / 100) + 1e-9
    )


@pytest.mark.parametrize("task", all_tasks())
@pytest.mark.parametrize(
    ("setting", "form"),
    [("explicit", "implicit"), ("direct", "resolved"), ("contextual", "resolved")],
)
def test_commands_that_name_all_leave_nothing_to_chance(task: str, setting: str, form: str) -> None:
    assert floor_level(CHANCE, [job(task, setting, at, form=form) for at in range(4)]) == 1


def test_who_plays_and_how_often_makes_no_difference() -> None:
    jobs = [job("StopCube", "reasoning", episode) for episode in range(4)]
    again = [msgspec.structs.replace(one, policy="else", policy_seed=3) for one in jobs[:1]]
    assert floor_level(CHANCE, jobs + again * 5) == floor_level(CHANCE, jobs)
    assert floor_level(CHANCE, []) is None
    # Learned floors are those of the usual options, in the version that was played.
    usual, short = job("PickXtimes", "contextual"), job("PickXtimes", "contextual", stages=(1, 5))
    assert floor_level("text-only", [short], version_of(usual)) is None
    assert floor_level("text-only", [usual], version_of(usual)) is not None
    assert floor_level("text-only", [usual], "0.9") is None, "never those of another version"
