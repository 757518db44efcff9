"""Verdicts of two versions of a policy's server do not get into one folder, table or merge."""

import pytest
from made_records import make_record
from wire_servers import ChallengeServer

from roboirg.policies import make_policy
from roboirg.policies.contract.policy_calls import server_version
from roboirg.policies.planners.hierarchical_policy import HierarchicalPolicy
from roboirg.records.record_codec import StoreError
from roboirg.records.store import read_records
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.run.executor import InProcess
from roboirg.runs.run.runner import run_plan


def plan_of_episodes(episodes, **options):
    few = {"tasks": "PickXtimes", "settings": "explicit", "episodes": episodes}
    return make_plan("random", **few, **options)


class PlaysWithServerVersions:
    """Plays jobs with a server that tells these versions, one for each episode."""

    def __init__(self, *versions):
        self.versions = list(versions)

    def __call__(self, job):
        version = self.versions.pop(0)
        if version == "refused":
            return make_record(job, cause="connection: refused", error="connection")
        metadata = {"server": "localhost:1"} | ({} if version is None else {"version": version})
        told = server_version(metadata)
        return make_record(job, "success", policy_metadata=metadata, server_version=told)


def stored_server_versions(folder):
    return [record.server_version for record in read_records(folder)]


def test_a_run_stops_when_its_policys_server_reports_another_version(tmp_path):
    """The third of four episodes is answered by version b instead of a; it is not stored."""
    plan = plan_of_episodes(4)

    with pytest.raises(StoreError, match=r"whose server version is a, but in random-.* it is b"):
        run_plan(plan, tmp_path, PlaysWithServerVersions("a", "a", "b", "a"), InProcess())

    assert stored_server_versions(tmp_path) == ["a", "a"]


@pytest.mark.parametrize(("other", "words"), [("b", "b"), (None, "none")])
def test_a_run_goes_on_with_the_same_version_of_the_server_alone(tmp_path, other, words):
    """Neither with version b instead of a, nor with a server that does not tell its version."""
    plan = plan_of_episodes(2)
    with pytest.raises(StoreError):
        run_plan(plan, tmp_path, PlaysWithServerVersions("a", "b"), InProcess())

    with pytest.raises(
        StoreError, match=f"server version is a, but in .* it is {words}; choose another"
    ):
        run_plan(plan, tmp_path, PlaysWithServerVersions(other), InProcess())

    run_plan(plan, tmp_path, PlaysWithServerVersions("a"), InProcess())
    assert stored_server_versions(tmp_path) == ["a", "a"]


def test_a_server_version_with_terminal_codes_is_stored_escaped(tmp_path):
    """ "\\x1b[2J" would clear the terminal of whoever prints the record."""
    run_plan(
        plan_of_episodes(2),
        tmp_path,
        PlaysWithServerVersions(*["\x1b[2J\u202e" + "9" * 5000] * 2),
        InProcess(),
    )
    assert {version[:12] for version in map(str, stored_server_versions(tmp_path))} == {
        r"\x1b[2J\u202e"[:12]
    }


def test_an_episode_without_a_connection_has_no_server_version_that_could_differ(tmp_path):
    plan = plan_of_episodes(3, tries=1)
    run_plan(plan, tmp_path, PlaysWithServerVersions("refused", "a", "refused"), InProcess())
    assert stored_server_versions(tmp_path) == ["a"] * 3


class PlannerWithVersion:
    """A planner of this process."""

    version = "7"
    metadata = {"version": "7"}  # noqa: RUF012

    def reset(self, instruction, demonstration):
        pass


def test_the_server_version_is_that_of_the_server_and_not_of_its_client_or_planner():
    """The server says "phase-1"; the client was given version "mine", and the planner has "7"."""
    with ChallengeServer() as server:
        client = make_policy(f"challenge://{server.place}?version=mine", 0)
        client.reset("go", {})
        client.follow = print
        system = HierarchicalPolicy(PlannerWithVersion(), client)

        versions = [server_version(client.metadata), server_version(system.metadata)]

        client.close()
    assert versions == ["phase-1", "phase-1"]


@pytest.mark.parametrize(
    "metadata",
    [{}, {"version": "1"}, {"server": "x"}, {"server": "x", "version": "unknown"}],
    ids=["nothing", "a version without a server", "no version", "an unknown version"],
)
def test_metadata_without_a_server_and_its_version_give_no_server_version(metadata):
    assert server_version(metadata) is None
