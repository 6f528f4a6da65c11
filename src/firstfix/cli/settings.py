"""The settings of the dynamic stage, as a command line gives them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from firstfix.amcl.config import AmclConfig


def load_config(params: Path | None, seed: int | None) -> AmclConfig:
    """Return the settings of a parameter file of Nav2, its defaults without one.

    Parameters
    ----------
    params : Path or None
        The file.
    seed : int or None
        Takes the place of random_seed where it is given.

    Returns
    -------
    AmclConfig
        The settings.

    Raises
    ------
    InputError
        If the file cannot be used.
    """
    from firstfix.amcl.config import AmclConfig

    config = AmclConfig()
    if params is not None:
        from firstfix.io.parameters.amcl_yaml import load_amcl_config

        config = load_amcl_config(params)
    return config if seed is None else replace(config, random_seed=seed)
