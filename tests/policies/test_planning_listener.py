"""A model names the goal, over real HTTP: its input, its answers, and their consequences."""

import contextlib
import json
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_fakes import (
    CAPTURES,
    KEY,
    KEY_VARIABLE,
    Garbage,
    Late,
    Status,
    check_capture,
    check_sample,
    fake_vlm,
    golden,
    make_listener,
    spent,
    stand_in,
    words_of,
)

import roboirg
from roboirg.core.episode import SPLITS
from roboirg.core.errors import (
    MissingDependencyError,
    PolicyConnectionError,
    PolicyReplyError,
    PolicyTimeoutError,
)
from roboirg.language import instruct
from roboirg.language.settings import plain_settings
from roboirg.policies import play
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.policies.vlm.models import ModelOptions
from roboirg.shortcuts.command_chance import is_right, understood_goals
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode, split_episodes
from roboirg.util.reply_reading import UnparsableReplyError


def instruction_in(body):
    """The instruction in a request."""
    return re.search(r"What was said to the robot, in full:\n(.*)", words_of(body))[1]


def answers_with_the_meant_goal(episode, setting="explicit"):
    """Answers with the goal that the words of the request mean."""
    instruction = instruct(episode, setting)
    goal, *_ = understood_goals(instruction, episode)

    def answer(body):
        assert instruction_in(body) == instruction.text
        return goal_schema(episode.task).answers[goal]

    return answer


@pytest.mark.parametrize("task", every_task())
def test_the_schema_for_a_model_s_answer_has_exactly_the_goals_that_occur(task):
    """A schema lists the answers that a model may give, one for each goal. The goals that occur
    are those of all scenes of all splits of the task; each is read back from its answer.
    """
    slots = goal_schema(task)
    possible = set()
    for episode in split_episodes([task], SPLITS):
        possible.update(every_task()[task].goals(episode.scene))

    assert set(slots.goals.values()) == possible
    for goal in possible:
        assert slots.read(slots.answers[goal]) == goal


COLORS = {"type": "string", "enum": ["blue", "green", "red"]}


@pytest.mark.parametrize(
    ("task", "fields"),
    [
        ("PickXtimes", {"color": COLORS, "repeats": {"type": "integer", "enum": [1, 2, 3, 4, 5]}}),
        (
            "VideoUnmask",
            {"colors": {"type": "array", "items": COLORS, "minItems": 1, "maxItems": 2}},
        ),
    ],
)
def test_the_json_schema_for_a_model_lists_the_values_of_each_field_of_an_answer(task, fields):
    """COLORS are the texts *blue*, *green* and *red*. In PickXtimes one color is picked one to
    five times; in VideoUnmask one or two colors.
    """
    assert goal_schema(task).schema()["properties"] == fields


@settings(max_examples=25)
@given(
    st.recursive(
        st.none()
        | st.booleans()
        | st.integers(-3, 9)
        | st.floats()
        | st.sampled_from(["red", "blue", "Red ", "before", "x"]),
        lambda inner: (
            st.lists(inner, max_size=3)
            | st.dictionaries(st.sampled_from(["color", "colors", "repeats", "visit"]), inner)
        ),
    )
)
def test_any_json_reply_is_read_as_a_goal_or_refused(reply):
    """Hypothesis makes up the reply, with colors and fields that occur. To refuse it is to raise
    `UnparsableReplyError`; any other exception fails the test.
    """
    for task in every_task():
        slots = goal_schema(task)
        with contextlib.suppress(UnparsableReplyError):
            assert slots.read(json.dumps(reply)) in slots.goals.values()


@pytest.mark.parametrize(
    ("task", "reply", "words"),
    [
        ("PickXtimes", "red, three times", "no JSON object"),
        ("PickXtimes", '{"color": "red"}', "'repeats' is missing"),
        (
            "PickXtimes",
            '{"color": "pink", "repeats": 2}',
            "'color' cannot be \"pink\".*blue, green, red",
        ),
        ("PickXtimes", '{"color": "red", "repeats": true}', "'repeats' cannot be true"),
        ("BinFill", '{"red": 0, "blue": 0, "green": 0}', "meant together"),
        ("VideoUnmask", '{"colors": ["red", "red"]}', "meant together"),
    ],
)
def test_a_wrong_reply_is_refused_with_what_would_be_right(task, reply, words):
    """No JSON, a field that is missing, a value that its field cannot have, and values that no
    goal has together (nothing to sort; the same color twice).
    """
    with pytest.raises(UnparsableReplyError, match=words):
        goal_schema(task).read(reply)


