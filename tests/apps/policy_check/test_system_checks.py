"""The check finds nothing in the systems that come along, whose servers do as they were trained.

The servers stand in for the models: they speak the protocol and keep what they are shown.
"""

import numpy as np
import pytest
from expert_world import record
from planning_fakes import fake_vlm
from wire_servers import CHUNK, MmeVlaServer

from roboirg.apps.policy_check.check_result import NOTE, PASS
from roboirg.apps.policy_check.policy_check import check_policy
from roboirg.policies.planners.systems import all_systems

REMEMBER = {"TTT-Expert", "FrameS-Modul"}
REPLIES = {
    "GroundSG-QwenVL": "put it down",
    "GroundSG-Gemini": '{"description": "x", "subgoal_sequence": [], "subgoal": "put it down"}',
    "MemER": '{"current_subtask": "put it down", "keyframe_positions": [1]}',
}


class SystemServer(MmeVlaServer):
    """Keeps what it is shown, if its model has a memory."""

    remembers = True

    def infer(self, message):
        if self.remembers:
            return super().infer(message)
        return {"actions": np.zeros((CHUNK, 8)), "infer_time_ms": 0.1}


@pytest.mark.slow
@pytest.mark.parametrize("name", all_systems())
def test_nothing_is_found_in_a_system(name, monkeypatch):
    monkeypatch.setenv("GOOGLE_API_KEY", "secret")
    with SystemServer() as server, fake_vlm([REPLIES.get(name, "")]) as vlm:
        server.remembers = name in REMEMBER
        place = f"server={server.place}&policy.timeout=60"
        model = f"&vlm={vlm.url}" if name in REPLIES else ""
        results = check_policy(f"system:{name}?{place}{model}", record_expert=record)
    assert {one.verdict for one in results} <= {PASS, NOTE}, results
    names = {one.check for one in results}
    if name == "GroundSG-oracle":
        assert names == {"loads"}
    else:
        assert {"deterministic", "reset forgets", "expert"} <= names
