"""In a study with a robot a policy executes all 20 actions that it predicts, as in the paper."""

import pytest

from roboirg.apps.real.control.robot import HORIZON
from roboirg.apps.real.study.study_run import at_horizon
from roboirg.core.errors import UnknownNameError
from roboirg.policies import make_policy


@pytest.mark.parametrize("name", ["pi0.5", "FrameS-Modul"])
@pytest.mark.parametrize("options", ["", "?server=box:8001"])
def test_the_papers_systems_execute_what_they_predict(name, options):
    spec = f"system:{name}{options}"
    assert make_policy(spec, 0).options.execute == 16
    assert make_policy(at_horizon(spec), 0).options.execute == HORIZON == 20
    assert at_horizon(at_horizon(spec)) == at_horizon(spec)


def test_planned_systems_do_so_too():
    spec = at_horizon("system:GroundSG-QwenVL?server=box:8001")
    assert spec == "system:GroundSG-QwenVL?server=box:8001&policy.execute=20"
    assert at_horizon("mme-vla://box:8001?history=no") == "mme-vla://box:8001?history=no&execute=20"


@pytest.mark.parametrize(
    "spec",
    ["system:pi0.5?policy.execute=8", "mme-vla://box:1?execute=4", "system:TTT-Expert",
     "openpi://box:8000", "listener", "my_lab.policies:Mine", "base"],
)  # fmt: skip
def test_what_names_a_number_or_executes_all_is_left_alone(spec):
    assert at_horizon(spec) == spec


def test_an_unknown_system_is_named():
    with pytest.raises(UnknownNameError, match="FrameS-Modu'"):
        at_horizon("system:FrameS-Modu")
