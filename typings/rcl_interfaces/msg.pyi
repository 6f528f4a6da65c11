class FloatingPointRange:
    def __init__(self, *, from_value: float, to_value: float, step: float) -> None: ...

class IntegerRange:
    def __init__(self, *, from_value: int, to_value: int, step: int) -> None: ...

class SetParametersResult:
    successful: bool
    reason: str
    def __init__(self, *, successful: bool, reason: str = "") -> None: ...

class ParameterDescriptor:
    floating_point_range: list[FloatingPointRange]
    integer_range: list[IntegerRange]
    def __init__(
        self,
        *,
        description: str = "",
        additional_constraints: str = "",
        dynamic_typing: bool = False,
    ) -> None: ...
