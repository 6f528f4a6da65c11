"""What names and parameters can be wrong with."""


class NameValidationException(Exception):
    """Of all names."""


class InvalidTopicNameException(NameValidationException):
    """Of topics."""


class ParameterException(Exception):
    """Of all of them."""


class ParameterAlreadyDeclaredException(ParameterException):
    """Declared twice."""


class InvalidParameterTypeException(ParameterException):
    """Of another type than its default."""


class InvalidParameterValueException(ParameterException):
    """Out of range."""
