"""Check the records of a run: play their actions again, without the policy."""
