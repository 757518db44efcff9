"""What the replaying policy plays, made once in the environment of each harness."""

import pytest
from replay_table import own_outcomes, record_table


@pytest.fixture(scope="session")
def table(tmp_path_factory):
    """Path of the table of recorded actions."""
    path = tmp_path_factory.mktemp("replay") / "table.npz"
    record_table(path)
    return path


@pytest.fixture(scope="session")
def checkpoint(table, tmp_path_factory):
    """Folder of a checkpoint of LeRobot that plays the table."""
    from replay_checkpoint import save_checkpoint  # needs LeRobot

    folder = tmp_path_factory.mktemp("checkpoint")
    save_checkpoint(folder, table)
    return folder


@pytest.fixture(scope="session")
def ours(table):
    """What our own runner says of the table: task, episode, whether it succeeded, steps."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("REPLAY_TABLE", str(table))
        return own_outcomes("replay_table:ReplayPolicy")
