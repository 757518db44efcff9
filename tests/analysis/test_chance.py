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
from roboirg.runs.job_instruction import instruct_job
from roboirg.shortcuts import SURFACE_RULES
from roboirg.tasks import all_tasks, get_task
from roboirg.tasks.splits.splits import get_episode


def job_in(task, setting, episode=2, **fields):
    """Return a job of the test split; who plays it does not matter here."""
    usual = {"policy": "any", "split": "test", **fields}
    return job_of(task=task, setting=setting, episode=episode, **usual)


def language_version_of(told):
    return str(instruct_job(told).metadata["language_version"])


def job_without_candidates(task, setting):
    """Return the first job whose context names no candidates.

    Candidates are things named in the context that the command may mean. Without them the chance
    level is a guess among all goals of the scene.
    """
    for episode in range(2, 50):
        job = job_in(task, setting, episode)
        if not instruct_job(job).metadata["candidates"]:
            return job
    raise AssertionError("all contexts name candidates")


@pytest.mark.parametrize(
    ("task", "setting"),
    [("PickXtimes", "spatial"), ("VideoUnmask", "direct"), ("BinFill", "reasoning")],
)
def test_the_computed_chance_is_the_rate_of_a_policy_that_forgets_and_guesses(task, setting):
    """The forgetful listener decides 400 times with other seeds; nothing has to be simulated.

    It is right if its goal needs the same stages of the task as the true one. Would find a chance
    level computed over other goals than those it guesses among.
    """
    played = job_without_candidates(task, setting)
    episode = get_episode(task, "test", played.episode)
    env = SimpleNamespace(episode=episode, instruction=instruct_job(played))
    stages_of = partial(get_task(task).stages, episode.scene)

    rights = []
    for seed in range(400):
        goal = ForgetfulPolicy(seed=seed).decide(env, "")
        rights.append(stages_of(goal) == stages_of(episode.goal))
    level = float(floor_level(CHANCE, [played]))

    # Three standard deviations of a mean of 400.
    deviation = np.sqrt(level * (1 - level) / 400)
    assert np.mean(rights) == pytest.approx(level, abs=0.01 + 3 * deviation)


@pytest.mark.parametrize(
    ("task", "setting"),
    [("PickXtimes", "direct"), ("VideoUnmask", "reasoning"), ("StopCube", "reasoning")],
)
@pytest.mark.parametrize("rule", SURFACE_RULES)
def test_the_computed_floor_of_a_shortcut_is_the_rate_of_a_policy_that_takes_it(
    rule, task, setting
):
    """A shortcut, such as *always the color named last*, decides 100 times with other seeds."""
    played = job_in(task, setting, episode=3)
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
def test_a_command_that_names_everything_leaves_nothing_to_guess(task, setting, form):
    """Explicit commands, and the *resolved* form, in which what they refer to is named."""
    jobs = [job_in(task, setting, episode, form=form) for episode in range(4)]

    assert floor_level(CHANCE, jobs) == 1


def test_the_chance_level_does_not_depend_on_who_plays_or_how_often():
    """Five more trials of the first episode, by another policy; would find weights by trials."""
    jobs = [job_in("StopCube", "reasoning", episode) for episode in range(4)]
    again = msgspec.structs.replace(jobs[0], policy="else", policy_seed=3)

    assert floor_level(CHANCE, [*jobs, *[again] * 5]) == floor_level(CHANCE, jobs)


def test_no_jobs_have_no_chance_level():
    assert floor_level(CHANCE, []) is None


def test_a_learned_floor_is_known_for_the_usual_options_in_the_version_of_the_language_alone():
    """*text-only* learned from words of this version; other stages and versions were not learned.

    Would find a floor that belongs to other instructions.
    """
    usual = job_in("PickXtimes", "contextual")
    short = job_in("PickXtimes", "contextual", stages=(1, 5))
    version = language_version_of(usual)

    assert floor_level("text-only", [usual], version) is not None
    assert floor_level("text-only", [short], version) is None
    assert floor_level("text-only", [usual], "0.9") is None
