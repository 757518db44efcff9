"""A policy of this process behind a real socket."""

import threading
from contextlib import contextmanager

from roboirg.policies.policy_server import open_server
from roboirg.policies.remote.websocket_server import ServerOptions


@contextmanager
def served(spec, protocol, *, seed=0, **options):
    """Serve a policy while the block runs; yield its URL."""
    server = open_server(spec, protocol, ServerOptions(**options), seed=seed)
    thread = threading.Thread(target=server.listening.serve_forever)
    thread.start()
    try:
        yield server.url
    finally:
        server.listening.shutdown()
        thread.join()
