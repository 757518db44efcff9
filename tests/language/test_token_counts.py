"""Instructions are short enough for policies, which cut a text after some number of tokens."""

import dataclasses
import itertools
from importlib.resources import files

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from language_variants import expressible_options
from sentencepiece import SentencePieceProcessor

from roboirg.core.word_pools import POOLS
from roboirg.language import FORMS, instruct, instruct_with, plain_settings
from roboirg.language.token_counts import ADDED_TOKENS, count_tokens
from roboirg.language.variants import instructions
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode, split_episodes

ascii_texts = st.text(st.characters(codec="ascii", categories=("L", "P", "Zs")), max_size=60)


@pytest.fixture(scope="module")
def tokenizer():
    """A tokenizer that splits texts finely, so that policies count no more tokens than it does."""
    model = files("mistral_common").joinpath("data/tokenizer.model.v1")
    return SentencePieceProcessor(model_file=str(model))


def test_the_tokenizer_that_counts_has_a_small_vocabulary(tokenizer):
    """Those of the compared policies have 49,000 to 257,000 pieces, and so need fewer of them."""
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
@given(text=ascii_texts)
def test_our_token_count_of_any_text_is_never_too_low(tokenizer, text):
    """A policy cuts what is too long, so a count that is too high is safe."""
    single_spaced = " ".join(text.split())  # as policies read it
    exact = len(tokenizer.encode(single_spaced)) + ADDED_TOKENS
    assert count_tokens(single_spaced) >= exact


@pytest.mark.slow
def test_all_default_instructions_fit_into_64_tokens(tokenizer):
    """Of every second published episode, in all usual settings and both forms."""
    texts = {}
    for task in every_task():
        episodes = itertools.islice(split_episodes([task], ["train", "val", "test"]), 1, None, 2)
        for _, said in instructions(episodes, plain_settings(), FORMS):
            texts[said.text] = None

    encoded = tokenizer.encode(list(texts))

    counts = [len(pieces) + ADDED_TOKENS for pieces in encoded]
    assert [count_tokens(text) for text in texts] == counts
    assert max(counts) <= 64


@pytest.mark.parametrize("setting", ["explicit", "direct", "reasoning"])
def test_95_percent_of_the_simple_instructions_fit_into_48_tokens(setting):
    """Of every seventh published episode of all tasks."""
    counts = []
    for task in every_task():
        episodes = split_episodes([task], ["train", "val", "test"])
        for episode in itertools.islice(episodes, 0, None, 7):
            counts.append(count_tokens(instruct(episode, setting).text))

    fitting = [count for count in counts if count <= 48]
    assert len(fitting) >= 0.95 * len(counts)
