"""Pools of wordings: the words of training and validation, and those held out for tests.

A policy that was trained on our words should not be tested in the very same sentences. Training
and validation episodes speak from one pool, all others from the other; no wording is in both.
"""

from __future__ import annotations

from typing import Literal, get_args

PoolName = Literal["train", "test"]
POOLS: tuple[PoolName, ...] = get_args(PoolName)
ROBOMME_NAME = "robomme"
"""Name of the wordings with RoboMME's sentences, before the @ of their identity."""
TRAINING_SPLITS = ("train", "val")
"""The splits whose words a policy may have been trained on."""


def pool_of(split: str, wordings: str | None = None) -> PoolName:
    """Return the pool from which the words for an episode of a split are taken.

    `wordings` is a pool that was chosen, which wins; or the identity of a wording file or None,
    which leave it to the split: train and val -> ``"train"``, any other -> ``"test"``.
    """
    for pool in POOLS:
        if wordings == pool:
            return pool
    return "train" if split in TRAINING_SPLITS else "test"


def outside_words(wordings: str | None) -> str | None:
    """Return the identity of a wording file; None for our own words, of whatever pool."""
    return None if wordings in POOLS else wordings


def words_label(wordings: str | None) -> str:
    """Return whose words instructions have, from a pool or the identity of a wording file."""
    if wordings is None:
        return "our own words"
    if wordings in POOLS:
        return f"our own words for {wordings}"
    return f"the words of {wordings}"
