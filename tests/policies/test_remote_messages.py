"""What remote policies send, byte for byte, and what they make of the replies.

The captures were written with the codec of openpi itself: see captures/make.py.
"""

import re
from pathlib import Path

import numpy as np
import pytest
from wire_episode import INSTRUCTION, moment, video
from wire_servers import ChallengeServer, MmeVlaServer, WireServer, unpack

from roboirg.core.errors import InvalidValueError
from roboirg.policies import make_policy
from roboirg.policies.contract.base import SubgoalFollower

CAPTURES = Path(__file__).with_name("captures")
PAGE = (Path(__file__).parents[2] / "docs" / "servers.md").read_text()
NOW, LATEST = moment(3, history=()), moment(5, history=(moment(4), moment(5)))


def captured(protocol):
    found = sorted(CAPTURES.glob(f"{protocol}-[0-9]*.msgpack"))
    assert found
    return [path.read_bytes() for path in found]


@pytest.mark.parametrize("protocol", ["openpi", "mme-vla", "challenge", "challenge-sensors"])
def test_the_page_has_type_and_shape_of_every_key_that_is_sent(protocol):
    for key, value in (pair for data in captured(protocol) for pair in unpack(data).items()):
        (one, head) = (value[0], "list of ") if isinstance(value, list) else (value, "")
        kind = getattr(one, "dtype", type(one).__name__)
        # The page has T frames, and pictures of 256 pixels.
        shape = re.sub(r"^\(\d, (?=1, |8\))", "(T, ", str(np.shape(one) or "")).replace(
            "8, 8, ", "256, 256, "
        )
        assert re.search(rf"`{key}`.* \| {head}{kind} ?{re.escape(shape)}[: ]", PAGE)


def test_openpi_sends_these_bytes():
    with WireServer() as server:
        policy = make_policy(f"openpi://{server.place}?version=mine", 0)
        policy.reset(INSTRUCTION, video(3))
        assert (policy.act(moment(3)).shape, policy.version) == ((20, 8), "mine")
        policy.close()
        assert server.messages == captured("openpi")


def test_mme_vla_sends_these_bytes():
    with MmeVlaServer() as server:
        policy = make_policy(f"mme-vla://{server.place}?part=2&execute=2", 0)
        policy.reset(INSTRUCTION, video(3))
        first = policy.act(NOW)
        policy.follow("Pick up the red cube at <12, 34>")
        second = policy.act(LATEST)
        policy.close()
        assert server.messages == captured("mme-vla")
    # Frames in memory, start of the turn, brightness of the newest frame, inferences, row.
    brightness = [NOW["front_rgb"].mean(), LATEST["front_rgb"].mean()]
    assert first[:, :5].tolist() == [[4, 3, brightness[0], 1, row] for row in range(2)]
    assert second[:, :5].tolist() == [[6, 3, brightness[1], 2, row] for row in range(2)]


def test_challenge_sends_these_bytes():
    with ChallengeServer() as server:
        policy = make_policy(f"challenge://{server.place}", 0)
        policy.reset(INSTRUCTION, video(3))
        assert (policy.act(NOW) == 4).all()
        assert (policy.act(LATEST) == 6).all()
        assert policy.metadata == {
            "server": server.place,
            "name": "submission",
            "version": "phase-1",
            "execute": "all",
        }
        assert policy.version == "phase-1"
        policy.close()
        assert server.messages == captured("challenge")


def test_challenge_sends_depth_and_matrices_on_request():
    now, later, latest = (moment(number, sensors=True) for number in (3, 4, 5))
    with ChallengeServer() as server:
        policy = make_policy(f"challenge://{server.place}?depth=yes&calibration=1", 0)
        assert (policy.depth, policy.calibration) == (True, True)
        policy.reset(INSTRUCTION, video(3, sensors=True))
        assert (policy.act({**now, "history": ()}) == 4).all()
        assert (policy.act({**latest, "history": (later, latest)}) == 6).all()
        policy.close()
        assert server.messages == captured("challenge-sensors")


