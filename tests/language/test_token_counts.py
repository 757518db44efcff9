"""Instructions are short enough to be heard."""

import dataclasses
import itertools
from importlib.resources import files

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sentencepiece import SentencePieceProcessor

from roboirg.core.word_pools import POOLS
from roboirg.language import FORMS, instruct, instruct_with, plain_settings
from roboirg.language.token_counts import ADDED_TOKENS, SHORT_LIMIT, USUAL_LIMIT, count_tokens
from roboirg.language.variants import expressible_options, instructions
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import SPLITS, get_episode, split_episodes

FIXED = tuple(split for split in SPLITS if split != "random")


@pytest.fixture(scope="module")
def tokenizer():
    model = files("mistral_common").joinpath("data/tokenizer.model.v1")
    return SentencePieceProcessor(model_file=str(model))


def test_the_tokenizer_that_counts_has_a_small_vocabulary(tokenizer):
    # Those of the compared systems have 49,000 to 257,000 pieces, and so need fewer of them.
    assert tokenizer.vocab_size() <= 32_000


@pytest.mark.parametrize("task", every_task())
def test_our_token_count_agrees_with_the_tokenizer_for_every_option(tokenizer, task):
    """The package counts tokens without a tokenizer, from a table of words."""
    for index in range(3):
        episode = get_episode(task, "random", index)
        for options in expressible_options(episode, POOLS[index % 2]):
            text = instruct_with(episode, dataclasses.replace(options, distractors=5)).text
            assert count_tokens(text) == len(tokenizer.encode(text)) + ADDED_TOKENS, text


@settings(max_examples=40)
@given(text=st.text(st.characters(codec="ascii", categories=("L", "P", "Zs")), max_size=60))
def test_our_token_count_of_any_text_is_never_too_low(tokenizer, text):
    """A policy cuts what is too long, so too high is safe."""
    text = " ".join(text.split())  # as policies do
    assert count_tokens(text) >= len(tokenizer.encode(text)) + ADDED_TOKENS


def every_second(task):
    return itertools.islice(split_episodes((task,), FIXED), 1, None, 2)


@pytest.mark.slow
def test_all_default_instructions_fit_into_64_tokens(tokenizer):
    said = [
        instruction
        for task in every_task()
        for _, instruction in instructions(every_second(task), plain_settings(), FORMS)
    ]
    texts = list(dict.fromkeys(instruction.text for instruction in said))

    counts = [len(pieces) + ADDED_TOKENS for pieces in tokenizer.encode(texts)]

    assert [count_tokens(text) for text in texts] == counts
    assert max(counts) <= USUAL_LIMIT


@pytest.mark.parametrize("setting", ["explicit", "direct", "reasoning"])
def test_95_percent_of_the_simple_instructions_fit_into_48_tokens(setting):
    counts = [
        count_tokens(instruct(episode, setting).text)
        for task in every_task()
        for episode in itertools.islice(split_episodes((task,), FIXED), 0, None, 7)
    ]
    assert sum(count <= SHORT_LIMIT for count in counts) >= 0.95 * len(counts)
