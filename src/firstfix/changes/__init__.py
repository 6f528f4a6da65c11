"""What scans of a localized robot contradict in its map."""
