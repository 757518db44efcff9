"""Vision-language models behind policies: queries to any provider, and listeners.

| part | content |
| --- | --- |
| `model_content`, `models/` | pictures, clips and words to a model of any provider, and its reply |
| `vlm_query`, `prompts` | one query with one retry, its cost, and our own words as data |
| `goal_schema`, `vlm_listener` | goals as structured output, executed by the scripted expert |
"""
