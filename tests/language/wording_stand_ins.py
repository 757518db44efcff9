"""What tests of words share: scenarios, and a clone of RoboMME's repository for the import.

A scenario is a template of texts, a little story around a command. In it, ``{color}`` stands for
the color of the goal, and ``<it color: it>`` for the word *it*, which refers back to that color.
"""

import shutil
from dataclasses import replace

import robomme_stand_in

from roboirg.apps.language_lab import robomme_import
from roboirg.apps.language_lab.scenarios.scenario_check import (
    check_scenarios,
    scenes_of,
)
from roboirg.core.episode import SUITES, Episode
from roboirg.language.scenarios import scenario_file
from roboirg.language.scenarios.scenario_file import read_task_scenarios
from roboirg.tasks import all_tasks, get_task
from roboirg.tasks.splits.published_episodes import published_episode

BIRTHDAY = """
tasks = ["PickXtimes"]
[[scenario]]
frame = "birthday"
pool = "train"
setting = "direct"
introduction = "{person} turns {repeats} today and wants to see the {color} cube."
reinforcement = "{he} keeps talking about <it color: it>."
distractors = ["The cake is at the baker's.", "I forgot the candles.", "It's so loud in here."]
competing = ["{person.2} has a {rival color} one."]
cue = "Let's surprise {him} with the cube."
say.color = ["<it color: it>"]
say.repeats = ["<each repeats: [repeats: once for that year|once for each year]>"]
"""
"""*Leo turns two today and wants to see the red cube. … Lift it … once for each year.*"""
WOBBLY = """
tasks = ["PickXtimes"]
[[scenario]]
frame = "wobbly"
pool = "train"
setting = "spatial"
introduction = "The table wobbles {place:spot}."
say.color = ["the cube <there place: there>"]
"""
"""*The table wobbles on the left. Lift the cube there …*"""


def report_on(text, task="PickXtimes", every=20):
    """Return the checker's report on the only scenario of a file, in every n-th published scene."""
    words = read_task_scenarios(text, "mine.toml")[task]
    (report,) = check_scenarios(words, None, scenes_of(task, 0)[::every])
    return report


def take_words(monkeypatch, task):
    """Take our words of a task away, as if none had been written."""
    monkeypatch.setitem(all_tasks(SUITES), task, replace(get_task(task), words=""))
    read = scenario_file.task_scenarios.__wrapped__
    monkeypatch.setattr(scenario_file, "task_scenarios", read)


def make_clone(folder):
    """A folder with the stand-in in the place of RoboMME's file."""
    place = folder / robomme_import.FILE
    place.parent.mkdir(parents=True)
    shutil.copy(robomme_stand_in.__file__, place)
    return folder


def sentence(task, goal, difficulty="hard"):
    """What the stand-in says, asked without the import."""
    stand_in = robomme_import.stand_in(goal, difficulty)
    return str(robomme_stand_in.get_language_goal(stand_in, task)[0])


def train_episodes(task, first, last):
    """Published training episodes."""
    for index in range(first, last):
        found = published_episode(task, "train", index)
        if found is not None:
            stages = get_task(task).stages(found.scene, found.goal)
            yield Episode(
                task, "train", index, found.seed, found.difficulty, found.scene, found.goal, stages
            )


def train_goals(task):
    """Every goal that the published training scenes of a task allow."""
    return frozenset(
        goal
        for episode in train_episodes(task, 0, 100)
        for goal in get_task(task).goals(episode.scene)
    )
