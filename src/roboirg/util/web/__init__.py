"""Pages and their servers: connections, requests, keys and what the pages share."""
