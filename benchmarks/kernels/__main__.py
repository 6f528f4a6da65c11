"""Time every kernel against the limit of this machine, measured in the same run.

Prints a Markdown table. The time of a kernel is processor time per unit of its work. Its limit is
the least time that this machine needs for the unit: for the bytes at the speed of the cache that
the working set fits into, for the arithmetic in vectors, or for the look-ups in random order,
whichever is slowest. Reference loops measure these, alternately with the kernels of firstfix. The
share is limit over time, both of the fastest runs, because other load only makes runs slower.

    python benchmarks/kernels [MAP_FOLDER] [--offices 3] [--runs 15] [--json FILE]
"""

from __future__ import annotations

import argparse
import importlib
import json
import pkgutil
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import limits
import numpy as np
import of_amcl
import of_belief
import of_changes
import of_fields
import of_look
import of_search
import of_sim
from kernel import Kernel, Roof, name_of
from limits import Limit
from numba.core.registry import CPUDispatcher

from firstfix.core.grid import OccupancyGrid
from firstfix.fields import kernel_cache
from firstfix.fields.map_fields import MapFields
from firstfix.io.maps.map_server import load_map
from firstfix.lab.experiments.machine import machine_text, this_machine
from firstfix.lab.reports.text import markdown_table
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import random_free_pose
from firstfix.lab.worlds.many_offices import many_offices

# Least duration of a sample: the clock and the call are negligible then.
SAMPLE_NS = 3e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", help="a folder with map.yaml, or the YAML")
    parser.add_argument("--offices", type=int, default=3, help="size of the drawn map")
    parser.add_argument("--runs", type=int, default=15)
    parser.add_argument("--only", default="", help="part of the names of kernels")
    parser.add_argument("--json", type=Path, help="where to write all figures")
    arguments = parser.parse_args()
    grid = map_of(arguments.folder, arguments.offices)
    measured = [k for k in kernels(grid) if arguments.only in k.name]
    if not arguments.only:
        report_missing(measured)
    used = dict.fromkeys(limit for k in measured for roof in k.roofs.values() for limit, _ in roof)
    used[limits.surprises()] = None  # not a limit by itself, but slows some kernels
    times = interleaved([*used, *measured], arguments.runs)
    of_limits = [limit_row(limit, times[limit]) for limit in used]
    of_kernels = [kernel_row(k, times) for k in measured]
    document = {
        "machine": this_machine(),
        "caches": limits.cache_sizes(),
        "map": {"width": grid.width, "height": grid.height, "resolution": grid.resolution},
        "runs": arguments.runs,
        "limits": of_limits,
        "kernels": of_kernels,
    }
    print(as_text(document))
    if arguments.json:
        arguments.json.write_text(json.dumps(document, indent=1) + "\n")


def map_of(folder: Path | None, offices: int) -> OccupancyGrid:
    if folder is None:
        return many_offices(offices, np.random.default_rng(0))
    return load_map(folder / "map.yaml" if folder.is_dir() else folder)


def kernels(grid: OccupancyGrid) -> list[Kernel]:
    """Prepare every kernel of firstfix with one map and one scan."""
    rng = np.random.default_rng(0)
    pose = random_free_pose(grid, rng)
    scan = Lidar().scan(grid, pose, rng)
    fields = MapFields(grid)
    return [
        *of_fields.kernels(fields, rng),
        *of_search.kernels(fields, scan),
        *of_look.kernels(fields, scan),
        *of_belief.kernels(fields, scan, rng),
        *of_amcl.kernels(grid, pose, scan, rng),
        *of_changes.kernels(fields, pose, scan, rng),
        *of_sim.kernels(grid, pose, rng),
    ]


def report_missing(measured: Iterable[Kernel]) -> None:
    """Fail if firstfix has a kernel that is not in the table."""
    covered = {name_of(function) for k in measured for function in (k.function, *k.parts)}
    missing = sorted(name_of(function) for function in compiled_functions() - {None})
    missing = [name for name in missing if name not in covered]
    if missing:
        raise SystemExit(f"not measured: {', '.join(missing)}")


