"""One policy, the same outcomes in our runner and in `gymnasium.make_vec`."""

import pytest
from page_commands import blocks, read_verdicts, replaced, run_page
from replay_table import (
    MANY,
    MAX_STEPS,
    MESHES,
    in_batches_of,
)

pytestmark = pytest.mark.sim

MODES = {
    "async": '"async", vector_kwargs=spawned',
    "sync": '"sync"',
}
BATCHES = [(2, "async")]
if MANY:
    BATCHES = [(count, mode) for count in (1, 2, 8) for mode in MODES]

MY_POLICY = """
import os
import numpy as np
from replay_table import Replay

class MyPolicy:
    def reset(self, instructions, demonstration):
        self.instructions, self.players = instructions, None

    def act(self, observations):
        if self.players is None:
            replay = Replay(os.environ["REPLAY_TABLE"])
            self.players = list(map(replay.play, observations["front_rgb"], self.instructions))
        return np.stack([next(player) for player in self.players])
"""


@pytest.fixture(params=BATCHES)
def verdicts(table, request, tmp_path):
    """What the page's program writes of each episode, with a policy that plays recorded actions.

    The episodes are put into the program, how many are played at a time, in processes of their own
    ("async") or not, and options of the environment.
    """
    count, mode = request.param
    options = (
        f"setting=SETTING, cameras=('front',), meshes={MESHES!r}, "
        f"max_steps={MAX_STEPS}, demonstration_frames='none'"
    )
    values = in_batches_of(count) | {"setting=SETTING": options, MODES["async"]: MODES[mode]}
    (program,) = blocks("Gymnasium", "python")
    (tmp_path / "play.py").write_text(replaced(program, values))
    (tmp_path / "my_policy.py").write_text(MY_POLICY)
    run_page("Gymnasium", tmp_path, {}, REPLAY_TABLE=str(table))
    return read_verdicts(tmp_path)


@pytest.mark.slow
def test_gymnasium_and_our_runner_agree_on_success_and_steps_of_each_episode(verdicts, ours):
    """`verdicts` is what the documented program wrote: it plays a policy of recorded actions, some
    of them cut short so that they fail, in `gymnasium.make_vec`, in the setting "contextual".

    `ours` are outcomes of our runner with the same actions in the same episodes: task, episode,
    whether it succeeded, and its steps.
    """
    found = []
    for verdict in verdicts:
        assert verdict["setting"] == "contextual"
        found.append((verdict["task"], verdict["episode"], verdict["success"], verdict["steps"]))

    assert sorted(found) == sorted(ours)
