"""Global localization: one scan, the whole map, no motion."""
