"""What lines of a plot look like, and the curve of a share."""

import math

from numpy.testing import assert_array_equal

from firstfix.evaluation.figure import PALETTE, line_style, share_curve


def test_no_two_lines_of_a_plot_look_alike() -> None:
    looks = {tuple(line_style(number).values()) for number in range(4 * len(PALETTE))}
    assert len(looks) == 4 * len(PALETTE)
    assert line_style(0) == line_style(4 * len(PALETTE))


def test_a_share_counts_what_is_not_known_and_what_is_off_the_axis() -> None:
    x, y = share_curve([2.0, math.inf, 0.001, 50.0], 0.1, 10.0)
    assert_array_equal(x, [0.1, 0.1, 2.0, 10.0, 10.0])
    assert_array_equal(y, [0.0, 0.25, 0.5, 0.75, 0.75])
    assert_array_equal(share_curve([math.inf], 0.1, 10.0), [[0.1, 10.0], [0.0, 0.0]])
