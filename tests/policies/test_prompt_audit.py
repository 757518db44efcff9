"""What of an instruction reaches a model that reads a limited number of tokens."""

import sys
from importlib import resources

import pytest
from checkpoint_folders import write_checkpoint
from hypothesis import given, settings
from hypothesis import strategies as st

from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.language.token_counts import count_tokens
from roboirg.policies.by_name.finding import find_policy
from roboirg.policies.lerobot.checkpoint_policy import LeRobotPolicy
from roboirg.policies.planners.systems import all_systems
from roboirg.policies.prompt_length.prompt_audit import (
    PromptLimit,
    Tokens,
    audit_instruction,
    clean_prompt,
    fewest_tokens,
    most_tokens,
)
from roboirg.policies.prompt_length.tokenizer_file import prompt_limit, read_tokenizer

WORDS = ["Put", "the", "red", "cube", "into", "bin.", "Remember:", "green_one", "Zürich", "quokka"]
SOME_TEXTS = st.lists(st.sampled_from(WORDS), min_size=1, max_size=30).map(" ".join)
LIMITS = st.integers(1, 80)


def prompt_limit_of(spec):
    return prompt_limit(find_policy(spec).needs)


def two_tokens_a_word(text):
    """A tokenizer that splits every word in two."""
    ends = []
    place = 0
    for word in text.split(" "):
        ends += [place + (len(word) + 1) // 2, place + len(word)] if len(word) > 1 else []
        ends += [place + 1] if len(word) == 1 else []
        place += len(word) + 1
    return Tokens(1, tuple(ends), 1)


TOKENIZERS = st.sampled_from([None, two_tokens_a_word, most_tokens, fewest_tokens])


def audit_and_reach(text, limit):
    """Audit of one message, and how many of its characters arrive."""
    found = audit_instruction([[text]], limit)
    return found, found.reached[0]


@settings(max_examples=30)
@given(SOME_TEXTS, LIMITS, st.integers(0, 30), TOKENIZERS)
def test_a_prompt_is_heard_if_its_most_tokens_fit_and_cut_if_its_fewest_do_not(
    text, tokens, added, tokenize
):
    """Without the model's tokenizer only bounds are known, and between them nothing is certain."""
    found, reached = audit_and_reach(text, PromptLimit(tokens, added, tokenize))
    assert 0 < found.least <= found.most
    assert (found.verdict == "heard") == (found.most <= tokens)
    assert (found.verdict == "cut") == (found.least > tokens)
    assert reached == len(text) or found.verdict != "heard"


@settings(max_examples=30)
@given(SOME_TEXTS, LIMITS)
def test_what_is_read_is_the_prefix_that_its_tokens_spell(text, tokens):
    found, reached = audit_and_reach(text, PromptLimit(tokens, 0, two_tokens_a_word))
    spelled = two_tokens_a_word(clean_prompt(text))

    assert found.least == found.most == spelled.total
    # The line break behind the words may be all that is lost.
    assert reached == max(spelled.ends[: max(tokens - 1, 0)], default=0)


@settings(max_examples=30)
@given(st.lists(st.lists(SOME_TEXTS, min_size=1, max_size=4), max_size=4), LIMITS, TOKENIZERS)
def test_every_message_is_read_from_its_own_beginning(messages, tokens, tokenize):
    limit = PromptLimit(tokens, 0, tokenize)
    texts = [" ".join(turns) for turns in messages]
    alone = [audit_and_reach(text, limit) for text in texts]
    verdicts = [share.verdict for share, _ in alone]

    found = audit_instruction(messages, limit)

    assert found.most == max((share.most for share, _ in alone), default=0)
    assert (found.verdict == "heard") == all(verdict == "heard" for verdict in verdicts)
    assert (found.verdict == "cut") == ("cut" in verdicts)
    heard = list(found.reached)
    for turns, text, (_, reached) in zip(messages, texts, alone, strict=True):
        parts = [turn[: heard.pop(0)] for turn in turns]
        assert " ".join(parts).rstrip() == text[:reached].rstrip()
    assert not heard


def test_mentions_behind_the_token_limit_of_a_prompt_are_reported_as_lost():
    """A mention is a span (turn, end); "halves" counts two tokens a word."""
    turns = ("Look at the red cube.", "Put it into the bin.")
    limit = PromptLimit(1 + 2 * 6, 0, two_tokens_a_word)  # the beginning, five words and "Put"
    found = audit_instruction([turns], limit)
    assert found.reached == (21, 3)  # characters: all of the first turn, and "Put"

    spans = [(0, 20), (1, 3), (1, 6), (1, 19)]  # turn, and where the mention ends in it
    assert found.lost(spans) == (2, 3)
    assert audit_instruction([turns], limit._replace(tokens=99)).lost(spans) == ()
    # The second is not said yet: it is not lost.
    assert audit_instruction([turns[:1]], limit).lost(spans) == ()


def test_prompts_are_stripped_and_underscores_and_line_breaks_are_blanks():
    assert clean_prompt("  Put_the\ncube.\n") == "Put the cube."
    assert clean_prompt("Put İt", lowers=True) == "put İt"
    assert audit_and_reach("   red cube", PromptLimit(3, 0, two_tokens_a_word))[1] == 3 + len("red")


def test_tokens_that_a_model_adds_behind_the_words_make_their_fate_unknown():
    assert audit_and_reach("red cube", PromptLimit(6, 0, two_tokens_a_word))[0].verdict == "heard"
    crowded = audit_instruction([["red cube"]], PromptLimit(6, 10, two_tokens_a_word))
    assert crowded == (6, 16, (len("red cube"),), "unknown")


@settings(max_examples=30)
@given(SOME_TEXTS)
def test_the_upper_bound_of_tokens_is_our_own_count_of_instructions(text):
    ascii_text = clean_prompt(text.replace("ü", "u"))
    assert most_tokens(ascii_text).total == count_tokens(ascii_text)
    assert fewest_tokens(ascii_text).total <= count_tokens(ascii_text)


@pytest.fixture(scope="module")
def sentencepiece_file():
    package = pytest.importorskip("mistral_common")
    return str(resources.files(package) / "data" / "tokenizer.model.v1")


@settings(max_examples=30)
@given(st.lists(st.sampled_from([*WORDS[:6], "cubes,", "third"]), min_size=1).map(" ".join))
def test_a_sentencepiece_model_lies_between_the_bounds(sentencepiece_file, text):
    tokens = read_tokenizer(sentencepiece_file)(text)
    assert fewest_tokens(text).total <= tokens.total <= most_tokens(text).total
    assert tokens.ends[-1] == len(text)


def test_a_json_tokenizer_is_read(tmp_path):
    tokenizers = pytest.importorskip("tokenizers")
    words = {word: number for number, word in enumerate(["[B]", "put", "the", "cube", ".", "[U]"])}
    model = tokenizers.Tokenizer(tokenizers.models.WordLevel(words, unk_token="[U]"))  # noqa: S106
    model.pre_tokenizer = tokenizers.pre_tokenizers.Whitespace()
    model.post_processor = tokenizers.processors.TemplateProcessing("[B] $A", None, [("[B]", 0)])
    model.enable_truncation(3)
    model.enable_padding(length=20)
    path = tmp_path / "tokenizer.json"

    model.save(str(path))

    assert read_tokenizer(str(path))("put the cube.") == Tokens(1, (3, 7, 12, 13), 1)


def test_a_tokenizer_file_that_cannot_be_read_is_refused_with_the_reason(tmp_path, monkeypatch):
    with pytest.raises(InvalidValueError, match="is not a file"):
        read_tokenizer(str(tmp_path / "none.model"))

    (tmp_path / "empty.model").write_text("")
    with pytest.raises(InvalidValueError, match="cannot be used as a SentencePiece model"):
        read_tokenizer(str(tmp_path / "empty.model"))

    with (tmp_path / "large.json").open("wb") as file:
        file.truncate(2**40)  # takes no space
    with pytest.raises(InvalidValueError, match=r"large\.json has more than 268,435,456 bytes"):
        read_tokenizer(str(tmp_path / "large.json"))

    for name, library in (("other.model", "sentencepiece"), ("a.json", "tokenizers")):
        (tmp_path / name).write_text("{}")
        monkeypatch.setitem(sys.modules, library, None)
        with pytest.raises(
            MissingDependencyError, match=rf"needs {library}, which is not installed .*tokens"
        ):
            read_tokenizer(str(tmp_path / name))


def test_the_token_limit_of_a_remote_policy_is_read_from_its_url(sentencepiece_file):
    url = f"openpi://localhost:1?prompt_tokens=48&prompt_added=7&tokenizer={sentencepiece_file}"
    limit = prompt_limit_of(url)._replace(tokenize=None)

    assert limit == PromptLimit(48, 7, None, "tokenizer.model.v1", lowers=False)
    assert prompt_limit_of("mme-vla://localhost:1?prompt_tokens=64").lowers
    assert prompt_limit_of("openpi://localhost:1") is None
    assert prompt_limit_of("oracle") is None


def test_each_system_of_the_paper_declares_its_token_limit():
    limits = {name: prompt_limit_of(f"system:{name}") for name in all_systems()}
    assert len(limits) == 7
    for name, limit in limits.items():
        is_symbolic = name.startswith("GroundSG") or name == "MemER"
        assert limit.tokens == (128 if is_symbolic else 64)
        assert (limit.added > 0) == is_symbolic
        assert limit.lowers
    assert prompt_limit_of("system:pi0.5?policy.prompt_tokens=48").tokens == 48


def test_the_token_limit_of_a_lerobot_checkpoint_is_read_from_its_configuration(tmp_path):
    write_checkpoint(tmp_path, tokenizer_max_length=48)
    assert LeRobotPolicy(f"lerobot://{tmp_path}").prompt_tokens == 48
    assert prompt_limit_of(f"lerobot://{tmp_path}?prompt_tokens=9").tokens == 9
    assert prompt_limit_of("lerobot://nobody/nothing") is None
    for limit in ("many", None, 0, [48]):
        write_checkpoint(tmp_path, tokenizer_max_length=limit)
        assert LeRobotPolicy(f"lerobot://{tmp_path}").prompt_tokens is None