@pytest.mark.parametrize("task", every_task())
def test_a_model_that_knows_what_the_words_mean_finds_the_goal_in_all_settings(task):
    """The model is a stand-in: it reads what was said in the request, and answers with the goal
    that these words mean. The policy then has the goal of the episode.

    A setting is a way to imply the goal; these are all that any scene of the task can express.
    """
    episode = get_episode(task, "test", 0)
    with fake_vlm(["{}"]) as server:
        policy = make_listener(server)
        for setting in plain_settings(every_task()[task]):
            env = stand_in(episode, setting)
            server.answer = answers_with_the_meant_goal(episode, setting)

            goal = policy.decide(env, env.instruction.text)

            assert is_right(goal, episode), setting
    assert len(server.requests) > 1


def test_a_request_to_a_model_contains_nothing_of_the_scene_but_pictures_and_words():
    """The same words get the same request in every scene of a task that looks alike."""
    requests = set()
    with fake_vlm(["{}"]) as server:
        for index in range(8):
            env = stand_in(get_episode("PickXtimes", "test", index))
            assert make_listener(server).decide(env, "Do that again.") is None
            requests.add(json.dumps(server.requests[0]))
            server.requests.clear()
    assert len(requests) == 1


ENV = stand_in(get_episode("PickXtimes", "test", 0))
"""The goal is the green cube, three times."""
GREEN_THREE_TIMES = '{"color": "green", "repeats": 3}'


def test_an_unreadable_reply_is_asked_again_with_the_reason():
    """The first reply is *no idea*. The second request has the messages of the first one, the
    reply, and why it cannot be read. Its answer is the goal of ENV, the green cube three times.
    """
    with fake_vlm(["no idea", GREEN_THREE_TIMES]) as server:
        policy = make_listener(server)

        goal = policy.decide(ENV, "Do it.")

    assert goal == ENV.episode.goal
    assert spent(policy) == usage_of(calls=2)
    first, second = server.requests
    *same, said, complaint = second["messages"]
    assert same == first["messages"]
    assert said == {"role": "assistant", "content": "no idea"}
    assert "no JSON object" in complaint["content"][0]["text"]


def test_a_prompt_that_google_blocks_counts_as_an_unreadable_reply():
    """Google replies with the reason for which it blocked the prompt, and without an answer. The
    model is asked a second time, with *(no answer)* in place of its reply, and in vain.
    """
    with fake_vlm([Garbage(b'{"promptFeedback": {"blockReason": "OTHER"}}')]) as server:
        policy = make_listener(server, "google")
        assert policy.decide(ENV, "Do it.") is None
    assert spent(policy)["unparsed"] == 1
    assert "(no answer)" in words_of(server.requests[1])


def usage_of(calls, unparsed=0, impossible=0):
    """Return what so many calls cost: each has 100 input tokens and 7 output tokens."""
    return {
        "calls": calls,
        "input_tokens": calls * 100,
        "output_tokens": calls * 7,
        "unparsed": unparsed,
        "impossible": impossible,
    }


def test_a_goal_that_the_scene_lacks_is_counted_as_impossible():
    """The model answers with a red cube; the scene of ENV has a green one only. What was
    understood is recorded all the same.
    """
    with fake_vlm(['{"color": "red", "repeats": 1}']) as server:
        policy = make_listener(server)
        policy.make_primitives = lambda env: None  # there is no arm here
        policy.attach(ENV)

        policy.reset("Do it.", {})

    assert spent(policy) == usage_of(calls=1, impossible=1)
    assert policy.metadata["understood"] == {"color": "red", "repeats": 1}


def test_a_model_that_reads_text_only_gets_no_picture():
    """With `pictures=False` the policy needs no camera and no video, and with `structured=False`
    it asks for no JSON schema (`response_format`). The model, a stand-in, answers with the
    episode's goal.
    """
    episode = get_episode("VideoUnmask", "test", 0)
    said = instruct(episode, "direct").text
    with fake_vlm([goal_schema("VideoUnmask").answers[episode.goal]]) as server:
        policy = make_listener(server, pictures=False, structured=False)

        goal = policy.decide(stand_in(episode, "direct"), said)

    assert goal == episode.goal
    assert (policy.cameras, policy.demonstration_frames) == ((), "none")
    (request,) = server.requests
    assert said in words_of(request)
    assert not re.search("image|response_format", json.dumps(request))


