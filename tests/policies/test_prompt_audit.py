"""What of an instruction reaches a model that reads a limited number of tokens."""

import sys
from importlib import resources

import pytest
from checkpoint_folders import write_checkpoint

from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.policies.by_name.finding import find_policy
from roboirg.policies.lerobot.checkpoint_policy import LeRobotPolicy
from roboirg.policies.prompt_length.prompt_audit import (
    PromptLimit,
    Tokens,
    audit_instruction,
    clean_prompt,
    fewest_tokens,
    most_tokens,
)
from roboirg.policies.prompt_length.tokenizer_file import prompt_limit, read_tokenizer


def prompt_limit_of(spec):
    return prompt_limit(find_policy(spec).needs)


def two_tokens_a_word(text):
    """Return the tokens of a tokenizer that splits words in two, and adds one before and behind.

    *red cube* has six: the beginning, re, d, cu, be, and the line break behind the words.
    """
    ends = []
    start = 0
    for word in text.split(" "):
        ends.append(start + (len(word) + 1) // 2)
        ends.append(start + len(word))
        start += len(word) + 1
    return Tokens(1, tuple(ends), 1)


@pytest.mark.parametrize(
    ("tokens", "verdict", "reached"),
    [(6, "heard", 8), (5, "cut", 8), (4, "cut", 6), (3, "cut", 3), (1, "cut", 0)],
    ids=["all", "no line break", "red cu", "red", "nothing"],
)
def test_a_model_reads_as_many_characters_as_its_tokens_spell(tokens, verdict, reached):
    """*red cube* has six tokens: the beginning, re, d, cu, be, and a line break.

    With fewer, the text is heard up to a character: with four up to *red cu*, 6 characters.
    Without the line break the text is complete, but the model expects it: *cut*.
    """
    found = audit_instruction([["red cube"]], PromptLimit(tokens, 0, two_tokens_a_word))

    assert found == (6, 6, (reached,), verdict)


@pytest.mark.parametrize(
    ("tokens", "verdict", "reached"), [(11, "heard", 30), (8, "unknown", 30), (4, "cut", 16)]
)
def test_without_the_model_s_tokenizer_a_prompt_may_be_heard_or_cut_or_this_is_unknown(
    tokens, verdict, reached
):
    """Only bounds are known: these 30 characters have 8 to 11 tokens.

    With room for 11 the whole is heard; with 8 no one knows; with 4 at most 16 characters are.
    """
    limit = PromptLimit(tokens, 0, None)

    found = audit_instruction([["Put the red cube into the bin."]], limit)

    assert found == (8, 11, (reached,), verdict)


def test_tokens_that_a_model_adds_behind_the_words_make_their_fate_unknown():
    """Six tokens are those of the words; up to ten more may be added."""
    found = audit_instruction([["red cube"]], PromptLimit(6, 10, two_tokens_a_word))

    assert found == (6, 16, (8,), "unknown")


@pytest.mark.parametrize(
    ("messages", "reached", "verdict"),
    [
        ([["red"], ["cube"]], (3, 4), "heard"),
        ([["red"], ["red cube", "is it"]], (3, 6, 0), "cut"),
        ([], (), "heard"),
    ],
    ids=["two that fit", "two turns in the second", "none"],
)
def test_every_message_is_read_from_its_own_beginning(messages, reached, verdict):
    """With four tokens for each: the beginning, and three halves of words."""
    found = audit_instruction(messages, PromptLimit(4, 0, two_tokens_a_word))

    assert found.reached == reached
    assert found.verdict == verdict


TWO_TURNS = ("Look at the red cube.", "Put it into the bin.")
MENTIONS = [(0, 20), (1, 3), (1, 6), (1, 19)]
"""The turn of each mention, and where it ends in it: *… red cube*, *Put*, *it*, *the bin*."""


@pytest.mark.parametrize(
    ("tokens", "lost"), [(13, (2, 3)), (99, ())], ids=["five words and Put", "all"]
)
def test_mentions_behind_the_token_limit_of_a_prompt_are_reported_as_lost(tokens, lost):
    """13 tokens are the beginning and the halves of six words; mentions are numbered from 0."""
    found = audit_instruction([TWO_TURNS], PromptLimit(tokens, 0, two_tokens_a_word))

    assert found.lost(MENTIONS) == lost


def test_mentions_in_a_turn_that_was_not_said_yet_are_not_lost():
    found = audit_instruction([TWO_TURNS[:1]], PromptLimit(13, 0, two_tokens_a_word))

    assert found.lost(MENTIONS) == ()


def test_prompts_are_stripped_and_underscores_and_line_breaks_are_blanks():
    assert clean_prompt("  Put_the\ncube.\n") == "Put the cube."


def test_a_prompt_is_lowered_without_another_length():
    """In Python the lower case of İ has two characters, so that places would shift."""
    assert clean_prompt("Put İt", lowers=True) == "put İt"


def test_blanks_before_a_prompt_count_among_the_characters_that_are_read():
    found = audit_instruction([["   red cube"]], PromptLimit(3, 0, two_tokens_a_word))

    assert found.reached == (len("   red"),)


@pytest.fixture(scope="module")
def sentencepiece_file():
    package = pytest.importorskip("mistral_common")
    return str(resources.files(package) / "data" / "tokenizer.model.v1")


@pytest.mark.parametrize(
    "text", ["Put the red cube into the bin.", "cubes,", "third third", "Remember: green one"]
)
def test_a_sentencepiece_model_lies_between_the_bounds(sentencepiece_file, text):
    """The tokenizer of a real model (the fixture) makes no fewer tokens of a text than
    `fewest_tokens` says and no more than `most_tokens`; the last one ends with the text.
    """
    tokens = read_tokenizer(sentencepiece_file)(text)

    assert fewest_tokens(text).total <= tokens.total <= most_tokens(text).total
    assert tokens.ends[-1] == len(text)


def test_a_json_tokenizer_is_read(tmp_path):
    """A tokenizer of the library `tokenizers` makes a token of each word, and puts *[B]*, the
    beginning, before them.

    Read back from its file it gives 1 token before the words, tokens that end after 3, 7, 12 and 13
    characters (*put|the|cube|.*), and behind them 1 token for the line break that prompts get. The
    file's own truncation and padding do not count.
    """
    tokenizers = pytest.importorskip("tokenizers")
    numbers = {"[B]": 0, "put": 1, "the": 2, "cube": 3, ".": 4, "[unknown]": 5}
    model = tokenizers.models.WordLevel(numbers, unk_token="[unknown]")  # noqa: S106
    tokenizer = tokenizers.Tokenizer(model)
    tokenizer.pre_tokenizer = tokenizers.pre_tokenizers.Whitespace()
    tokenizer.post_processor = tokenizers.processors.TemplateProcessing(
        "[B] $A", None, [("[B]", 0)]
    )
    tokenizer.enable_truncation(3)
    tokenizer.enable_padding(length=20)
    path = str(tmp_path / "tokenizer.json")
    tokenizer.save(path)

    tokens = read_tokenizer(path)("put the cube.")

    assert tokens == Tokens(before=1, ends=(3, 7, 12, 13), after=1)


@pytest.mark.parametrize(
    ("name", "size", "reason"),
    [
        ("none.model", None, "is not a file"),
        ("empty.model", 0, "cannot be used as a SentencePiece model"),
        ("large.json", 2**40, r"large\.json has more than 268,435,456 bytes"),
    ],
)
def test_a_tokenizer_file_that_cannot_be_read_is_refused_with_the_reason(
    tmp_path, name, size, reason
):
    """The file has so many bytes, all of them zero (2**40 take no space on the disk), or is
    missing (None).
    """
    path = tmp_path / name
    if size is not None:
        with path.open("wb") as file:
            file.truncate(size)

    with pytest.raises(InvalidValueError, match=reason):
        read_tokenizer(str(path))


@pytest.mark.parametrize(
    ("name", "library"), [("other.model", "sentencepiece"), ("a.json", "tokenizers")]
)
def test_a_tokenizer_file_without_its_library_is_refused_with_what_to_install(
    tmp_path, monkeypatch, name, library
):
    """A file that ends in .json is of the library tokenizers, any other of sentencepiece. None in
    `sys.modules` makes the import of a library fail.
    """
    (tmp_path / name).write_text("{}")
    monkeypatch.setitem(sys.modules, library, None)

    with pytest.raises(MissingDependencyError, match=rf"needs {library}, .* installed .*tokens"):
        read_tokenizer(str(tmp_path / name))


def test_the_token_limit_of_a_remote_policy_is_read_from_its_url(sentencepiece_file):
    url = f"openpi://localhost:1?prompt_tokens=48&prompt_added=7&tokenizer={sentencepiece_file}"

    limit = prompt_limit_of(url)._replace(tokenize=None)

    assert limit == PromptLimit(48, 7, None, "tokenizer.model.v1", lowers=False)


def test_a_server_of_mme_vla_lowers_its_prompts():
    assert prompt_limit_of("mme-vla://localhost:1?prompt_tokens=64").lowers


@pytest.mark.parametrize("spec", ["openpi://localhost:1", "oracle", "lerobot://nobody/nothing"])
def test_a_policy_that_declares_no_token_limit_has_none(spec):
    assert prompt_limit_of(spec) is None


@pytest.mark.parametrize(
    ("system", "tokens"),
    [
        ("FrameS-Modul", 64),
        ("TTT-Expert", 64),
        ("pi0.5", 64),
        ("GroundSG-Gemini", 128),
        ("GroundSG-QwenVL", 128),
        ("GroundSG-oracle", 128),
        ("MemER", 128),
        ("pi0.5?policy.prompt_tokens=48", 48),
    ],
)
def test_each_system_of_the_paper_declares_its_token_limit(system, tokens):
    """Those of 128 also read a subgoal, which is added to the instruction.

    In the last row the limit is an option of the system's policy. All of them lower their prompts.
    """
    limit = prompt_limit_of(f"system:{system}")

    assert limit.tokens == tokens
    assert (limit.added > 0) == (tokens == 128)
    assert limit.lowers


def test_the_token_limit_of_a_lerobot_checkpoint_is_read_from_its_configuration(tmp_path):
    write_checkpoint(tmp_path, tokenizer_max_length=48)

    assert prompt_limit_of(f"lerobot://{tmp_path}").tokens == 48
    assert prompt_limit_of(f"lerobot://{tmp_path}?prompt_tokens=9").tokens == 9


@pytest.mark.parametrize("limit", ["many", None, 0, [48]])
def test_a_token_limit_of_a_lerobot_checkpoint_that_makes_no_sense_is_none(tmp_path, limit):
    write_checkpoint(tmp_path, tokenizer_max_length=limit)

    assert LeRobotPolicy(f"lerobot://{tmp_path}").prompt_tokens is None
