"""Listeners that learn: training, their policy, and a study of what words and pictures bring."""