FAULTS_OF_ANY_SERVICE = [
    (Status(401, f"bad key {KEY}"), PolicyReplyError, r"bad key \*+\W"),
    (Status(503), PolicyConnectionError, "not available"),
    (Garbage(b"{"), PolicyReplyError, "fake"),
    (Garbage(b'[{"candidates": 1, "choices": 1}]'), PolicyReplyError, "something else"),
    (Garbage(b"x" * 90, "text/plain"), PolicyReplyError, r"text/plain that begins 'x{80}'"),
]
"""Those whose replies each service reports in its own way."""
FAULTS_OF_OPENAI = [
    (Status(400), PolicyReplyError, "something went wrong"),
    (Status(307, headers={"Location": "http://127.0.0.1:9"}), PolicyReplyError, "status 307"),
    (Status(429), PolicyConnectionError, "not available"),
    (Garbage(b"<html>", "text/html"), PolicyReplyError, "fake"),
    (Garbage(b"[" * 100_000), PolicyReplyError, "RecursionError"),
]


@pytest.mark.parametrize(
    ("provider", "mishap", "error", "words"),
    [("openai", *mishap) for mishap in FAULTS_OF_ANY_SERVICE + FAULTS_OF_OPENAI]
    + [("google", *mishap) for mishap in FAULTS_OF_ANY_SERVICE],
)
def test_each_fault_of_a_model_service_has_its_own_error_without_the_key(
    provider, mishap, error, words, monkeypatch
):
    """`mishap` is what the service (a stand-in) does instead of answering: it replies with a status
    of HTTP that is an error, or with something that is no answer.

    The error says so in `words`. Nothing of it has the key: the service may have repeated it, and
    an exception that caused it would hold the request.
    """
    monkeypatch.setenv(KEY_VARIABLE, KEY)
    with fake_vlm([mishap]) as server:
        policy = make_listener(server, provider, api_key_env=KEY_VARIABLE)

        with pytest.raises(error, match=words) as raised:
            policy.decide(ENV, "Do it.")

    assert KEY in json.dumps(server.headers)
    assert KEY not in str(raised.value)
    assert raised.value.__cause__ is None


@pytest.mark.parametrize(
    ("provider", "late"),
    [("openai", Late(30)), ("openai", Late(30, drip=True)), ("google", Late(30))],
    ids=["openai", "blanks meanwhile", "google"],
)
def test_a_reply_that_comes_too_late_is_a_timeout(provider, late):
    """The service replies after 30 s, and may send blanks until then; the limit is 0.5 s."""
    with fake_vlm([late]) as server:
        policy = make_listener(server, provider, timeout_s=0.5)

        with pytest.raises(PolicyTimeoutError, match=r"did not answer within 0\.5 s") as raised:
            policy.decide(ENV, "Do it.")

    assert raised.value.__cause__ is None


@pytest.mark.parametrize("provider", ["openai", "google"])
def test_an_absent_service_is_a_connection_error(provider):
    with fake_vlm(["{}"]) as server:
        policy = make_listener(server, provider)
    with pytest.raises(PolicyConnectionError, match="cannot be reached"):
        policy.decide(ENV, "Do it.")


def test_the_key_for_openai_in_the_environment_is_not_sent_to_other_servers(monkeypatch):
    """OPENAI_API_KEY is set. The server of the test is another one, and no option names a key."""
    monkeypatch.setenv("OPENAI_API_KEY", KEY)
    with fake_vlm([GREEN_THREE_TIMES]) as server:
        make_listener(server).decide(ENV, "Do it.")

    assert len(server.headers) == 1
    assert KEY not in json.dumps(server.headers)


def test_what_is_recorded_of_a_policy_has_its_server_and_not_its_key(monkeypatch):
    """The option api_key_env names the variable with the key."""
    monkeypatch.setenv(KEY_VARIABLE, KEY)
    with fake_vlm([GREEN_THREE_TIMES]) as server:
        policy = make_listener(server, api_key_env=KEY_VARIABLE)
        policy.decide(ENV, "Do it.")

    recorded = json.dumps([policy.metadata, policy.usage(), policy.version])

    assert server.url in recorded
    assert KEY not in recorded


