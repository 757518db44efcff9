"""The part of the language card with what scenarios say, measured.

The texts are those of the published test split; what training has is that of train and val.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator, Sequence
from typing import cast

import pandas as pd
from written_parts import table

from roboirg.apps.language_lab.corpus_statistics import expression_counts, expression_order
from roboirg.apps.language_lab.scenarios.scenario_check import check_scenarios, our_scenarios
from roboirg.apps.language_lab.scenarios.sentence_rules import sentences_of
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import TRAINING_SPLITS
from roboirg.language.instruction import Instruction
from roboirg.language.places import PlaceClass
from roboirg.language.scenarios.scenario_file import pointer_table, written_words
from roboirg.language.settings import all_settings
from roboirg.language.token_counts import USUAL_LIMIT, count_tokens
from roboirg.language.variants import instructions
from roboirg.shortcuts.command_chance import goals_of_command, is_right
from roboirg.tasks.splits.splits import split_episodes

TEST = ("test",)
DASH = "–"

_PAGE = """\
## What is said, measured

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

### The paper's examples

Where its implicit expressions are said, with other nouns and numbers.

{quotations}

### Frames

How many of those written come up, each task and setting alone; contextual has those of direct.

{frames}

{missing}

### Words

Words of test that no text of training has.

{words}

### Shared between the pools

{shared}

### Places

Spatial texts by the class of the place that they name.

{places}

### Scenes that leave one goal

Scenes in which the command alone leaves one goal, so that nothing needs to be resolved.

{alone}

### Ratings and readings

[How the words are made](references.md#how-natural-the-words-are) says how natural the texts were
rated, and how often readers named the goal. Authors, raters and readers are language models."""


def scenario_part() -> str:
    """Return the part of the page, in Markdown."""
    told = _told(TEST)
    cells = told.groupby(["task", "setting"], sort=False)
    texts = cells.text.agg(lambda column: f"{len(column)} ({column.nunique()})")
    tokens = cells.tokens.agg(lambda column: f"{column.mean():.0f}, {column.max()}")
    spatial = told[told.setting == "spatial"]
    places = pd.crosstab(spatial.task, spatial.place).reindex(spatial.task.unique())
    return _PAGE.format(
        limit=USUAL_LIMIT,
        texts=_table(texts.unstack(sort=False)),
        tokens=_table(tokens.unstack(sort=False)),
        expressions=_expressions(told.said),
        quotations=_quotations(told),
        frames=_table(_frames().came_up.unstack(sort=False)),
        missing="\n".join(_missing()),
        words=_words(told),
        shared=_shared(told),
        places=_table(places),
        alone=_table(cells.alone.sum().unstack(sort=False).astype("Int64")),
    )


@functools.cache
def _told(splits: tuple[str, ...]) -> pd.DataFrame:
    """Return a row for each implicit text of some splits."""
    settings = [name for name, setting in all_settings().items() if setting.implicit]
    episodes = split_episodes([*written_words()], splits)
    rows = []
    for episode, said in instructions(episodes, settings, ["implicit"], InstructionOptions()):
        goals = goals_of_command(said, episode)
        classes = cast("list[int]", said.metadata.get("landmark_classes") or [])
        place = None
        if classes:
            place = PlaceClass(classes[0]).name.lower().replace("_", " ")
        rows.append(
            {
                "task": said.task,
                "setting": said.setting,
                "frame": said.metadata["scenario"],
                "text": said.text,
                "tokens": count_tokens(said.text),
                "alone": all(is_right(goal, episode) for goal in goals),
                "place": place,
                "said": said,
            }
        )
    return pd.DataFrame(rows)


def _expressions(said: Sequence[Instruction]) -> str:
    counts = expression_counts(said)
    settings = [name for name in all_settings() if name in counts]
    known = pd.DataFrame(counts, index=expression_order(counts), columns=settings)
    return _table(known.rename_axis("class").astype("Int64"))


def _quotations(told: pd.DataFrame) -> str:
    """Return in which tasks each expression of the paper is said."""
    tasks: dict[str, set[str]] = {}
    for pointer in pointer_table():
        if pointer.quote:
            is_said = told.text.str.contains(_spoken(pointer.words), regex=True)
            tasks.setdefault(pointer.quote, set()).update(told.task[is_said])
    said = {}
    for quote, saying in tasks.items():
        said[quote] = ", ".join(task for task in written_words() if task in saying)
    return _table(pd.DataFrame({"tasks": said}).rename_axis("example"))


def _spoken(words: str) -> str:
    """Return a pattern for what a pointer's words become in a text."""
    many = re.sub(r"\[[^|]*\|(.*?)\]", r"\1", words)
    named = many.translate(str.maketrans("", "", "<>"))
    return r"\b" + re.sub(r"\{[^}]*\}|\*", r"[a-z]+(?: [a-z]+)?", named) + r"\b"


@functools.cache
def _frames() -> pd.DataFrame:
    """Return how many frames of the test pool come up, by task and setting, and which do not."""
    said = {(row.task, row.setting, row.frame) for row in _told(TEST).itertuples()}
    rows = []
    for task, words in written_words().items():
        for scenario in words.scenarios:
            fields = scenario.fields
            row = (task, fields.setting, fields.frame)
            if fields.pool == "test":
                rows.append((*row, row in said))
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
            fits = sum(len(report.fitting) for report in reports)
            reason = f"fits {fits} of {len(scenes)} scenes, where others were drawn"
            if not fits:
                reason = f"fits none of {len(scenes)} scenes"
            yield f"- {task}, {setting}, *{frame}*: {reason}."


def _words(told: pd.DataFrame) -> str:
    """Return the vocabulary of each task, and what of it training does not have."""
    learned = _told(TRAINING_SPLITS)
    rows = {}
    for task in written_words():
        test = _vocabulary(told[told.task == task].text)
        train = _vocabulary(learned[learned.task == task].text)
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
    test = sentences_of(our_scenarios(), "test")
    train = sentences_of(our_scenarios(), "train")
    frames = {name for name in test if name.startswith("frame ")}
    sentences = test.difference(frames)
    texts = set(told.text)
    shares = {
        "frames": (len(frames), len(frames & train)),
        "sentences with their slots blanked": (len(sentences), len(sentences & train)),
        "texts": (len(texts), len(texts.intersection(_told(TRAINING_SPLITS).text))),
    }
    return _table(pd.DataFrame(shares, index=["of test", "in training, too"]).T.rename_axis("what"))


def _table(frame: pd.DataFrame) -> str:
    """Return a table in Markdown; its index has the rows' names."""
    named = frame.astype(object).fillna(DASH).reset_index()
    return table(list(named.columns), named.itertuples(index=False), list(frame.columns))
