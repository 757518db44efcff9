"""What remote policies share: endpoints, server locks, connections and the message codec."""
