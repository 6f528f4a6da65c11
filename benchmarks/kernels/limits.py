"""Limits of this machine: reference loops, timed alternately with the kernels.

A limit is an amount of work a nanosecond. Limits of memory belong to a working set: they are
measured on so many bytes, so that they hold for the cache which these bytes live in.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from compiled import compiled
from numpy.typing import NDArray

# What is measured on fewer bytes, or more, is measured on so many.
SMALLEST, LARGEST = 16 * 1024, 256 * 1024 * 1024

# So often arithmetic goes over its 4 KiB in a call, and reading over as many bytes as this.
_TIMES = 16
_AT_LEAST = 1024 * 1024


_Number = np.integer[Any] | np.floating[Any]
_INTEGERS: dict[str, type[np.integer[Any]]] = {
    "u8": np.uint8,
    "u16": np.uint16,
    "i32": np.int32,
    "i64": np.int64,
}


@dataclass(frozen=True, eq=False)
class Limit:
    """Something this machine does, over and over.

    Parameters
    ----------
    name : str
        What it does, with the unit of ``amount``.
    amount : float
        How much of it a call does.
    call : callable
        Does it.
    """

    name: str
    amount: float
    call: Callable[[], object]


@cache
def cache_sizes() -> dict[str, int]:
    """Bytes of this processor's data caches, by level, as reported by Linux."""
    sizes: dict[str, int] = {}
    for entry in sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        if (entry / "type").read_text().strip() != "Instruction":
            size = (entry / "size").read_text().strip()
            sizes["L" + (entry / "level").read_text().strip()] = int(size.rstrip("K")) * 1024
    return sizes


def level_of(size: float) -> str:
    """Smallest cache that so many bytes fit into, or DRAM."""
    fitting = [level for level, room in cache_sizes().items() if size <= room]
    return fitting[0] if fitting else "DRAM"


def _rounded(size: float) -> int:
    return min(LARGEST, max(SMALLEST, 1 << round(math.log2(size))))


def read(size: float) -> Limit:
    """Bytes read in order."""
    return _read(_rounded(size))


def copy(size: float) -> Limit:
    """Bytes read and bytes written in order, together; as many of the one as of the other."""
    return _copy(_rounded(size))


def runs(size: float) -> Limit:
    """Bytes read and added in runs of 64 that begin anywhere, in no order."""
    return _runs(_rounded(size))


def gather(size: float) -> Limit:
    """Four-byte words read in no order, addresses known beforehand."""
    return _gather(_rounded(size))


def chase(size: float) -> Limit:
    """Four-byte words read in no order, each telling the address of the next."""
    return _chase(_rounded(size))


def _name(what: str, size: int) -> str:
    return f"{what}, {size >> 10} KiB" if size < 1 << 20 else f"{what}, {size >> 20} MiB"


