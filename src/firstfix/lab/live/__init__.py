"""A simulated robot that people steer on the live page."""
