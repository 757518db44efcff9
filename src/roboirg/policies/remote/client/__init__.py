"""The client of remote policies: connections, their deadlines, and a lock on the server."""
