"""The splits: the episodes of the benchmark, and fingerprints that detect changes."""

from roboirg.tasks.splits.splits import get_episode, split_episodes

__all__ = ["get_episode", "split_episodes"]
