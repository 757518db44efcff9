"""The part of the language card about language 4: what its scenarios say, measured.

The texts are those of the published test split; what training has is that of train and val.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator, Sequence
from typing import cast

import pandas as pd

from roboirg.apps.language_lab.corpus_statistics import expression_counts, expression_order
from roboirg.apps.language_lab.scenarios.scenario_check import check_scenarios, our_scenarios
from roboirg.apps.language_lab.scenarios.sentence_rules import blanked
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import TRAINING_SPLITS, PoolName
from roboirg.language.instruction import Instruction
from roboirg.language.places import PlaceClass
from roboirg.language.scenarios.scenario import Scenario
from roboirg.language.scenarios.scenario_file import written_words
from roboirg.language.settings import all_settings
from roboirg.language.templates import LANGUAGE_VERSIONS
from roboirg.language.token_counts import USUAL_LIMIT, count_tokens
from roboirg.language.variants import instructions
from roboirg.shortcuts.command_chance import goals_of_command, is_right
from roboirg.tasks.splits.splits import split_episodes

LANGUAGE = 4
TEST, TRAIN = ("test",), TRAINING_SPLITS
DASH = "–"

_PAGE = """\
## Language 4

Version {version}, whole [scenarios](add-scenario.md), of {tasks}.
Texts are the implicit ones of the published test split; those of training are of train and val.

### Texts

How many there are, and in parentheses how many different ones.

{texts}

### Length

Tokens, on average and in the longest text; {limit} are heard.

{tokens}

### Expressions

Scenes with each class.

{expressions}

### Frames

How many of those written come up, each task and setting alone; contextual has those of direct.

{frames}

{missing}

### Words

Words of test that no text of training has.

{words}

### Shared between the pools

{shared}

### Landmarks

Spatial texts, and how many of them have a landmark that no one says, where a scene has no other.

{landmarks}

### Scenes that leave one goal

Scenes in which the command alone leaves one goal, so that nothing needs to be resolved.

{alone}

### Ratings and readings

