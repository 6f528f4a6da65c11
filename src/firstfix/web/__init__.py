"""The live page and the HTTP API: see docs/live.md."""
