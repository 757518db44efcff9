"""From the frames of an experiment to the numbers, facts and pages that show it."""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from typing import cast

import pandas as pd

from experiment.measures import ABOUT, SUCCESS, measure_frame
from experiment.pages import FACTS, NUMBERS, write_pages
from experiment.rewriting import text_of
from experiment.study import Study, body_of, reader_of
from roboirg.analysis.measures.chance import floor_level
from roboirg.analysis.measures.measure import ALL_TASKS
from roboirg.analysis.published import published_rows
from roboirg.analysis.results.frame import suite
from roboirg.core.word_pools import PoolName
from roboirg.language.scenarios.identity import language_label
from roboirg.language.word_sampler import LANGUAGE_VERSION
from roboirg.records.record import Job
from roboirg.stats.rates import NOT_APPLICABLE
from roboirg.tasks import find_tasks
from roboirg.util.atomic_write import write_atomically
from roboirg.util.short_hash import short_hash
from roboirg_learn.listener.vocabulary import split_words

LOOKS = "looks.csv"
"""A line, written by hand, for each time that policies were chosen or measured on a split."""
FLOORS = {"*guess*": "command", "*no words*": "scene-only"}
"""What needs no body: a guess from the command alone, and a learner that sees only the scene."""
PUBLISHED = {
    "pi0.5": "none",
    "TTT-Expert": "ttt",
    "FrameS-Modul": "framesamp",
    "GroundSG-QwenVL": "subgoal",
    "MemER": "keyframes",
}
"""The memory of each of the paper's systems."""


def write_results(study: Study) -> None:
    """Measure all frames in the folder of results that are of the study's split; write the pages.

    The numbers are in ``numbers.csv``, the facts in ``facts.json``.
    """
    frames = [pd.read_csv(path) for path in sorted(study.results.glob("*.csv.xz"))]
    frame = pd.concat(frames)
    first_row = study.rows()[0]
    jobs = [trial.job for trial in study.trials() if trial.row == first_row]
    measures = measure_frame(frame[frame["split"] == study.split])
    numbers = pd.concat([pd.DataFrame(measures), _without_plays(jobs)]).round(6)
    numbers.to_csv(study.results / NUMBERS, index=False)
    facts = json.dumps(_facts(study, jobs), indent=1, sort_keys=True)
    write_atomically(study.results / FACTS, facts + "\n")
    write_pages(study.results)


def _without_plays(jobs: Sequence[Job]) -> pd.DataFrame:
    """Return the success of `FLOORS` in the words of jobs, and that of the paper's systems."""
    rates = []
    for row in published_rows("main"):
        about = (PUBLISHED[row.model], "published", row.options.setting)
        for task, percent in row.rates.items():
            if percent is not None:
                rates.append((task, *about, float(percent) / 100))
    by_task: defaultdict[tuple[str, str], list[Job]] = defaultdict(list)
    for job in jobs:
        by_task[job.task, job.setting].append(job)
    for (task, setting), same in by_task.items():
        for name, floor in FLOORS.items():
            level = floor_level(floor, same, LANGUAGE_VERSION)
            if level is not None:
                rates.append((task, name, NOT_APPLICABLE, setting, float(level)))
    of_tasks = pd.DataFrame(rates, columns=["task", *ABOUT[:3], "value"])
    of_all = of_tasks.assign(scope=ALL_TASKS)
    of_suites = of_tasks.assign(scope=of_tasks["task"].map(suite))
    alike = pd.concat([of_all, of_suites]).groupby(["scope", *ABOUT[:3]], sort=False)
    return alike["value"].mean().reset_index().assign(number=SUCCESS)


def _facts(study: Study, jobs: Sequence[Job]) -> dict[str, str]:
    """Return what a page of the study says besides rates."""
    label = language_label(find_tasks(study.tasks.split(",")), cast("PoolName", study.wordings))
    found = {
        "trainings of each row": str(len(study.seeds)),
        "version of the words, and digest": f"{LANGUAGE_VERSION}, `{short_hash(label)}`",
    }
    if (study.results / LOOKS).exists():
        looks = pd.read_csv(study.results / LOOKS)
        for split, times in looks.groupby("split").size().items():
            found[f"looks at `{split}`"] = str(times)
    words: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for job in jobs:
        words[job.setting].update(split_words(text_of(job)))
    for row in study.rows():
        parameters = []
        for name, net in body_of(row.body).nets.items():
            if net is not None:
                count = sum(weights.numel() for weights in net.parameters())
                parameters.append(f"{name} {count:,}")
        found[f"parameters of `{row.memory}`"] = ", ".join(parameters)
        if row.heard in study.reader_epochs:
            known = reader_of(row.reader).vocabulary.words
            found[f"unknown to the reader of `{row.heard}`, %"] = _unknown(words, known)
    return found


def _unknown(words: Mapping[str, Counter[str]], known: Sequence[str]) -> str:
    """Return how many of the words and stops of each setting are not known, in percent."""
    shares = []
    for setting, counts in words.items():
        heard = sum(counts[word] for word in known)
        shares.append(f"{setting} {100 * (1 - heard / counts.total()):.0f}")
    return ", ".join(shares)
