"""Recordings: bags, CARMEN logs, .npz, TUM trajectories."""