def test_without_history_mme_vla_is_sent_no_frames():
    class Baseline(MmeVlaServer):
        def infer(self, message):
            return {"actions": np.ones((20, 8), np.float32)}

    with Baseline() as server:
        policy = make_policy(f"mme-vla://{server.place}?history=no&subgoals=none", 0)
        policy.reset(INSTRUCTION, {})
        assert policy.act(moment(0)).shape == (16, 8)
        assert [set(unpack(data)) for data in server.messages] == [
            {"reset"},
            {"observation/image", "observation/wrist_image", "observation/state", "prompt"},
        ]
        with pytest.raises(InvalidValueError, match="subgoals=none"):
            policy.follow("pick up the cube")
        policy.close()


@pytest.mark.parametrize(
    ("option", "sent"),
    [("simple", ("pick up the cube", None)), ("grounded", (None, "pick up the cube"))],
)
def test_a_subgoal_goes_where_the_checkpoint_expects_it(option, sent):
    with MmeVlaServer() as server:
        policy = make_policy(f"mme-vla://{server.place}?subgoals={option}", 0)
        assert isinstance(policy, SubgoalFollower)
        for _ in range(2):
            policy.reset(INSTRUCTION, video(0))
            policy.act(moment(0, history=()))
            policy.follow("Pick up the cube")
            policy.act(moment(2, history=(moment(1), moment(2))))
        policy.close()
        assert server.subgoals == [(None, None), sent] * 2
        assert server.prompts == [INSTRUCTION.lower()] * 4


@pytest.mark.parametrize(
    ("length", "parts"), [(0, [1]), (1, [2]), (15, [16]), (16, [16, 1]), (40, [16, 16, 9])]
)
def test_a_video_arrives_in_parts_with_the_acting_frame(length, parts):
    with MmeVlaServer() as server:
        policy = make_policy(f"mme-vla://{server.place}", 0)
        policy.reset(INSTRUCTION, video(length))
        rows = policy.act(moment(length, history=()))
        policy.close()
        assert (server.parts, server.frames, server.start) == (parts, length + 1, length)
        assert rows[0, :2].tolist() == [length + 1, length]


def test_a_history_longer_than_a_part_is_sent_in_parts():
    with MmeVlaServer() as server:
        policy = make_policy(f"mme-vla://{server.place}?part=4&execute=9", 0)
        policy.reset(INSTRUCTION, video(0))
        policy.act(moment(0, history=()))
        policy.act(moment(9, history=[moment(number) for number in range(1, 10)]))
        policy.close()
        assert server.parts == [1, 4, 4, 1]


def test_keys_and_cameras_of_an_openpi_checkpoint_can_be_named():
    with WireServer() as server:
        policy = make_policy(
            f"openpi://{server.place}?front=base&wrist=&state=q&prompt=say&execute=3", 0
        )
        assert policy.cameras == ("front",)
        policy.reset(INSTRUCTION, {})
        assert policy.act(moment(0)).shape == (3, 8)
        policy.close()
        assert list(unpack(server.messages[0])) == ["base", "q", "say"]


def test_a_server_may_be_at_a_path_and_have_the_dialect_of_msgpack_numpy():
    rows = np.arange(16, dtype=np.float32).reshape(2, 8)
    described = {b"nd": True, b"type": "<f4", b"kind": b"", b"shape": (2, 8)}
    reply = {"actions": {**described, b"data": rows.tobytes()}}
    with WireServer(faults=[reply]) as server:
        place = f"{server.place}/v1/realtime/robot/openpi"
        policy = make_policy(f"openpi://{place}/?execute=2", 0)
        policy.reset(INSTRUCTION, {})
        assert (server.path, policy.metadata["server"]) == ("/v1/realtime/robot/openpi", place)
        assert np.array_equal(policy.act(moment(0)), rows)
        policy.close()


@pytest.mark.parametrize("place", ["host", "host:0", "host:x", "host:1,", "host:1#a", "ho st:1"])
def test_what_is_no_server_is_refused(place):
    with pytest.raises(InvalidValueError, match="is not a server; write openpi://host:port"):
        make_policy(f"openpi://{place}", 0)
    with pytest.raises(InvalidValueError, match="holds a key or password"):
        make_policy("openpi://me:secret@host:1", 0)
