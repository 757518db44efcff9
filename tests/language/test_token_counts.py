"""Instructions are short enough to be heard."""

import dataclasses
from importlib.resources import files

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sentencepiece import SentencePieceProcessor

from roboirg.core.word_pools import POOLS
from roboirg.language import FORMS, instruct_with, plain_settings
from roboirg.language.token_counts import ADDED_TOKENS, SHORT_LIMIT, USUAL_LIMIT, count_tokens
from roboirg.language.variants import expressible_options, instructions
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import SPLITS, get_episode, split_episodes

FIXED = tuple(split for split in SPLITS if split != "random")
LONG = {("BinFill/train/27", "resolved"), ("BinFill/train/79", "resolved")}
"""In two crowded scenes the resolved command repeats long places; the command is not cut."""


@pytest.fixture(scope="module")
def tokenizer():
    model = files("mistral_common").joinpath("data/tokenizer.model.v1")
    return SentencePieceProcessor(model_file=str(model))


@pytest.fixture(scope="module")
def said():
    """Every default instruction of the splits."""
    return [
        instruction
        for task in every_task()
        for _, instruction in instructions(split_episodes((task,), FIXED), plain_settings(), FORMS)
    ]


def test_the_vocabulary_is_small(tokenizer):
    # Those of the compared systems have 49,000 to 257,000 pieces, and so need fewer of them.
    assert tokenizer.vocab_size() <= 32_000


@pytest.mark.slow
def test_the_count_is_that_of_the_tokenizer(tokenizer, said):
    texts = list(dict.fromkeys(instruction.text for instruction in said))
    counts = [len(pieces) + ADDED_TOKENS for pieces in tokenizer.encode(texts)]
    wrong = [text for text, count in zip(texts, counts, strict=True) if count_tokens(text) != count]
    assert wrong == []


@pytest.mark.parametrize("task", every_task())
def test_so_it_is_with_all_options(tokenizer, task):
    for index in range(6):
        episode = get_episode(task, "random", index)
        for options in expressible_options(episode, POOLS[index % 2]):
            text = instruct_with(episode, dataclasses.replace(options, distractors=5)).text
            assert count_tokens(text) == len(tokenizer.encode(text)) + ADDED_TOKENS, text


@given(text=st.text(st.characters(codec="ascii", categories=("L", "P", "Zs")), max_size=60))
def test_other_words_are_not_counted_too_low(tokenizer, text):
    text = " ".join(text.split())  # as policies do
    assert count_tokens(text) >= len(tokenizer.encode(text)) + ADDED_TOKENS


@pytest.mark.slow
def test_every_instruction_is_heard_by_a_policy_that_reads_64_tokens(said):
    long = {
        (instruction.episode, instruction.form)
        for instruction in said
        if count_tokens(instruction.text) > USUAL_LIMIT
    }
    assert long == LONG


@pytest.mark.parametrize("setting", ["explicit", "direct", "reasoning"])
@pytest.mark.parametrize("split", FIXED)
def test_nearly_every_simple_one_is_heard_by_a_policy_that_reads_48(said, setting, split):
    counts = [
        count_tokens(instruction.text)
        for instruction in said
        if instruction.setting == setting
        and instruction.form == "implicit"
        and f"/{split}/" in instruction.episode
    ]
    assert sum(count <= SHORT_LIMIT for count in counts) >= 0.95 * len(counts)
