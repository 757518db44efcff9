"""Plans of runs: which policies play which episodes, from options and files."""
