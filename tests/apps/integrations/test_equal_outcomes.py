"""One policy, the same outcomes in our runner and in `gymnasium.make_vec`."""

import pytest
from page_commands import blocks, read_verdicts, replaced, run_page
from replay_table import (
    MANY,
    MAX_STEPS,
    MESHES,
    SETTING,
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
            seen = zip(observations["front_rgb"], self.instructions, strict=True)
            self.players = [replay.play(*one) for one in seen]
        return np.stack([next(player) for player in self.players])
"""


@pytest.mark.slow
@pytest.mark.parametrize(("count", "mode"), BATCHES)
def test_the_page_s_program_has_the_outcomes_of_our_runner(table, ours, tmp_path, count, mode):
    """The program is that of the page, but for the size of batches and the options of `ours`."""
    replacements = in_batches_of(count)
    replacements["setting=SETTING"] = (
        f"setting=SETTING, cameras=('front',), meshes={MESHES!r}, "
        f"max_steps={MAX_STEPS}, demonstration_frames='none'"
    )
    replacements[MODES["async"]] = MODES[mode]
    (program,) = blocks("Gymnasium", "python")
    (tmp_path / "play.py").write_text(replaced(program, replacements))
    (tmp_path / "my_policy.py").write_text(MY_POLICY)

    run_page("Gymnasium", tmp_path, {}, REPLAY_TABLE=str(table))

    verdicts = read_verdicts(tmp_path)
    outcomes = [
        (line["task"], line["episode"], line["success"], line["steps"]) for line in verdicts
    ]
    assert sorted(outcomes) == sorted(ours)
    assert {line["setting"] for line in verdicts} == {SETTING}
