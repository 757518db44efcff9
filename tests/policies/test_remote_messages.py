"""What remote policies send, byte for byte, and what they make of the replies.

The captures were written with the codec of openpi itself: see captures/make.py.
"""

import re
from pathlib import Path

import numpy as np
import pytest
from wire_episode import INSTRUCTION, client_of, moment, video
from wire_servers import ChallengeServer, MmeVlaServer, WireServer, unpack

from roboirg.core.errors import InvalidValueError
from roboirg.policies import make_policy
from roboirg.policies.contract.base import SubgoalFollower

CAPTURES = Path(__file__).with_name("captures")
PAGE = (Path(__file__).parents[2] / "docs" / "servers.md").read_text()


def stored_messages(name):
    """Return the messages of an episode in captures, which openpi's own codec has written."""
    found = sorted(CAPTURES.glob(f"{name}-[0-9]*.msgpack"))
    assert found
    return [path.read_bytes() for path in found]


@pytest.mark.parametrize("protocol", ["openpi", "mme-vla", "challenge", "challenge-sensors"])
def test_the_documentation_has_the_type_and_shape_of_every_message_key(protocol):
    """Each stored message is a map from keys to values; PAGE is the documentation of the
    protocols.

    The page has a row for each key, with the type and shape of its value.
    """
    for data in stored_messages(protocol):
        for key, value in unpack(data).items():
            assert re.search(rf"`{key}`.* \| {re.escape(type_and_shape_of(value))}[: ]", PAGE)


def type_and_shape_of(value):
    """Return type and shape of a value of a message, as the page has them."""
    if isinstance(value, list):
        return f"list of {type_and_shape_of(value[0])}"
    kind = str(getattr(value, "dtype", type(value).__name__))
    if not np.shape(value):
        return kind
    # The page has T frames, and pictures of 256 pixels.
    shape = re.sub(r"^\(\d, (?=1, |8\))", "(T, ", str(np.shape(value)))
    return f"{kind} {shape.replace('8, 8, ', '256, 256, ')}"


def test_openpi_messages_are_byte_for_byte_the_stored_ones():
    """The one question of an episode: openpi has no message for the video. The stored message was
    made by captures/make.py, from the same moment and without code of ours.
    """
    with WireServer() as server, client_of(server, "openpi") as policy:
        policy.reset(INSTRUCTION, video(3))
        policy.act(moment(3))

    assert server.messages == stored_messages("openpi")


def test_the_version_of_a_policy_behind_openpi_is_that_of_its_url():
    with WireServer() as server, client_of(server, "openpi", "?version=mine") as policy:
        policy.reset(INSTRUCTION, video(3))

        assert policy.version == "mine"


def test_mme_vla_messages_are_byte_for_byte_the_stored_ones():
    """All messages of an episode: a video of the moments 0 to 2, moment 3 at the first question,
    and a subgoal and the moments 4 and 5 at the second. At most two frames are sent at once.

    The stored messages were made by captures/make.py, from the same moments and without code of
    ours.
    """
    with MmeVlaServer() as server, client_of(server, "mme-vla", "?part=2&execute=2") as policy:
        policy.reset(INSTRUCTION, video(3))
        policy.act(moment(3, history=()))
        policy.follow("Pick up the red cube at <12, 34>")
        policy.act(moment(5, history=(moment(4), moment(5))))

    assert server.messages == stored_messages("mme-vla")


@pytest.mark.parametrize(
    ("name", "options", "has_sensors"),
    [
        ("challenge", "", False),
        ("challenge-sensors", "?depth=yes&calibration=1", True),
    ],
)
def test_challenge_messages_are_byte_for_byte_the_stored_ones(name, options, has_sensors):
    """All messages of an episode: a video of the moments 0 to 2, moment 3 at the first question,
    and the moments 4 and 5 at the second; with depth and the cameras' matrices if the URL says so.

    The stored messages were made by captures/make.py, from the same moments and without code of
    ours.
    """
    now, later, latest = (moment(number, sensors=has_sensors) for number in (3, 4, 5))
    with ChallengeServer() as server, client_of(server, "challenge", options) as policy:
        policy.reset(INSTRUCTION, video(3, sensors=has_sensors))
        policy.act({**now, "history": ()})
        policy.act({**latest, "history": (later, latest)})

    assert server.messages == stored_messages(name)
    assert policy.depth == has_sensors
    assert policy.calibration == has_sensors


def test_the_metadata_of_a_challenge_server_are_kept_with_its_address():
    """The server (a stand-in) says that it is *submission*, version *phase-1*. The client adds its
    address, and that it executes all actions of a chunk.
    """
    with ChallengeServer() as server, client_of(server, "challenge") as policy:
        policy.reset(INSTRUCTION, video(3))

    assert policy.version == "phase-1"
    assert policy.metadata == {
        "server": server.place,
        "name": "submission",
        "version": "phase-1",
        "execute": "all",
    }


class ServerThatIgnoresFrames(MmeVlaServer):
    """Answers without looking at what was buffered."""

    def infer(self, message):
        return {"actions": np.ones((20, 8), np.float32)}


