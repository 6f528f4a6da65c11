"""What the map knows, computed once per map."""
