"""The settings of the dynamic stage, as a command line gives them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from firstfix.amcl.config import AmclConfig


def load_config(params: Path | None) -> AmclConfig:
    """Return the settings of a parameter file of Nav2; its defaults without one."""
    from firstfix.amcl.config import AmclConfig

    if params is None:
        return AmclConfig()
    from firstfix.formats.amcl_yaml import load_amcl_config

    return load_amcl_config(params)


def seed_of(config: AmclConfig, seed: int | None) -> int:
    """Return the seed asked for, else that of the settings; a negative one means 0 there."""
    return max(0, config.random_seed) if seed is None else seed
