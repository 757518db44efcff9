"""The check finds nothing in the systems that come along, whose servers do as they were trained.

The servers stand in for the models: they speak the protocol, keep what they are shown, read as many
words as the model, and answer with changes of the state that they were sent.
"""

import zlib

import numpy as np
import pytest
from expert_world import record
from planning_fakes import fake_vlm
from selection import slow_but
from wire_servers import CHUNK, MmeVlaServer

from roboirg.apps.policy_check.check_result import FAIL, NOTE, PASS, WARN
from roboirg.apps.policy_check.policy_check import check_policy
from roboirg.policies.by_name.systems import all_systems

REMEMBER = {"TTT-Expert", "FrameS-Modul"}
REPLIES = {
    "GroundSG-QwenVL": "put it down",
    "GroundSG-Gemini": '{"description": "x", "subgoal_sequence": [], "subgoal": "put it down"}',
    "MemER": '{"current_subtask": "put it down", "keyframe_positions": [1]}',
}


class SystemServer(MmeVlaServer):
    """Answers as a model of the release would."""

    words, remembers = 64, True

    def infer(self, message):
        if self.remembers:
            super().infer(message)
        state = np.asarray(message["observation/state"], np.float64)
        prompt = " ".join(message["prompt"].split()[: self.words])
        assert prompt == prompt.lower()
        said = f"{prompt}|{message.get('grounded_subgoal')}"
        seen = [float(message[f"observation/{name}"].mean()) for name in ("image", "wrist_image")]
        change = 1e-4 * (zlib.crc32(said.encode()) % 97 + np.mean(seen))
        change += 1e-3 * seen[0] / (1 + seen[1]) + 1e-7 * (self.frames + (self.memory % 101))
        rows = np.tile(state[:7], (CHUNK, 1)) + change * np.linspace(0, 1, CHUNK)[:, None]
        return {"actions": np.column_stack([rows, np.ones(CHUNK)]), "infer_time_ms": 0.1}

    def forget(self):
        super().forget()
        self.memory = 0

    def remember(self, message):
        self.memory += int(message["images"].sum(dtype=np.int64))
        return super().remember(message)


def check_system(name, server_class, **options):
    remembers = name in REMEMBER
    with server_class() as server, fake_vlm([REPLIES.get(name, "")]) as vlm:
        server.remembers = remembers
        place = f"server={server.place}&policy.timeout=60"
        model = f"&vlm={vlm.url}" if name in REPLIES else ""
        return check_policy(f"system:{name}?{place}{model}", **options)


@pytest.mark.slow
@pytest.mark.parametrize("name", slow_but(["GroundSG-QwenVL", "FrameS-Modul"], all_systems()))
def test_nothing_is_found_in_a_system(name, monkeypatch):
    monkeypatch.setenv("GOOGLE_API_KEY", "secret")
    results = check_system(name, SystemServer, record_expert=record)
    assert {one.verdict for one in results} <= {PASS, NOTE}, results
    names = {one.check for one in results}
    if name == "GroundSG-oracle":
        assert names == {"loads"}
    else:
        assert {"language", "prompt end", "pictures", "state"} <= names


class DeafServer(SystemServer):
    words = 0


class CuttingServer(SystemServer):
    words = 12


class ForgetfulServer(SystemServer):
    def remember(self, message):
        reply = super().remember(message)
        self.memory, self.frames = 0, 1
        return reply


@pytest.mark.parametrize(
    ("system", "server", "check", "verdict"),
    [
        ("pi0.5", DeafServer, "language", WARN),
        ("pi0.5", CuttingServer, "prompt end", WARN),
        ("FrameS-Modul", ForgetfulServer, "video", NOTE),
    ],
)
def test_what_a_server_does_wrong_is_found(system, server, check, verdict):
    results = {one.check: one for one in check_system(system, server)}
    assert results[check].verdict == verdict
    assert FAIL not in {one.verdict for one in results.values()}
