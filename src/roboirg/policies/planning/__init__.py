"""Vision-language models behind policies: planners, and listeners that say what is meant.

| part | what it is |
| --- | --- |
| `content`, `models/` | pictures, clips and words to a model of any provider, and its reply |
| `asking`, `prompts` | one question with one retry, what it cost, and our own words as data |
| `slots`, `listener` | what is meant as structured output; the oracle's hands do it |
| `planners/`, `planned` | subgoals in front of a policy that follows them |
| `specs`, `systems` | how a name on the command line becomes one of these |
"""
