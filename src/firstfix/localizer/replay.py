"""Running a localizer over recorded inputs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from firstfix.localizer.inputs import Input
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import Output


def replay(inputs: Iterable[Input], localizer: Localizer) -> Iterator[tuple[Input, list[Output]]]:
    """Pass inputs to a localizer, one after the other.

    Parameters
    ----------
    inputs : iterable of Input
        In the order of their stamps, such as ``recording.messages()``.
    localizer : Localizer
        It continues from its present state.

    Yields
    ------
    tuple of Input and list of Output
        Each input with its outputs.
    """
    for given in inputs:
        yield given, localizer.handle(given)
