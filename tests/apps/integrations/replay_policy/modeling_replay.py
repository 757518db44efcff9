"""The replaying policy."""

import numpy as np
import torch
from lerobot.policies.pretrained import PreTrainedPolicy
from replay_table import Replay

from replay_policy.configuration_replay import ReplayConfig

FRONT = "observation.images.front"


class ReplayPolicy(PreTrainedPolicy):
    """Repeats the recording of each row of a batch."""

    config_class = ReplayConfig
    name = "replay"

    def __init__(self, config, **kwargs):
        super().__init__(config)
        self.config = config
        self.unused = torch.nn.Parameter(torch.zeros(1))
        self.replay = Replay(config.table)
        self.reset()

    def reset(self):
        self.players = {}

    def select_action(self, batch, **kwargs):
        actions = []
        for index, text in enumerate(batch["task"]):
            if index not in self.players:
                picture = (batch[FRONT][index] * 255).round().byte().permute(1, 2, 0).numpy()
                self.players[index] = self.replay.play(picture, text)
            actions.append(next(self.players[index]))
        return torch.from_numpy(np.stack(actions))

    def predict_action_chunk(self, batch, **kwargs):
        raise NotImplementedError

    def forward(self, batch):
        raise NotImplementedError

    def get_optim_params(self):
        return {}
