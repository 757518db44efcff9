"""Any policy of this process behind a network connection."""

from roboirg.policies.serving.policy_server import PROTOCOLS, PolicyServer, open_server

__all__ = ["PROTOCOLS", "PolicyServer", "open_server"]
