"""The static stage: one scan, the whole map, no motion."""
