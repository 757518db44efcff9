"""The paper's experiment on the small body: every memory crossed with every reader of words."""
