"""Words from outside: the commands of others, from a wording file."""
