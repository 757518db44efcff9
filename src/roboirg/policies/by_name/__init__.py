"""From the name of a policy on the command line to the policy."""
