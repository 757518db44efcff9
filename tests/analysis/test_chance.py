"""The expected success of the listeners against the listeners themselves, and by hand."""

from __future__ import annotations

from functools import partial
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


def job_without_candidates(task, setting):
    """Return a job whose context names no candidates: there the level is a guess among them."""
    jobs = (job(task, setting, index) for index in range(2, 50))
    return next(made for made in jobs if not instruct_job(made).metadata["candidates"])


@pytest.mark.parametrize(
    ("task", "setting"),
    [("PickXtimes", "spatial"), ("VideoUnmask", "direct"), ("BinFill", "reasoning")],
)
def test_it_is_what_the_forgetful_listener_comes_to(task, setting):
    """Its own decisions, with 400 seeds in one episode; only its hands are left out."""
    played = job_without_candidates(task, setting)
    episode = get_episode(task, "test", played.episode)
    env = SimpleNamespace(episode=episode, instruction=instruct_job(played))
    stages_of = partial(get_task(task).stages, episode.scene)

    rights = []
    for seed in range(400):
        goal = ForgetfulPolicy(seed=seed).decide(env, "")  # type: ignore[arg-type]
        rights.append(stages_of(goal) == stages_of(episode.goal))
    level = float(floor_level(CHANCE, [played]))

    deviation = np.sqrt(level * (1 - level) / 400)
    assert np.mean(rights) == pytest.approx(level, abs=0.01 + 3 * deviation)


@pytest.mark.parametrize(
    ("task", "setting"),
    [("PickXtimes", "direct"), ("VideoUnmask", "reasoning"), ("StopCube", "reasoning")],
)
@pytest.mark.parametrize("rule", SURFACE_RULES)
def test_floors_are_what_the_shortcut_listeners_come_to(rule, task, setting):
    """Their own decisions, with 100 seeds; a goal that the scene lacks is none."""
    played = job(task, setting, episode=3)
    episode = get_episode(task, "test", 3)
    instruction = instruct_job(played)
    env = SimpleNamespace(episode=episode, instruction=instruction)

    goals = [make_policy(rule, seed).decide(env, instruction.text) for seed in range(100)]
    level = float(floor_level(rule, [played]))

    deviation = np.sqrt(level * (1 - level) / 100)
    assert goals.count(episode.goal) / 100 == pytest.approx(level, abs=3 * deviation + 1e-9)


@pytest.mark.parametrize("task", all_tasks())
@pytest.mark.parametrize(
    ("setting", "form"),
    [("explicit", "implicit"), ("direct", "resolved"), ("contextual", "resolved")],
)
def test_commands_that_name_all_leave_nothing_to_chance(task, setting, form):
    assert floor_level(CHANCE, [job(task, setting, at, form=form) for at in range(4)]) == 1


def test_who_plays_and_how_often_makes_no_difference():
    jobs = [job("StopCube", "reasoning", episode) for episode in range(4)]
    again = [msgspec.structs.replace(made, policy="else", policy_seed=3) for made in jobs[:1]]
    assert floor_level(CHANCE, jobs + again * 5) == floor_level(CHANCE, jobs)
    assert floor_level(CHANCE, []) is None

    # Learned floors are those of the usual options, in the version that was played.
    usual = job("PickXtimes", "contextual")
    short = job("PickXtimes", "contextual", stages=(1, 5))
    assert floor_level("text-only", [short], version_of(usual)) is None
    assert floor_level("text-only", [usual], version_of(usual)) is not None
    assert floor_level("text-only", [usual], "0.9") is None, "never those of another version"
