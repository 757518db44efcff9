"""Pages and their servers: connections, requests, keys and templates."""
