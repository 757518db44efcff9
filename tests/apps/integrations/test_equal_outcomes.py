"""One policy, the same outcomes: in our runner, `gymnasium.make_vec`, and LeRobot's batches."""

import numpy as np
import pytest
from page_commands import blocks, read_verdicts, replaced, run_page
from replay_table import (
    EPISODES,
    MANY,
    MAX_STEPS,
    MESHES,
    SETTING,
    TASKS,
    Replay,
    in_batches_of,
)

from roboirg.apps.integrations.lerobot.vector import make_batch

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
    values = {
        **in_batches_of(count),
        "setting=SETTING": f"setting=SETTING, cameras=('front',), meshes={MESHES!r}, "
        f"max_steps={MAX_STEPS}, demonstration_frames='none'",
        MODES["async"]: MODES[mode],
    }
    (program,) = blocks("Gymnasium", "python")
    (tmp_path / "play.py").write_text(replaced(program, values))
    (tmp_path / "my_policy.py").write_text(MY_POLICY)
    run_page("Gymnasium", tmp_path, {}, REPLAY_TABLE=str(table))
    lines = read_verdicts(tmp_path)
    assert [one["setting"] for one in lines] == [SETTING] * EPISODES
    found = [(one["task"], one["episode"], one["success"], one["steps"]) for one in lines]
    assert sorted(found) == sorted(ours)


@pytest.mark.slow
def test_lerobot_s_batches_have_them_too(table, ours):
    count, replay, found = 2, Replay(table), []
    options = {
        "setting": SETTING, "cameras": ("front",), "meshes": MESHES, "max_steps": MAX_STEPS,
    }  # fmt: skip
    env = make_batch(TASKS[0], count, True, options)
    for start in range(0, 4, count):
        seeds = [1000 + start + index for index in range(count)]
        observation, _ = env.reset(seed=seeds, options={"lerobot_new_rollout": True})
        seen = zip(observation["pixels"]["front"], env.call("task_description"), strict=True)
        players = [replay.play(*one) for one in seen]
        done, success, steps = (np.zeros(count, kind) for kind in (bool, bool, int))
        while not done.all():
            actions = np.stack([next(player) for player in players]).astype(np.float32)
            _, _, terminated, truncated, infos = env.step(actions)
            steps += ~done
            if "final_info" in infos:  # where LeRobot 0.4 looks; later ones look there first
                success |= infos["final_info"]["is_success"] & ~done
            done |= terminated | truncated
        found += list(zip(success.tolist(), steps.tolist(), strict=True))
    env.close()
    assert found == [(success, steps) for _, _, success, steps in ours[:4]]
