"""What Inspect finds through the entry point ``roboirg`` of the group ``inspect_ai``.

Inspect imports this for every look-up, so it must not import the simulator.
"""

from roboirg.apps.integrations.inspect.listener_task import (
    grounds_reference,
    listener,
    play_with_model,
)

__all__ = ["grounds_reference", "listener", "play_with_model"]
