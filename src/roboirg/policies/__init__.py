"""Policies: the contract, the built-in ones, and how a name becomes one."""
