"""RoboIRGBench for LeRobot's EnvHub: put this file into a repository of the Hub.

``lerobot.envs.make_env("org/repo@commit", n_envs=8, trust_remote_code=True)`` downloads this file
alone; `roboirgbench` must be installed. The Hub passes no options, so they come from the
environment: ``ROBOIRG_HUB_OPTIONS='{"task": "PickXtimes", "setting": "spatial"}'``.
"""

import json
import os
from typing import Any

from roboirg.apps.integrations.lerobot.vector import make_batch


def make_env(n_envs: int = 1, use_async_envs: bool = False, cfg: object = None) -> Any:  # noqa: ANN401, ARG001
    """Return a vector environment of one task; see `LeRobotSubEnvironment` for the options."""
    options = json.loads(os.environ.get("ROBOIRG_HUB_OPTIONS", "{}"))
    return make_batch(options.pop("task", "PickXtimes"), n_envs, use_async_envs, options)
