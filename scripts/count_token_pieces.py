"""Write how many pieces each word of the language needs (src/roboirg/language/token_pieces.json).

Run it after a change of wording: ``python scripts/count_token_pieces.py``. It needs
`mistral-common`, whose first tokenizer is a SentencePiece vocabulary of 32,000 pieces. A test
compares the counts of whole instructions with that tokenizer's.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

from sentencepiece import SentencePieceProcessor

from roboirg.core.word_pools import POOLS
from roboirg.language.generator import find_refusal, instruct_with
from roboirg.language.token_counts import split_words
from roboirg.language.variants import expressible_options
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.atomic_write import write_atomically

TABLE = Path(__file__).parent.parent / "src/roboirg/language/token_pieces.json"
EPISODES = 400
"""Random scenes for each task; their words repeat long before the last one."""
VARIANTS = 4
"""Texts of language 4 for each of them: its scenarios and people are many."""


def tokenizer() -> SentencePieceProcessor:
    """Return the tokenizer with 32,000 pieces."""
    model = files("mistral_common").joinpath("data/tokenizer.model.v1")
    return SentencePieceProcessor(model_file=str(model))


def texts() -> Iterator[str]:
    """Yield instructions of random scenes in both pools, with all settings, forms and options."""
    for task in every_task():
        for index in range(EPISODES):
            episode = get_episode(task, "random", index)
            for options in expressible_options(episode, POOLS[index % len(POOLS)]):
                yield instruct_with(episode, options).text
                scenario = replace(options, language=4)
                if find_refusal(episode, scenario) is None:
                    for variant in range(VARIANTS):
                        yield instruct_with(episode, scenario, variant).text


def main() -> None:
    """Write the table: the words by their number of pieces."""
    encode = tokenizer().encode
    words = sorted(frozenset[str]().union(*map(split_words, texts())))
    by_count: dict[str, list[str]] = {}
    for word in words:
        # A mark is written without a space before it.
        count = len(encode(word)) if word[0].isalnum() else 1
        by_count.setdefault(str(count), []).append(word)
    write_atomically(TABLE, json.dumps(dict(sorted(by_count.items())), indent=0) + "\n")
    print(f"{len(words)} words: {TABLE}")


if __name__ == "__main__":
    main()
