"""Policies in a process of their own, which plays the episodes of many worlds at once.

| part | runs in | content |
| --- | --- | --- |
| `hosted_policy`, `policy_line` | the world's process | a policy whose methods call its process |
| `host_pool`, `policy_child` | the supervisor | starts and ends processes, passes on lines |
| `host_process` | the policy's process | queues and carries out the calls; holds no world |
| `messages` | all | schema of the messages and how they travel; nothing is ever unpickled |
"""
