"""One episode, played by a policy: the calls, their limits, the record and the video."""
