"""The lines of a text log that nobody vouches for, plain or gzipped."""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from firstfix.core.errors import ScanError
from firstfix.core.scan import MAX_BEAMS
from firstfix.io.logs.scan_errors import unreadable

# Ten characters a reading; a longer line is not a scan, and must not be read into memory.
MAX_LINE_BYTES = 10 * MAX_BEAMS
# Some hundred hours of a SICK; a small .gz that unpacks to more is a bomb.
MAX_LOG_BYTES = 2**30


class LogLines:
    """The lines of a log, plain or gzipped, with their line ends; iterate once.

    Parameters
    ----------
    path : Path
        The file; gzipped if its name ends in ``.gz``.

    Attributes
    ----------
    cut : bool
        After the iteration: whether a gzipped log ended before its end.

    Raises
    ------
    ScanError
        If the file cannot be read, or is longer than any log.
    """

    def __init__(self, path: Path) -> None:
        self.cut = False
        self._path = path

    def __iter__(self) -> Iterator[str]:
        left = MAX_LOG_BYTES
        try:
            with self._open() as stream:
                while line := stream.readline(MAX_LINE_BYTES + 1):
                    left -= len(line)
                    if len(line) > MAX_LINE_BYTES or left < 0:
                        raise _too_long(self._path)
                    yield line.decode("ascii", errors="replace")
        except EOFError:
            self.cut = True  # what came before is good
        except (OSError, zlib.error) as error:
            raise unreadable(self._path, "a CARMEN log", error) from error

    def _open(self) -> IO[bytes] | gzip.GzipFile:
        if self._path.suffix.lower() == ".gz":
            return gzip.GzipFile(self._path)
        return self._path.open("rb")


def _too_long(path: Path) -> ScanError:
    return ScanError(
        expected=f"at most {MAX_LOG_BYTES} bytes in lines of at most {MAX_LINE_BYTES}",
        received=f"more in {path}",
        remedy="check that it is a CARMEN log, or cut it into parts",
    )
