"""The replaying policy as a model server of vla-eval; writes down all that it is told.

Usage: ``python replay_server.py TABLE PORT LOG BATCH``.
"""

import json
import sys

from replay_table import Replay
from vla_eval.model_servers.predict import PredictModelServer
from vla_eval.model_servers.serve import serve
from vla_eval.specs import IMAGE_RGB, LANGUAGE, DimSpec


class ReplayServer(PredictModelServer):
    """Repeats the recording of each episode."""

    def __init__(self, table, log, batch):
        super().__init__(max_batch_size=batch)
        self.replay = Replay(table)
        self.log = log
        self.players = {}

    def predict_batch(self, obs_batch, ctx_batch):
        return [self.answer(*question) for question in zip(obs_batch, ctx_batch, strict=True)]

    def answer(self, obs, ctx):
        if ctx.session_id not in self.players:
            picture = obs["images"]["agentview"]
            words = obs["task_description"]
            self.players[ctx.session_id] = self.replay.play(picture, words)
        self.tell("observation", sorted(obs))
        return {"actions": next(self.players[ctx.session_id])}

    async def on_episode_start(self, config, ctx):
        self.players.pop(ctx.session_id, None)
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
    table, port, log, batch = sys.argv[1:]
    serve(ReplayServer(table, log, int(batch)), host="127.0.0.1", port=int(port))
