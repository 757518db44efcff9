"""One rule reads the replies of all models: right or unreadable, and what is unreadable counts."""

import contextlib
import json
import math
from string import Template
from types import SimpleNamespace

import pytest
from forty_replies import FORTY, UNREADABLE, StyledReply
from planning_fakes import Garbage, fake_vlm, model_options

from roboirg.policies.planners.model_planners import StatelessOptions, StatelessPlanner
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.policies.vlm.model_content import ChatTurn
from roboirg.policies.vlm.models import ModelOptions, ModelQuery
from roboirg.policies.vlm.vlm_query import VLMQuery
from roboirg.util.reply_reading import (
    UnparsableReplyError,
    answer_of,
    chosen_letter,
    json_object,
    last_json,
    whole_number,
    with_thoughts,
)

SOME_QUERY = ModelQuery("system", (ChatTurn("user", ("words",)),))


def reply_of(styled):
    return styled.options().service.read(styled.body())


def goal_in(text):
    """Return the goal of PickXtimes that a reply names: `{"color": "blue", "repeats": 2}`."""
    schema = goal_schema("PickXtimes")
    goal = json.loads(schema.answers[schema.read(text)])
    return json.dumps(goal, sort_keys=True)


def letter_in(text):
    """Return which of the choices A, B and C a reply names."""
    return chosen_letter(text, "ABC")


def subgoal_in(text):
    options = StatelessOptions(model=ModelOptions(model="m"))
    return StatelessPlanner(options, "stateless").read_reply(text)


READERS = {"goal": goal_in, "letter": letter_in, "subgoal": subgoal_in}


def model_that_replies(styled):
    """Return a model that gives one reply to all questions, and the list of these questions.

    The model asks its service a second time if it cannot read the first reply.
    """
    questions = []

    def answer(question):
        questions.append(question)
        return reply_of(styled)

    service = SimpleNamespace(answer=answer)
    return VLMQuery(ModelOptions(model="m"), Template("$why"), lambda _: service), questions


@pytest.mark.parametrize("styled", FORTY, ids=lambda styled: styled.style)
def test_a_reply_in_the_style_of_a_model_family_is_read_as_it_is_meant_or_counted(styled):
    """`styled` is what a server sends, such as *The answer is **B**.* after some reasoning, with
    what it means (`reading`): the letter B, the goal *blue, twice*, or *pick up the blue cube*.

    The reading is None if the reply has no answer, such as *It is A or B.*: then the model is asked
    a second time, and the question is counted as one without a readable answer.
    """
    model, questions = model_that_replies(styled)

    found = model.ask(SOME_QUERY, READERS[styled.question])

    unreadable = int(styled.reading is None)
    assert found == styled.reading
    assert model.usage()["unparsed"] == unreadable
    assert len(questions) == 1 + unreadable


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ({"content": "<think>\nIs it red?\n</think>\n\nB"}, "Is it red?"),
        ({"content": "B", "reasoning_content": "Is it red?"}, "Is it red?"),
        (
            {"content": [{"type": "thinking", "thinking": "Red?"}, {"type": "text", "text": "B"}]},
            "Red?",
        ),
    ],
    ids=["tags in the text", "a field of its own", "a part of its own"],
)
def test_the_stored_text_of_a_reply_includes_the_model_s_thoughts(message, words):
    """Thoughts stand in the text, in another field, or in a part of another type."""
    reply = {"choices": [{"message": message, "finish_reason": "stop"}]}
    service = ModelOptions(model="m", base_url="http://127.0.0.1:9").service

    text = service.read(reply).text

    assert words in text
    assert letter_in(text) == "B"


DRAFT = 'Perhaps {"color": "red", "repeats": 1}? But the remark says'


@pytest.mark.parametrize(
    "cut",
    [
        StyledReply("Qwen", "goal", UNREADABLE, DRAFT, ended="length"),
        StyledReply("Gemini", "goal", UNREADABLE, [{"text": DRAFT}], ended="max_tokens"),
        StyledReply("Llama", "subgoal", UNREADABLE, "pick up the blue cube", ended="length"),
    ],
    ids=["goal", "Gemini's goal", "subgoal"],
)
def test_a_reply_that_its_service_cut_off_is_asked_for_again(cut):
    """A service that ends a reply at its limit of tokens says so (*length*, *max_tokens*). What
    stands there may be a draft, not the answer, so both replies are unreadable.

    The second question ends with the reason.
    """
    model, questions = model_that_replies(cut)

    found = model.ask(SOME_QUERY, READERS[cut.question])

    (reason,) = questions[1].turns[-1].parts
    assert found is None
    assert model.usage()["unparsed"] == 1
    assert "cut off at the limit of tokens" in reason


