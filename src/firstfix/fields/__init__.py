"""Fields that the map alone determines, computed once per map."""
