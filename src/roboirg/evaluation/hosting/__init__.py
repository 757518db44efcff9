"""Policies in a process of their own, which plays the episodes of many worlds at once.

| part | runs in | content |
| --- | --- | --- |
| `hosted_policy` | the world's process | a policy whose methods are calls to its host |
| `host_pool`, `policy_host` | the supervisor | queues, batches, deadlines, attribution |
| `policy_child` | the supervisor | one policy process: start, exchange messages, end |
| `host_process` | the policy's process | carries out the calls; holds no world |
| `messages` | all | schema of the messages and how they travel; nothing is ever unpickled |
"""