def test_a_reply_that_was_cut_off_behind_its_object_is_read():
    """Some models add line breaks behind the answer until the limit of tokens (*length*)."""
    goal = '{"color": "blue", "repeats": 2}'
    model, _ = model_that_replies(StyledReply("GPT", "goal", goal, f"{goal}\n\n\n", ended="length"))

    assert model.ask(SOME_QUERY, goal_in) == goal


def test_a_model_asked_again_sees_its_rejected_reply_without_its_thoughts():
    with fake_vlm(["<think>so many words</think>no idea"]) as server:
        VLMQuery(model_options(server), Template("$why")).ask(SOME_QUERY, goal_in)
        assert server.requests[1]["messages"][2]["content"] == "no idea"


@pytest.mark.parametrize("tag", ["<think>", "</think>"])
def test_a_think_tag_inside_a_json_text_does_not_hide_the_answer(tag):
    assert letter_in(f'<think>A</think>{{"answer": "C", "note": "{tag}"}}') == "C"


@pytest.mark.parametrize("thoughts", [["</think> B"], [{"a": "<think>"}], []])
def test_think_tags_inside_separate_thoughts_do_not_change_the_answer(thoughts):
    assert answer_of(with_thoughts("A", thoughts)) == "A"


@pytest.mark.parametrize(
    ("reply", "letter"),
    [
        ("A is correct.", "A"),
        ("There is no red cube, so the answer is B.", "B"),
        ("I first thought A, but the answer is C.", "C"),
        ("C\nIt is not the red one.", "C"),
        ("$\\boxed{\\text{C}}$", "C"),
        ("C – the green cube", "C"),
        ("Option B", "B"),
        ("My choice is B.", "B"),
        ("Answer:\n\nB) Put it there.", "B"),
        ('{"choice": "B. Put it there."}', "B"),
        ('{"choice": "", "answer": "B"}', "B"),
    ],
)
def test_a_letter_is_read_where_it_is_given_as_the_answer(reply, letter):
    """Choices are A, B and C."""
    assert letter_in(reply) == letter


@pytest.mark.parametrize(
    "reply",
    [
        "The answer is not A but C",
        "B and C are wrong",
        "Answer: a cube",
        "\\boxed{A cube}",
        "D",
        "Wrong answer: C",
        "The least likely answer is C",
        "Is the answer C? No.",
        "If the answer is C then it is red.",
        "Not this:\n\nC",
        "answer: A and not B",
        "Answer: A. Hmm, C",
        "answer: ~~C~~",
        "answer: C\u0336",
        "**C** is wrong",
        "C isn't it.",
        "C?",
        '{"answer": "not C"}',
        '{"choice": "C", "answer": "B"}',
    ],
)
def test_a_letter_that_is_denied_questioned_or_next_to_another_is_no_answer(reply):
    """Such a reply has to be asked for again."""
    with pytest.raises(UnparsableReplyError, match="one of the letters"):
        letter_in(reply)


def test_a_letter_in_an_object_that_breaks_off_is_no_answer():
    with pytest.raises(UnparsableReplyError, match="breaks off"):
        letter_in('{"choice": "B"')


@pytest.mark.parametrize("read", [letter_in, goal_in], ids=["letter", "goal"])
@pytest.mark.parametrize(
    "later",
    [
        "No: {answer: B, color: red, repeats: 1}",
        "{“answer”: “B”}",
        '{/* rather */ "answer": "B"}',
        '{\n// rather\n"answer": "B"}',
        "{answer",
        "}\n} extra",
        '{"answer": "B", "answer": "C"}',
    ],
)
def test_a_reply_with_a_good_and_a_malformed_json_object_is_unreadable(read, later):
    """The good object alone is read. The malformed one may correct it, so with that behind it,
    before it or around it (in one more pair of braces) the good one must not count.
    """
    good = '{"answer": "C", "color": "green", "repeats": 3}'
    read(good)
    for reply in (f"{good}\n{later}", f"{later}\n{good}", f"{{{good}}}"):
        with pytest.raises(UnparsableReplyError, match="breaks off or is malformed"):
            read(reply)