[Validity](validity.md#what-language-4-shows-so-far) says how natural the texts were rated, and how
often readers named the goal. Authors, raters and readers are language models."""


def scenario_part() -> str:
    """Return the part of the page, in Markdown."""
    told = _told(TEST)
    cells = told.groupby(["task", "setting"], sort=False)
    texts = cells.text.agg(lambda column: f"{len(column)} ({column.nunique()})")
    tokens = cells.tokens.agg(lambda column: f"{column.mean():.0f}, {column.max()}")
    spatial = told[told.setting == "spatial"].groupby("task", sort=False)
    return _PAGE.format(
        version=LANGUAGE_VERSIONS[LANGUAGE],
        tasks=", ".join(written_words()),
        limit=USUAL_LIMIT,
        texts=_table(texts.unstack(sort=False)),
        tokens=_table(tokens.unstack(sort=False)),
        expressions=_expressions(told.said),
        frames=_table(_frames().came_up.unstack(sort=False)),
        missing="\n".join(_missing()),
        words=_words(told),
        shared=_shared(told),
        landmarks=_table(spatial.unusual.agg(texts="size", unusual="sum")),
        alone=_table(cells.alone.sum().unstack(sort=False).astype("Int64")),
    )


@functools.cache
def _told(splits: tuple[str, ...]) -> pd.DataFrame:
    """Return a row for each implicit text of some splits."""
    settings = [name for name, setting in all_settings().items() if setting.implicit]
    options = InstructionOptions(language=LANGUAGE)
    rows = []
    for episode, said in instructions(
        split_episodes([*written_words()], splits), settings, ["implicit"], options
    ):
        goals = goals_of_command(said, episode)
        classes = cast("list[int]", said.metadata.get("landmark_classes") or [])
        rows.append(
            {
                "task": said.task,
                "setting": said.setting,
                "frame": said.metadata["scenario"],
                "text": said.text,
                "tokens": count_tokens(said.text),
                "alone": all(is_right(goal, episode) for goal in goals),
                "unusual": int(PlaceClass.UNUSUAL) in classes,
                "said": said,
            }
        )
    return pd.DataFrame(rows)


def _expressions(said: Sequence[Instruction]) -> str:
    counts = expression_counts(said)
    settings = [name for name in all_settings() if name in counts]
    known = pd.DataFrame(counts, index=expression_order(counts), columns=settings)
    return _table(known.rename_axis("class").astype("Int64"))


def _scenarios() -> Iterator[tuple[str, Scenario]]:
    """Yield the scenarios of the test pool, with their tasks."""
    for task, words in written_words().items():
        for scenario in words.scenarios:
            if scenario.fields.pool == "test":
                yield task, scenario


@functools.cache
def _frames() -> pd.DataFrame:
    """Return how many frames of a task and setting come up, and which do not."""
    said = {(row.task, row.setting, row.frame) for row in _told(TEST).itertuples()}
    rows = []
    for task, scenario in _scenarios():
        fields = scenario.fields
        is_said = (task, fields.setting, fields.frame) in said
        rows.append((task, fields.setting, fields.frame, is_said))
    found = pd.DataFrame(rows, columns=["task", "setting", "frame", "is_said"])
    cells = found.groupby(["task", "setting"], sort=False)
    came_up = cells.is_said.agg(lambda column: f"{column.sum()} of {len(column)}")
    missing = cells.apply(lambda rows: list(rows.frame[~rows.is_said]), include_groups=False)
    return pd.DataFrame({"came_up": came_up, "missing": missing})


def _missing() -> Iterator[str]:
    """Yield the frames that do not come up, each with the reason."""
    for (task, setting), frames in _frames().missing.items():
        for frame in frames:
            scenes = list(split_episodes([task], TEST))
            reports = check_scenarios(written_words()[task], frame, scenes)
            fits = sum(report.scenes for report in reports)
            reason = f"fits {fits} of {len(scenes)} scenes, where others were drawn"
            if not fits:
                reason = f"fits none of {len(scenes)} scenes"
            yield f"- {task}, {setting}, *{frame}*: {reason}."


def _words(told: pd.DataFrame) -> str:
    """Return the vocabulary of each task, and what of it training does not have."""
    learned = _told(TRAIN)
    rows = {}
    for task in written_words():
        test, train = (_vocabulary(part[part.task == task].text) for part in (told, learned))
        new = sorted(set(test) - set(train))
        rows[task] = {
            "words": test.nunique(),
            "new words": len(new),
            "of all that is said": f"{100 * test.isin(new).mean():.0f} %",
        }
    return _table(pd.DataFrame(rows).T.rename_axis("task"))


def _vocabulary(texts: pd.Series[str]) -> pd.Series[str]:
    return pd.Series(re.findall(r"[a-z']+", " ".join(texts).lower()))


def _shared(told: pd.DataFrame) -> str:
    """Return how many frames, blanked sentences and texts are in both pools, over all tasks."""
    test, train = _sentences("test"), _sentences("train")
    frames = [name for name in test if name.startswith("frame ")]
    texts, known = set(told.text), set(_told(TRAIN).text)
    shares = {
        "frames": (len(frames), len(train.intersection(frames))),
        "sentences with their slots blanked": (
            len(test) - len(frames),
            len(train.intersection(test.difference(frames))),
        ),
        "texts": (len(texts), len(texts & known)),
    }
    return _table(pd.DataFrame(shares, index=["of test", "in training, too"]).T.rename_axis("what"))


def _sentences(pool: PoolName) -> set[str]:
    found: set[str] = set()
    for scenario in our_scenarios():
        if scenario.fields.pool == pool:
            found.update(blanked(scenario))
    return found


def _table(frame: pd.DataFrame) -> str:
    """Return a table in Markdown; its index has the rows' names."""
    lines = [
        f"| {frame.index.name} | {' | '.join(map(str, frame.columns))} |",
        f"| --- {'| ---: ' * len(frame.columns)}|",
    ]
    for row in frame.itertuples():
        name, *cells = [DASH if pd.isna(cell) else str(cell) for cell in row]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)
