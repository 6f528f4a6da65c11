"""A ride in a lift: the views that see out of it decide on which of its floors the robot is."""

from __future__ import annotations

from dataclasses import dataclass

from firstfix.belief.view import View
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.site.lifts import KINDS, Lift, sees_out, without_cabin
from firstfix.site.map_belief import MapBelief, begin_maps, brings_news, look, predicted
from firstfix.site.site import Site

# A floor that was chosen after a ride is weighed against the others for so many more views.
_PROBATION_VIEWS = 12


@dataclass(frozen=True, slots=True)
class Weighed:
    """What the views of a ride say so far.

    Parameters
    ----------
    T_map_base : SE2
        The robot on the map of `Ride.lift`.
    reason : str
        In words, for people.
    chosen : tuple of str and SE2, or None
        The floor that is sure, and the pose on it.
    is_refuted : bool
        True if the views fit no floor, and each floor has a map: the robot is elsewhere.
    """

    T_map_base: SE2
    reason: str
    chosen: tuple[str, SE2] | None = None
    is_refuted: bool = False


class Ride:
    """Weighs the floors of a lift, during a ride and for some views after it.

    Parameters
    ----------
    site : Site
        The maps.
    lift : Lift
        The lift, seen from the map in which the robot came in.
    hinted : str, optional
        The map that something other than the scans has named.

    Attributes
    ----------
    belief : MapBelief or None
        Which floor the views speak for; None before the first that sees out, and at the end.
    probation : int or None
        Views for which a chosen floor is still watched; None until one is chosen.
    """

    def __init__(self, site: Site, lift: Lift, hinted: str | None = None) -> None:
        self._site = site
        self.lift = lift
        self.hinted = hinted
        self.belief: MapBelief | None = None
        self.probation: int | None = None

    def weigh(self, view: View, T_map_base: SE2) -> Weighed:
        """Weigh the floors by another view.

        Parameters
        ----------
        view : View
            The view.
        T_map_base : SE2
            The robot at the view, by odometry, on the map of `lift`.
        """
        if self.belief is not None:
            best = self.belief.most_likely
            self.lift, T_map_base = (
                self.lift.seen_from(best),
                predicted(self.belief, best, view),
            )
        lift, name = self.lift, self.lift.transition.id
        if lift.holds(T_map_base) and not sees_out(view, lift, T_map_base):
            self.belief = self.hinted = None
            return Weighed(T_map_base, f"in {name}, which may move: waiting for its door to open")
        self.belief = self._look(without_cabin(view, lift, T_map_base), T_map_base)
        if self.belief is None:
            return Weighed(T_map_base, f"no floor of {name} can be compared")
        if self.belief.is_refuted:
            return self._refuted(T_map_base, self.belief)
        chosen = self.belief.decided
        if chosen is None:
            return Weighed(T_map_base, _in_words(self.belief))
        pose = self.belief.floors[chosen].T_map_base
        return Weighed(T_map_base, _in_words(self.belief), (chosen, pose))

    def end_at(self, map_id: str) -> None:
        """Note that the robot is tracked on a floor now."""
        self.lift = self.lift.seen_from(map_id)
        self.probation = _PROBATION_VIEWS if self.hinted is None else 0
        self.hinted = None

    def is_still_likely(self, map_id: str, view: View) -> bool:
        """Weigh a floor that was chosen lately against the others once more."""
        if self.belief is None or not self.probation:
            self.belief = None
            return True
        if brings_news(self.belief, view):
            self.probation -= 1
            self.belief = look(self.belief, view)
        return self.belief.probabilities[map_id] >= 0.5 or self.belief.misses > 0

    def _look(self, outside: View, T_map_base: SE2) -> MapBelief | None:
        if self.belief is not None:
            return look(self.belief, outside)
        places = _places(self._site, self.lift, T_map_base)
        unseen = len(self.lift.transition.ends) - len(places)
        return begin_maps(places, outside, unseen=unseen, hinted=self.hinted)

    def _refuted(self, T_map_base: SE2, belief: MapBelief) -> Weighed:
        """Wait, where the robot may be on a floor that has no map."""
        self.belief = None
        reason = f"the views fit no floor of {self.lift.transition.id}"
        if belief.unseen:
            return Weighed(T_map_base, f"{reason} whose map can be used")
        return Weighed(T_map_base, reason, is_refuted=True)


def is_clear(site: Site, map_id: str, T_map_base: SE2, view: View) -> bool:
    """Tell whether a view fits much worse at the same place of the floors above and below.

    Parameters
    ----------
    site : Site
        The maps.
    map_id : str
        The map that was found.
    T_map_base : SE2
        The place in it.
    view : View
        The view.
    """
    for transition in site.transitions:
        for end in transition.ends:
            if end.map_id == map_id and transition.kind in KINDS:
                places = _places(site, Lift(transition, end.pose), T_map_base)
                belief = begin_maps(places, view)
                if belief is not None and not belief.is_clear(map_id):
                    return False
    return True


def _places(site: Site, lift: Lift, T_map_base: SE2) -> dict[str, tuple[MapFields, SE2]]:
    """Return the floors of a lift that can be used, each with the pose on it."""
    found = {}
    for map_id, pose in lift.places(T_map_base).items():
        site.prepare_map(map_id)
        if map_id not in site.faults:
            found[map_id] = (site.fields(map_id), pose)
    return found


def _in_words(belief: MapBelief) -> str:
    listed = sorted(belief.probabilities.items(), key=lambda item: -item[1])
    shown = ", ".join(f"{name} {share:.0%}" for name, share in listed[:3] if share >= 0.005)
    return f"which floor: {shown or 'none fits'}"
