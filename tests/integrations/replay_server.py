"""The replaying policy as a model server of vla-eval; writes down all that it is told.

Usage: ``python replay_server.py TABLE PORT LOG``.
"""

import json
import sys

from replay_table import Replay
from vla_eval.model_servers.predict import PredictModelServer
from vla_eval.model_servers.serve import serve
from vla_eval.specs import IMAGE_RGB, LANGUAGE, DimSpec


class ReplayServer(PredictModelServer):
    """Repeats the recording of each episode."""

    def __init__(self, table, log):
        super().__init__()
        self.replay, self.log, self.rows = Replay(table), log, {}

    def predict(self, obs, ctx):
        if ctx.session_id not in self.rows:
            begun = self.replay.begin(obs["images"]["agentview"], obs["task_description"])
            self.rows[ctx.session_id] = [begun, None]
        entry = self.rows[ctx.session_id]
        entry[1] = self.replay.next_row(*entry)
        self.tell("observation", sorted(obs))
        return {"actions": entry[1]}

    async def on_episode_start(self, config, ctx):
        self.rows.pop(ctx.session_id, None)
        self.tell("start", config)
        await super().on_episode_start(config, ctx)

    async def on_episode_end(self, result, ctx):
        self.tell("end", result)
        await super().on_episode_end(result, ctx)

    def tell(self, kind, content):
        with open(self.log, "a") as file:  # noqa: PTH123
            file.write(json.dumps([kind, content], default=str) + "\n")

    def get_action_spec(self):
        return {"action": DimSpec("action", 8, "absolute_joint_angle_gripper")}

    def get_observation_spec(self):
        return {"agentview": IMAGE_RGB, "language": LANGUAGE}


if __name__ == "__main__":
    serve(ReplayServer(sys.argv[1], sys.argv[3]), host="127.0.0.1", port=int(sys.argv[2]))
