"""``python -m firstfix``."""

from firstfix.cli.app import main

main()
