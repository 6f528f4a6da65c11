"""Saves the last seconds when a pose is lost or revoked, a hint is refused, or on demand."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from datetime import datetime, timezone

from firstfix.core.errors import InputError
from firstfix.io.incident_files import IncidentFolder, packed
from firstfix.localizer.incident import Cause, Incident, IncidentRecorder
from firstfix.localizer.incident_document import to_document
from firstfix.localizer.inputs import Input
from firstfix.localizer.outputs import Output, Status
from firstfix.site.checkpoint import written_state
from firstfix.site.floors import AnyLocalizer, SiteLocalizer


class IncidentKeeper:
    """Watches a localizer; a thread of its own writes the files.

    A disk that is full or read-only is reported, and changes nothing else.

    Parameters
    ----------
    seconds : float
        How much is kept, s; 0 for nothing.
    folder : IncidentFolder
        Where incidents are saved.
    warn : callable
        Receives what went wrong, as text, in the thread that calls the keeper.
    """

    def __init__(self, seconds: float, folder: IncidentFolder, warn: Callable[[str], None]) -> None:
        self.folder = folder
        self._seconds = seconds
        self._recorder = IncidentRecorder(seconds, written_state) if seconds > 0.0 else None
        self._warn = warn
        self._saved_at: dict[Cause, float] = {}
        self._disk = ThreadPoolExecutor(1, "firstfix-incidents")
        self._writing: Future[str] | None = None

    def __call__(self, given: Input, outputs: list[Output], localizer: AnyLocalizer) -> None:
        """Keep an input with its outputs; save an incident if one has happened."""
        if self._recorder is None:
            return
        self._report_failure()
        cause = self._recorder.observe(given, outputs, localizer)
        if cause is None or not self._is_due(cause, given.stamp):
            return
        if isinstance(localizer, SiteLocalizer) and localizer.is_riding:
            return  # in a lift a pose is withheld, not revoked
        reasons = [output.reason for output in outputs if isinstance(output, Status)]
        incident = self._recorder.take(cause, reasons[-1] if reasons else cause.value)
        if incident is not None:
            self._saved_at[cause] = given.stamp
            self._writing = self._disk.submit(self._write, incident)

    def save(self, reason: str = "somebody asked for it") -> str:
        """Save the last seconds now, from any thread, and return the name of the file.

        Raises
        ------
        InputError
            If nothing is kept, or the file cannot be written.
        """
        if self._recorder is None:
            raise InputError("Nothing is kept: incident_seconds is 0. Set it to 30, for instance.")
        incident = self._recorder.take(Cause.REQUESTED, reason)
        if incident is None:
            raise InputError("Nothing is kept before the first map.")
        return self._write(incident)

    def close(self) -> None:
        """Wait until everything is written."""
        self._disk.shutdown()
        self._report_failure()

    def _is_due(self, cause: Cause, stamp: float) -> bool:
        """Return False where the last incident of this cause shows the same seconds."""
        last = self._saved_at.get(cause)
        busy = self._writing is not None and not self._writing.done()
        return not busy and (last is None or not 0.0 <= stamp - last < self._seconds)

    def _write(self, incident: Incident) -> str:
        document, arrays = to_document(incident)
        now = datetime.now(timezone.utc)
        return self.folder.save(packed(document, arrays), incident.cause.value, now)

    def _report_failure(self) -> None:
        if self._writing is None or not self._writing.done():
            return
        error, self._writing = self._writing.exception(), None
        if error is not None:
            self._warn(f"the incident is not saved: {error}")