@cache
def _read(size: int) -> Limit:
    values = np.ones(size // 8, np.int64)
    times = max(1, _AT_LEAST // size)
    return Limit(_name("bytes read", size), size * times, lambda: _sum(values, times))


@cache
def _copy(size: int) -> Limit:
    source, target = np.ones(size // 16, np.int64), np.ones(size // 16, np.int64)
    times = max(1, _AT_LEAST // size)
    return Limit(_name("bytes copied", size), size * times, lambda: _add_one(source, target, times))


@cache
def _runs(size: int) -> Limit:
    values = np.ones(size, np.uint8)
    starts = np.random.default_rng(0).integers(0, size - 64, 8192).astype(np.uint64)
    total = np.zeros(64, np.uint8)
    return Limit(
        _name("bytes in runs", size), 64 * starts.size, lambda: _add_runs(values, starts, total)
    )


@cache
def _gather(size: int) -> Limit:
    values = np.ones(size // 4, np.int32)
    places = np.random.default_rng(0).integers(0, values.size, 65536).astype(np.uint32)
    return Limit(_name("random reads", size), places.size, lambda: _sum_at(values, places))


@cache
def _chase(size: int) -> Limit:
    order = np.random.default_rng(0).permutation(size // 4).astype(np.int32)
    following = np.empty_like(order)
    following[order] = np.roll(order, -1)
    return Limit(_name("reads in a chain", size), 20_000, lambda: _follow(following, 20_000))


def _arithmetic(name: str, kind: type[_Number], kernel: Callable[..., None]) -> Limit:
    values = np.ones(4096 // np.dtype(kind).itemsize, kind)
    constants = kind(3), kind(1)
    return Limit(name, values.size * 8 * _TIMES, lambda: kernel(values, *constants))


@cache
def operations(kind: str) -> Limit:
    """Additions and minima (of integers), multiplications and additions (else) of a type."""
    if kind in ("f32", "f64"):
        floats: type[_Number] = np.float32 if kind == "f32" else np.float64
        return _arithmetic(f"{kind} operations", floats, _multiply_add)
    integers = _INTEGERS[kind]
    return _arithmetic(f"{kind} operations", integers, _add_min(integers))


@cache
def chain() -> Limit:
    """Take steps that each wait for the last: a minimum and an addition of integers."""
    values = np.arange(2048, dtype=np.int32)[::-1].copy()
    return Limit("chained min + add", values.size, lambda: _chained(values))


@cache
def sums() -> Limit:
    """Take steps that each wait for the last: an addition of float64."""
    values = np.ones(2048)
    return Limit("chained f64 additions", values.size, lambda: _chained_sum(values))


@cache
def leaps() -> Limit:
    """Find the next cell of a ray, without a map: arithmetic that waits for the last."""
    return Limit("leaps without a map", 20_000, lambda: _leap(20_000, 3.3, 0.7, 1.4))


@cache
def calls(what: str) -> Limit:
    """Values of a function of float64, one after the other, none waiting for another."""
    values = np.random.default_rng(0).uniform(0.5, 3.0, 2048)
    kernel = {
        "exp": _exps,
        "log": _logs,
        "sin + cos": _sines,
        "sqrt": _roots,
        "division": _quotients,
    }[what]
    out = np.empty_like(values)
    return Limit(f"{what} of f64", values.size, lambda: kernel(values, out))


@cache
def surprises() -> Limit:
    """Branches that cannot be predicted; each costs the discarded work of the processor."""
    bits = np.random.default_rng(0).random(65536) < 0.5
    kept = np.empty(bits.size, np.int64)
    return Limit("branches foretold wrong", bits.size / 2, lambda: _keep(bits, kept))


@compiled
def _sum(values: NDArray[np.int64], times: int) -> None:
    for _ in range(times):
        total = 0
        for i in range(values.size):
            total += values[i]
        values[0] = total  # else one time would do for all


@compiled
def _add_one(source: NDArray[np.int64], target: NDArray[np.int64], times: int) -> None:
    for _ in range(times):
        for i in range(source.size):
            target[i] = source[i] + 1


@compiled
def _add_runs(
    values: NDArray[np.uint8], starts: NDArray[np.uint64], total: NDArray[np.uint8]
) -> None:
    for k in range(0, starts.size, 8):
        a, b, c, d = starts[k], starts[k + 1], starts[k + 2], starts[k + 3]
        e, f, g, h = starts[k + 4], starts[k + 5], starts[k + 6], starts[k + 7]
        for x in range(np.uint64(64)):
            s = np.uint8(np.uint8(values[a + x] + values[b + x]) + values[c + x])
            t = np.uint8(np.uint8(values[d + x] + values[e + x]) + values[f + x])
            total[x] += np.uint8(np.uint8(s + t) + np.uint8(values[g + x] + values[h + x]))


@compiled
def _sum_at(values: NDArray[np.int32], places: NDArray[np.uint32]) -> int:
    total = np.int32(0)
    for i in range(places.size):
        total += values[places[i]]
    return int(total)


@compiled
def _follow(following: NDArray[np.int32], steps: int) -> int:
    i = 0
    for _ in range(steps):
        i = following[i]
    return i


@compiled
def _multiply_add(values: NDArray[np.float64], factor: float, summand: float) -> None:
    for _ in range(_TIMES):
        for i in range(values.size):
            x = values[i]
            for _ in range(4):
                x = x * factor + summand
            values[i] = x


def _add_min(kind: type[np.integer]) -> Callable[..., None]:
    """Make a kernel for whole numbers of a type, all of whose sums are of that type, too."""

    @compiled
    def add_min(values: NDArray[np.integer], most: np.integer, summand: np.integer) -> None:
        for _ in range(_TIMES):
            for i in range(values.size):
                x = values[i]
                for _ in range(4):
                    x = kind(min(x, most) + summand)
                values[i] = x

    return add_min


@compiled
def _chained(values: NDArray[np.int32]) -> int:
    previous = 1 << 20
    for i in range(values.size):
        previous = min(int(values[i]), previous + 1)
    return previous


@compiled
def _leap(steps: int, start: float, slope: float, per: float) -> int:
    column = 0
    for _ in range(steps):
        length = ((column & 15) + 1 - start) * per
        column = math.floor(start + slope * length)
    return column


@compiled
def _chained_sum(values: NDArray[np.float64]) -> float:
    total = 0.0
    for i in range(values.size):
        total += values[i]
    return total


@compiled
def _exps(values: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    for i in range(values.size):
        out[i] = math.exp(-values[i])


@compiled
def _logs(values: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    for i in range(values.size):
        out[i] = math.log(values[i])


@compiled
def _sines(values: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    for i in range(values.size):
        out[i] = math.sin(values[i]) + math.cos(values[i])


@compiled
def _roots(values: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    for i in range(values.size):
        out[i] = math.sqrt(values[i])


@compiled
def _quotients(values: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    for i in range(values.size):
        out[i] = 1.0 / values[i]


@compiled
def _keep(bits: NDArray[np.bool_], kept: NDArray[np.int64]) -> int:
    n = 0
    for i in range(bits.size):
        if bits[i]:
            kept[n] = i
            n += 1
    return n
