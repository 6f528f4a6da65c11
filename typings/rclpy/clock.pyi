from builtin_interfaces.msg import Time as TimeMessage

class Time:
    def to_msg(self) -> TimeMessage: ...

class Clock:
    def now(self) -> Time: ...
