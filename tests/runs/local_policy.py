"""A policy whose module cannot be imported on the bad machine of a cluster."""

import os

from ray_fakes import BAD_MACHINE

if os.environ.get(BAD_MACHINE):
    raise ModuleNotFoundError("No module named 'their_model'")


class Local:
    """Is never asked."""

    def reset(self, instruction, demonstration):
        """Begin."""

    def act(self, observation):
        """Hold still."""
        return [[0.0] * 8]
