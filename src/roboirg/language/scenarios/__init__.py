"""Scenarios: whole utterances that people say, from data files.

A scenario is one utterance with slots: a reason for the act, more of that reason, a remark that
wanders off from there, a cue that returns, and words that lead to the command. Its sentences belong
together and are never exchanged with those of another one. `docs/add-scenario.md` is for authors.

The words of an episode are its context, a lead, and the task's command, in which words that point
back take the place of values. The command is drawn for the episode, so it is the same in all
settings; explicit is the command alone; the resolved form has the values in the command.

=================  ===============================================================================
``pointers``       the closed table of all expressions that point back
``general``        people, and remarks about anything
other ``.toml``    commands and scenarios of the tasks that name the file as their `words`
``markup``         the marks in a sentence
``scenario``       the fields of the files; ``scenario_file`` reads and checks them, with what
                   ``scenario_needs`` says that a scenario needs
``relations``      how a number or a position can follow from another one
``derived``        how the goal of an episode can follow from something else
``content_plans``  the ways to say a goal without naming it
``choice``         what is said: a scenario, and the content plan that it puts into words
``declared``       what the words for a field mean: the term of a pointer
``amounts``        the fields of the goal that a scenario leaves open, and what they follow from
``fillers``        the values that the words name
``realizer``       the words of one scenario
``spoken``         the words of an episode
``identity``       which words they are, by a digest
=================  ===============================================================================
"""
