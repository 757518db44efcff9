"""The expected success of the listeners against the listeners themselves, and by hand."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
from flat_jobs import job_of

from roboirg.evaluation.analysis.stats.chance import CHANCE, FLOORS, floor_level
from roboirg.evaluation.play.job_instruction import instruct_job
from roboirg.evaluation.records.record import Job
from roboirg.language.settings import settings_of
from roboirg.language.templates import LANGUAGE_VERSION
from roboirg.language.variants import all_variants
from roboirg.policies import make_policy
from roboirg.policies.builtin.listeners import ForgetfulPolicy
from roboirg.shortcuts import SURFACE_RULES
from roboirg.tasks import all_tasks, get_task
from roboirg.tasks.splits.splits import get_episode

DOCS = Path(__file__).parents[2] / "docs" / "statistics.md"


def job(task: str, setting: str, episode: int = 2, **fields: object) -> Job:
    usual = {"policy": "any", "split": "test", **fields}
    return job_of(task=task, setting=setting, episode=episode, **usual)


@pytest.mark.parametrize(
    ("setting", "text"),
    [
        ("direct", "direct and contextual {}"),
        ("reasoning", "reasoning {}"),
        ("spatial", "spatial {} (7 tasks)"),
    ],
)
def test_the_docs_state_the_level_of_the_test_split(setting: str, text: str) -> None:
    levels = [
        float(floor_level(CHANCE, [job(task, setting, episode) for episode in range(50)]) or 0)
        for task in all_tasks()
        if setting in settings_of(get_task(task))
    ]
    expected = text.format(f"{100 * float(np.mean(levels)):.1f}")
    assert expected in DOCS.read_text(encoding="utf-8")


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
    elsewhere = SimpleNamespace(
        episode=dataclasses.replace(episode, goal=get_task(task).goals(episode.scene)[-1]),
        instruction=instruction,
    )
    again = [make_policy(rule, seed).decide(elsewhere, instruction.text) for seed in range(15)]
    assert again == goals[:15], "the goal made a difference"


@pytest.mark.parametrize("variant", all_variants(), ids="-".join)
def test_floors_are_shares_and_only_implicit_commands_leave_something_open(variant) -> None:
    jobs = [job(*variant, episode) for episode in range(6)]
    levels = {floor: floor_level(floor, jobs, LANGUAGE_VERSION) for floor in FLOORS}
    assert all(0 <= level <= 1 for level in levels.values())
    assert 0 < levels[CHANCE] < 1
    assert variant[1] not in ("direct", "contextual") or levels["surface"] == 1


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
    assert floor_level("text-only", [short], LANGUAGE_VERSION) is None
    assert floor_level("text-only", [usual], LANGUAGE_VERSION) is not None
    assert floor_level("text-only", [usual], "0.9") is None, "never those of another version"
