"""A listener that learns: words and pictures to slots, without privileged facts. Needs PyTorch."""