@pytest.mark.parametrize(
    "text",
    [
        '{"a": 1} {"b": ',
        '{"a": {"b": 1}, "c',
        "{\"a\": 1} {'b': 2}",
        '{"a": 1} {',
        "[" + '{"a":' * 9,
    ],
)
def test_a_json_object_that_breaks_off_is_not_replaced_by_an_earlier_one(text):
    with pytest.raises(UnparsableReplyError, match="breaks off or is malformed"):
        json_object(text)


def test_a_json_object_may_have_line_breaks_in_texts_and_words_in_braces_around_it():
    assert json_object('{so} {"a": "b\nc } {"} {there}') == {"a": "b\nc } {"}


@pytest.mark.parametrize(
    "text",
    [
        "</s>" * 20_000 + "x",
        '{"a":' * 50_000,
        "answer" + " " * 200_000,
        "answer A " * 20_000,
        "{" + "a" * 200_000,
    ],
    ids=["tags", "nested objects", "blanks", "answers", "a brace"],
)
def test_long_repetitive_replies_are_read_quickly(text):
    """A quadratic reading would take minutes; whether they are readable does not matter here."""
    for read in (letter_in, last_json):
        with contextlib.suppress(UnparsableReplyError):
            read(text)


@pytest.mark.parametrize(
    ("value", "number"), [(3, 3), (3.0, 3), ("3", 3), (-0.0, 0), (10**400, 10**400)]
)
def test_json_values_that_are_whole_numbers_are_read(value, number):
    """Also as a float or a text, and larger than any float; the result is an int."""
    found = whole_number(value)

    assert found == number
    assert type(found) is int


@pytest.mark.parametrize("value", [True, 2.5, "two", "9" * 5000, float("inf"), None, [3]])
def test_json_values_that_are_no_whole_numbers_give_none(value):
    """Python takes True for 1, and reads no text of 5,000 digits."""
    assert whole_number(value) is None


def reply_with_usage(provider, usage):
    """A good reply whose service reports this usage."""
    if provider == "google":
        parts = {"content": {"parts": [{"text": "fine"}]}}
        reply = {"candidates": [parts], "usageMetadata": usage}
    else:
        reply = {"choices": [{"message": {"content": "fine"}}], "usage": usage}
    return Garbage(json.dumps(reply).encode())


NAMES = {
    "openai": ("prompt_tokens", "completion_tokens"),
    "google": ("promptTokenCount", "candidatesTokenCount"),
}


def usage_after_a_reply_with(provider, usage, **prices):
    with fake_vlm([reply_with_usage(provider, usage)]) as server:
        vlm = VLMQuery(model_options(server, provider, **prices), Template(""))
        assert vlm.ask(SOME_QUERY, str) == "fine"
        return vlm.usage()


@pytest.mark.parametrize("provider", NAMES)
@pytest.mark.parametrize("count", [None, "many", True, 1.5, [], -(10**6), 10**9])
def test_an_answer_counts_though_its_number_of_tokens_makes_no_sense(provider, count):
    """A service reports 5 tokens sent, and received a `count` that makes no sense.

    What is unknown is no number (NaN), and so is the cost of an answer with such a count.
    """
    sent, received = NAMES[provider]

    usage = usage_after_a_reply_with(
        provider, {sent: 5, received: count}, input_price=2.0, output_price=3.0
    )

    assert usage["input_tokens"] == 5
    assert math.isnan(usage["output_tokens"])
    assert math.isnan(usage["cost_usd"])


@pytest.mark.parametrize("provider", NAMES)
def test_tokens_without_a_price_do_not_make_the_cost_unknown(provider):
    """Five tokens at two dollars per million; how many were received is unknown."""
    sent, _ = NAMES[provider]

    usage = usage_after_a_reply_with(provider, {sent: 5}, input_price=2.0)

    assert usage["cost_usd"] == pytest.approx(1e-5)


@pytest.mark.parametrize("provider", NAMES)
@pytest.mark.parametrize("usage", [None, [], "none", 3, {}])
def test_an_answer_counts_though_the_service_reports_no_tokens(provider, usage):
    """What is unknown is no number (NaN)."""
    found = usage_after_a_reply_with(provider, usage)

    assert math.isnan(found["input_tokens"])


@pytest.mark.parametrize("provider", NAMES)
@pytest.mark.parametrize("count", [7, 7.0, "7"])
def test_numbers_of_tokens_may_be_integers_floats_or_texts(provider, count):
    """A service reports 7 received tokens in one of three ways."""
    _, received = NAMES[provider]

    usage = usage_after_a_reply_with(provider, {received: count})

    assert usage["output_tokens"] == 7