def compiled_functions() -> set[Any]:
    """All functions of the package that numba compiles."""
    found = set()
    for folder in kernel_cache._FOLDERS:
        package = folder.replace("/", ".")
        for module in pkgutil.iter_modules(
            [str(kernel_cache.PACKAGE / folder)], f"firstfix.{package}."
        ):
            contents = vars(importlib.import_module(module.name)).values()
            found |= {item for item in contents if is_compiled(item)}
    return found


def is_compiled(item: object) -> bool:
    """Tell a kernel from other things, and from parts, which are copied into their callers."""
    return isinstance(item, CPUDispatcher) and "inline" not in item.targetoptions


def interleaved(things: list[Limit | Kernel], runs: int) -> dict[Limit | Kernel, list[float]]:
    """Run all alternately; return ns of processor time per unit, one for each run."""
    times: dict[Limit | Kernel, list[float]] = {thing: [] for thing in things}
    repeats = {thing: max(1, round(SAMPLE_NS / one_call(thing.call))) for thing in things}
    for _ in range(runs):
        for thing in things:
            spent = time.thread_time_ns()
            for _ in range(repeats[thing]):
                thing.call()
            spent = time.thread_time_ns() - spent
            units = thing.units if isinstance(thing, Kernel) else thing.amount
            times[thing].append(spent / repeats[thing] / units)
    return times


def one_call(call: Callable[[], object]) -> float:
    call()  # compiles, warms the memory
    began = time.thread_time_ns()
    call()
    return time.thread_time_ns() - began + 1.0


def limit_row(limit: Limit, times: list[float]) -> dict[str, Any]:
    return {"name": limit.name, "ns": float(np.median(times)), "best_ns": min(times)}


def kernel_row(kernel: Kernel, times: dict[Limit | Kernel, list[float]]) -> dict[str, Any]:
    at_best = {what: needed(roof, times, np.min) for what, roof in kernel.roofs.items()}
    binding = max(at_best, key=lambda what: at_best[what])
    best, median = min(times[kernel]), float(np.median(times[kernel]))
    return {
        "name": kernel.name,
        "with": [name_of(part) for part in kernel.parts],
        "unit": kernel.unit,
        "units": kernel.units,
        "ns": median,
        "best_ns": best,
        "bytes": kernel.moved,
        "operations": kernel.operations,
        "working_set": kernel.working_set,
        "level": limits.level_of(kernel.working_set),
        "limits_ns": at_best,
        "binding": binding,
        "share": at_best[binding] / best,
        "share_of_medians": needed(kernel.roofs[binding], times, np.median) / median,
    }


def needed(roof: Roof, times: dict[Limit | Kernel, list[float]], choose: Any) -> float:
    """Time a unit needs at the least for one kind of work, ns."""
    return float(sum(amount * choose(times[limit]) for limit, amount in roof))


def as_text(document: dict[str, Any]) -> str:
    caches = ", ".join(f"{level} {size >> 10} KiB" for level, size in document["caches"].items())
    of_map = document["map"]
    head = ("kernel", "unit", "ns", "best", "bytes", "ops", "data in", "bound by", "limit", "share")
    rows = [
        (
            f"`{row['name']}`",
            row["unit"],
            *(f"{row[key]:.3g}" for key in ("ns", "best_ns")),
            *(f"{row[key]:.0f}" for key in ("bytes", "operations")),
            row["level"],
            row["binding"],
            f"{row['limits_ns'][row['binding']]:.3g}",
            f"{row['share']:.0%}",
        )
        for row in document["kernels"]
    ]
    measured = [
        (row["name"], f"{1 / row['ns']:.3g}", f"{1 / row['best_ns']:.3g}")
        for row in document["limits"]
    ]
    caches_and_map = (
        f"Caches: {caches}. Map: {of_map['width']} x {of_map['height']} cells of "
        f"{of_map['resolution']} m. Medians and best of {document['runs']} runs in turns."
    )
    return "\n\n".join(
        [
            "# Kernels against the limits of the machine",
            machine_text(document["machine"]),
            caches_and_map,
            markdown_table(head, rows),
            "## What the machine can do, per nanosecond",
            markdown_table(("limit", "median", "best"), measured),
        ]
    )


if __name__ == "__main__":
    main()
