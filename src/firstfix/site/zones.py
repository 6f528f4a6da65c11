"""Zones of a site by their names, as what is known of a robot."""

from __future__ import annotations

from collections.abc import Iterable

from firstfix.belief.prior import Region
from firstfix.core.errors import InputError
from firstfix.io.maps.site_yaml import SiteMap
from firstfix.site.query import SitePrior

_LISTED = 5


def zone_prior(maps: Iterable[SiteMap], zone: str) -> SitePrior:
    """Return where a robot is that is in a zone: a polygon in each map that has this zone.

    Parameters
    ----------
    maps : iterable of SiteMap
        All maps of the site.
    zone : str
        Name of the zone, as in ``site.yaml``.

    Raises
    ------
    InputError
        If no map has the zone, or its polygon has no area.
    """
    known = list(maps)
    found = {entry.id: Region(entry.zones[zone]) for entry in known if zone in entry.zones}
    if found:
        return found
    names = sorted({name for entry in known for name in entry.zones})
    if not names:
        raise InputError("No map of this site has zones. Write them into its site.yaml.")
    listed = ", ".join(names[:_LISTED]) + (", ..." if len(names) > _LISTED else "")
    raise InputError(f"There is no zone {zone!r:.60} in this site. Choose one of {listed}.")
