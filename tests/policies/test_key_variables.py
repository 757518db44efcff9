"""Which secrets of the environment a policy of others gets."""

import os

import pytest

from roboirg.policies.by_name.finding import read_policy
from roboirg.policies.by_name.key_variables import environment_for

SECRETS = (
    *("GOOGLE_API_KEY", "OPENAI_API_KEY", "LAB_KEY", "HF_TOKEN", "MY_PASSWORD", "AWS_SECRET"),
    *("HF_TOKENS", "OPENAI_API_KEY2", "HTTP_AUTHORIZATION", "MY_CREDS", "SESSION_COOKIE", "DB_PW"),
)


@pytest.fixture(autouse=True)
def _secrets(monkeypatch):
    for name in SECRETS:
        monkeypatch.setenv(name, "secret")


@pytest.mark.parametrize(
    ("spec", "kept"),
    [
        ("mine:It", set()),
        ("planner:mine:Planner", set()),
        ("planner:stateless?model=m&hands=mine:It", {"OPENAI_API_KEY"}),
        ("planner:stateless?model=m&provider=google&hands=mine:It", {"GOOGLE_API_KEY"}),
        ("planner:stateless?model=m&base_url=http://here&hands=mine:It", set()),
        ("planner:stateless?model=m&api_key_env=LAB_KEY&hands=mine:It", {"LAB_KEY"}),
        ("planner:mine:Planner?hands=openpi://here:1?api_key_env=LAB_KEY", {"LAB_KEY"}),
        ("lerobot://some/checkpoint", {"HF_TOKEN"}),
    ],
)
def test_a_policy_process_gets_only_the_secrets_that_it_needs_or_that_a_user_names(spec, kept):
    """Code of others ("mine:It") gets none; our model clients and LeRobot get their own key.

    MY_PASSWORD is the one that the user names.
    """
    found = environment_for(read_policy(spec).hosted_part, ("MY_PASSWORD",))
    assert found.keys() & set(SECRETS) == {*kept, "MY_PASSWORD"}
    assert found["PATH"] == os.environ["PATH"]