def test_with_history_no_mme_vla_gets_the_current_frame_only():
    """Of an episode with one question the server gets two messages, whose keys are shown: the
    reset and the question, and no frames for its memory. 16 of its 20 actions are executed.
    """
    with (
        ServerThatIgnoresFrames() as server,
        client_of(server, "mme-vla", "?history=no") as policy,
    ):
        policy.reset(INSTRUCTION, {})
        actions = policy.act(moment(0))

    assert actions.shape == (16, 8)
    assert [set(unpack(data)) for data in server.messages] == [
        {"reset"},
        {"observation/image", "observation/wrist_image", "observation/state", "prompt"},
    ]


def test_a_policy_without_subgoals_cannot_follow_one():
    policy = make_policy("mme-vla://localhost:1?subgoals=none", 0)

    with pytest.raises(InvalidValueError, match="subgoals=none"):
        policy.follow("pick up the cube")


@pytest.mark.parametrize(
    ("option", "sent"),
    [("simple", ("pick up the cube", None)), ("grounded", (None, "pick up the cube"))],
)
def test_a_subgoal_is_sent_under_the_key_that_the_checkpoint_expects(option, sent):
    """As `simple_subgoal` or `grounded_subgoal`, in lower case, and not in the next episode."""
    with (
        MmeVlaServer() as server,
        client_of(server, "mme-vla", f"?subgoals={option}") as policy,
    ):
        policy.reset(INSTRUCTION, video(0))
        policy.act(moment(0, history=()))
        policy.follow("Pick up the cube")
        policy.act(moment(2, history=(moment(1), moment(2))))
        policy.reset(INSTRUCTION, video(0))
        policy.act(moment(0, history=()))

    assert isinstance(policy, SubgoalFollower)
    assert server.subgoals == [(None, None), sent, (None, None)]
    assert server.prompts == [INSTRUCTION.lower()] * 3


@pytest.mark.parametrize(
    ("length", "parts"), [(0, [1]), (15, [16]), (16, [16, 1]), (40, [16, 16, 9])]
)
def test_a_video_is_sent_in_parts_of_16_frames_with_the_current_frame_last(length, parts):
    """A video of `length` frames and the current one are sent in parts of at most 16: `parts`.

    15 frames and the current one make one part; 40 and one make 16 + 16 + 9. The server answers
    with the number of frames that it has, and of those before the current one.
    """
    with MmeVlaServer() as server, client_of(server, "mme-vla") as policy:
        policy.reset(INSTRUCTION, video(length))
        rows = policy.act(moment(length, history=()))

        assert (server.parts, server.frames, server.start) == (parts, length + 1, length)
        assert rows[0, :2].tolist() == [length + 1, length]


def test_a_history_longer_than_a_part_is_sent_in_parts():
    """At most four frames are sent at once (`part=4`). The first question shows the frame 0 alone;
    the second one, 9 steps later, the frames 1 to 9, in parts of 4, 4 and 1.
    """
    with MmeVlaServer() as server, client_of(server, "mme-vla", "?part=4&execute=9") as policy:
        policy.reset(INSTRUCTION, video(0))
        policy.act(moment(0, history=()))
        policy.act(moment(9, history=map(moment, range(1, 10))))

    assert server.parts == [1, 4, 4, 1]


def test_url_options_rename_the_message_keys_of_an_openpi_checkpoint():
    """`wrist=` names no key, so the picture of the wrist is neither needed nor sent. Of the
    server's 20 actions three are executed.
    """
    with (
        WireServer() as server,
        client_of(server, "openpi", "?front=base&wrist=&state=q&prompt=say&execute=3") as policy,
    ):
        assert policy.cameras == ("front",)

        policy.reset(INSTRUCTION, {})
        assert policy.act(moment(0)).shape == (3, 8)
        assert list(unpack(server.messages[0])) == ["base", "q", "say"]


@pytest.mark.parametrize("query", ["front=a&wrist=a", "state=prompt", "prompt=observation/image"])
def test_two_entries_of_a_request_with_one_key_are_refused(query):
    """One would replace the other, and the policy would see less than its records say."""
    with pytest.raises(InvalidValueError, match="front, wrist, state and prompt must differ"):
        make_policy(f"openpi://localhost:1?{query}", 0)


def test_a_policy_server_may_have_a_path_in_its_url():
    """Behind host and port the client asks for the path, and records it with them, without the
    slash at its end.
    """
    with WireServer() as server:
        place = f"{server.place}/v1/realtime/robot/openpi"
        policy = make_policy(f"openpi://{place}/", 0)
        policy.reset(INSTRUCTION, {})
        assert (server.path, policy.metadata["server"]) == ("/v1/realtime/robot/openpi", place)

        policy.close()


def test_a_server_cannot_give_another_address_for_its_own():
    """The server's metadata are kept, such as its version, but for its address and how many
    actions are executed, which the client knows better.
    """
    with WireServer() as server, client_of(server, "openpi") as policy:
        server.metadata = {"server": "another:1", "execute": 3, "version": "2"}
        policy.reset(INSTRUCTION, {})

        expected = {"server": server.place, "execute": "all", "version": "2"}
        assert policy.metadata == expected


@pytest.mark.parametrize("place", ["host", "host:0", "host:x", "host:1,", "host:1#a", "ho st:1"])
def test_an_address_that_is_no_host_and_port_is_refused(place):
    with pytest.raises(InvalidValueError, match="is not a server; write openpi://host:port"):
        make_policy(f"openpi://{place}", 0)
