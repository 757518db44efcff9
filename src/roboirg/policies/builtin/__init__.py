"""Built-in policies: oracle, language baselines and random actions."""
