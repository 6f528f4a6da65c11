"""Values that JSON can express."""

import json
import math

from firstfix.core.json_values import finite


def test_nan_and_infinity_become_null_at_any_depth() -> None:
    value = {"a": [math.nan, {"b": -math.inf}], "c": "nan", "d": 1.5, "e": None}
    assert finite(value) == {"a": [None, {"b": None}], "c": "nan", "d": 1.5, "e": None}
    json.dumps(finite(value), allow_nan=False)
