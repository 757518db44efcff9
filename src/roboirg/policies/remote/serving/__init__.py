"""Any policy of this process behind a network connection."""
