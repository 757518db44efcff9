"""The instructions examined: validation, statistics, the card, exports, and others' sentences."""
