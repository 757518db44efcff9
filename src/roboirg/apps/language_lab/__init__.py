"""The instructions examined: statistics, scenarios, exports, and others' sentences."""