@pytest.mark.parametrize(
    ("options", "variable"),
    [
        (ModelOptions(model="m", api_key_env=KEY_VARIABLE), KEY_VARIABLE),
        (ModelOptions(provider="google", model="m"), "GOOGLE_API_KEY"),
    ],
    ids=["named", "usual of Google"],
)
def test_a_missing_key_is_reported_with_the_name_of_its_variable(monkeypatch, options, variable):
    """An option names the variable with the key; without it, Google's models have a usual one."""
    monkeypatch.delenv(variable, raising=False)

    with pytest.raises(MissingDependencyError, match=variable):
        options.key()


@pytest.mark.parametrize(
    ("changes", "is_same"),
    [
        ({"base_url": "http://elsewhere/v1"}, True),
        ({"timeout_s": 3}, True),
        ({"frames": 3}, False),
        ({"temperature": 0.5}, False),
        ({"pictures": False}, False),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, dict) else "",
)
def test_the_version_of_a_policy_changes_only_with_what_may_change_an_answer(changes, is_same):
    """Records are compared by version. Where the model's server is and how long to wait for it
    change no answer; pictures and temperature may.
    """
    with fake_vlm(["{}"]) as server:
        version = make_listener(server).version

        changed = make_listener(server, **changes).version

    assert (changed == version) == is_same


def video(steps):
    frames = np.arange(steps, dtype=np.uint8)[:, None, None, None] * np.ones(
        (1, 256, 256, 3), np.uint8
    )
    return {"front_rgb": frames[::8], "joint_positions": np.zeros((steps, 7), np.float32)}


@pytest.mark.parametrize("provider", ["openai", "google"])
@pytest.mark.parametrize(("shown", "steps"), [("none", 0), ("video", 100)])
def test_requests_to_models_are_equal_to_the_stored_ones(provider, shown, steps):
    """The one request of an episode, to either service, without a video and with one of 100 steps.

    What is sent may change only on purpose. captures/planning has these requests, with a
    description in place of each picture; ROBOIRG_CAPTURE=1 writes them anew.
    """
    episode = get_episode("VideoPlaceOrder", "test", 0)
    with fake_vlm(answers_with_the_meant_goal(episode, "direct")) as server:
        policy = make_listener(server, provider, frames=4, reasoning=True)
        policy._demonstration = video(steps)
        policy.decide(stand_in(episode, shade=9), instruct(episode, "direct").text)

    (request,) = server.requests
    check_capture(f"listener-{provider}-{shown}", golden(request))


def test_the_page_of_listeners_shows_a_stored_request_and_a_reply():
    answer = '{"reasoning": "The first one is meant.", "color": "red", "placement": 1}'
    request = json.loads((CAPTURES / "listener-openai-none.json").read_text())
    check_sample("only-vlm.md", request, answer)


@pytest.mark.sim
@pytest.mark.parametrize(
    ("task", "setting"),
    [("VideoUnmask", "spatial"), ("StopCube", "reasoning")],
)
def test_a_policy_with_a_stand_in_model_solves_an_episode(task, setting):
    """The stand-in answers with the goal that the words mean. It is asked once, and the scripted
    expert then does the task in the simulator.
    """
    episode = get_episode(task, "test", 0)
    with fake_vlm(answers_with_the_meant_goal(episode, setting)) as server:
        policy = make_listener(server, frames=2, frames_every=20)
        env = roboirg.make(task, setting=setting, cameras=policy.cameras, demonstration_frames=20)
        assert play(env, policy)["status"] == "success"
        assert policy.understood == episode.goal
        assert policy.usage()["calls"] == 1


def test_the_model_is_asked_only_after_the_last_sentence_was_heard():
    """Of two sentences the first comes at the reset, the second at step 20 (`unheard=1`: one is
    still to come). The model, a stand-in, is asked once, about both, and names the goal of ENV,
    the green cube three times.
    """
    first, last = instruct(ENV.episode, "direct").turns
    with fake_vlm([GREEN_THREE_TIMES]) as server:
        policy = make_listener(server)
        policy.make_primitives = lambda env: None  # there is no arm here
        policy.attach(stand_in(ENV.episode, "direct", unheard=1))

        policy.reset(first, {})
        assert policy.metadata["understood"] is None
        assert not server.requests

        policy.hear(last, 20)
        assert policy.understood == ENV.episode.goal
        (request,) = server.requests
        assert instruction_in(request) == f"{first} {last}"
