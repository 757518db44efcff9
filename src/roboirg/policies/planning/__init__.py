"""Vision-language models behind policies: planners, and listeners that name the goal.

| part | content |
| --- | --- |
| `model_content`, `models/` | pictures, clips and words to a model of any provider, and its reply |
| `vlm_query`, `prompts` | one query with one retry, its cost, and our own words as data |
| `goal_schema`, `vlm_listener` | goals as structured output, executed by the scripted expert |
| `planners/`, `hierarchical_policy` | subgoals for a policy that follows them |
| `policy_specs`, `systems` | from a name on the command line to one of these policies |
"""
