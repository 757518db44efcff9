"""Applications: each holds its commands, and may be left out of an installation.

An application is a folder. It imports anything below the applications and no other one; its file
`commands` has ``add_commands(app)``, which adds its commands to those of `roboirg`.
"""
