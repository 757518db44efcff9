"""Shortcuts: how far rules and models come that see the words only, and understand none of them.

A rule guesses a goal from the words alone, by their position or key words (`surface_rules`,
`text_guess`); models learn from the words or from the scene alone (`goal_learner`).
"""
