"""Any policy of this process behind a network connection."""

from roboirg.policies.serving.server import PROTOCOLS, PolicyServer, open_server

__all__ = ["PROTOCOLS", "PolicyServer", "open_server"]
