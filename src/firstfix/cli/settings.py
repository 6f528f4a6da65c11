"""The parameters of filter and node, as a command line gives them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from firstfix.ros.node_config import NodeConfig


def load_config(params: Path | None, seed: int | None) -> NodeConfig:
    """Return the parameters in a file of Nav2, section ``amcl``; the defaults without a file.

    Parameters
    ----------
    params : Path or None
        The file.
    seed : int or None
        Replaces random_seed where it is given.

    Returns
    -------
    NodeConfig
        The parameters.

    Raises
    ------
    InputError
        If the file cannot be used.
    """
    from firstfix.ros.node_config import NodeConfig
    from firstfix.ros.parameters import load_node_config

    config = NodeConfig() if params is None else load_node_config(params)
    if seed is None:
        return config
    amcl = replace(config.localizer.amcl, random_seed=seed)
    return replace(config, localizer=replace(config.localizer, amcl=amcl))
