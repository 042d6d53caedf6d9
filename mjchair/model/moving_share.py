"""Which share of the rider's segments moves on the chair, and the chair without it.

In: the specification of a chair, and the mass (kg) that moves. Out: the mass, centre of mass and
inertia of that share; `take` leaves the rest to the chair's body, so that both together are what
the chair was. The upper body moves first (head, chest, abdomen and arms, all alike), then the
rest of the person with it. So the whole of a person can move on a chair, and what is left is still
the frame, which has a mass and an inertia. A mass beyond the person's can be asked for too: mass
and displacement are measured as a product, and a displacement that is 5 % short makes the mass 5 %
large. Then the whole person moves, farther than was measured.

The share and the rest turn together, so that only the sum of their inertias shows. It is shared
out by mass, which makes two bodies that can be wherever the whole can be.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.errors import MjchairError
from mjchair.model import inertials, merged_visual_geoms, seating
from mjchair.model.inertials import Inertial
from mjchair.model.wheels import base_name

Array = NDArray[np.float64]
STAYS = ("pelvis", "thigh", "shank", "foot")  # of the person: what rests on seat and footrest
MORE = 1.25  # of the mass of the person at most, of a displacement that is a fifth short
LEFT = 0.05  # of the mass of the chair's body that stays in any case
UNKNOWN = 0.9  # of the mass of a chair's body that may move where nobody says who sits on it
REMEMBERED = "rider_share"  # custom numeric: the most that moves, then upper body and rest
NUMBERS = 13  # of a body: mass, centre (3), inertia (9)
HALVINGS = 30


def remember(spec: mujoco.MjSpec, shown: mujoco.MjSpec) -> None:
    """Note in a chair without visual geoms who sits on it, in place.

    A variant of this chair then moves the same person, and as much of it at most, whatever else
    was edited.

    Args:
      shown: the same chair with its visual geoms.
    """
    shown = shown.copy()  # the chair's inertial is written into its body
    numbers = [most(shown)]
    for body in person(shown) or ():
        numbers += [body.mass, *body.centre, *body.tensor.ravel()]
    spec.add_numeric(name=REMEMBERED, size=len(numbers), data=numbers)


def _remembered(spec: mujoco.MjSpec) -> list[float] | None:
    known = next((n for n in spec.numerics if n.name == REMEMBERED), None)
    return None if known is None else [float(x) for x in known.data]


def person(spec: mujoco.MjSpec) -> tuple[Inertial, Inertial] | None:
    """The rider's upper body and the rest of the rider, in the chair's frame.

    None: the chair does not show its rider as the shipped ones do.
    """
    known = _remembered(spec)
    if known is not None:
        bodies = [known[1 + k * NUMBERS :][:NUMBERS] for k in range((len(known) - 1) // NUMBERS)]
        upper, rest = [_inertial(b) for b in bodies] if bodies else (None, None)
        return None if upper is None or rest is None else (upper, rest)
    copy = spec.copy()
    merged_visual_geoms.separate(copy)
    try:
        seating.remember_masses(copy)
        geoms = seating.occupant(copy)
    except MjchairError:
        return None
    below = [g for g in geoms if base_name(g.name).endswith(STAYS)]
    upper_body = [g for g in geoms if not base_name(g.name).endswith(STAYS)]
    return inertials.of_geoms(upper_body), inertials.of_geoms(below)


def _inertial(numbers: list[float]) -> Inertial:
    return Inertial(numbers[0], np.array(numbers[1:4]), np.reshape(numbers[4:], (3, 3)))


def most(spec: mujoco.MjSpec) -> float:
    """The mass (kg) that may be said to move on this chair: a quarter more than its rider's.

    Of a chair of unknown load, 0.9 of its body.
    """
    known = _remembered(spec)
    if known is not None:
        return known[0]
    if person(spec) is None:
        return UNKNOWN * float(_chair(spec).mass)
    return MORE * rider_mass(spec)


def rider_mass(spec: mujoco.MjSpec) -> float:
    """Mass (kg) of the person on this chair; of a chair of unknown load, the most that may move."""
    sitting = person(spec)
    return most(spec) if sitting is None else sitting[0].mass + sitting[1].mass


def share(spec: mujoco.MjSpec, mass: float) -> Inertial:
    """What moves when `mass` (kg) of the rider moves, in the chair's frame.

    It has no more than the person's, and LEFT of the chair's body stays in any case: then what
    moves has less mass and must move farther, since the product counts.

    Raises:
      MjchairError: a mass that is not positive, or more than `most`.
    """
    limit = most(spec)
    if not 0.0 < mass <= limit * (1.0 + 1e-9):
        raise MjchairError(
            f"{mass:g} kg cannot move on this chair; with its rider (occupant_mass) the mass that "
            f"moves must be positive and at most {limit:.4g} kg"
        )
    chair, sitting = inertials.of_body(_chair(spec)), person(spec)
    mass = min(mass, (1.0 - LEFT) * chair.mass)
    if sitting is None:
        return _part(chair, mass, chair.centre)
    upper, rest = sitting
    mass = min(mass, upper.mass + rest.mass)
    first = min(mass, upper.mass)
    centre = (first * upper.centre + (mass - first) * rest.centre) / mass
    return _part(chair, mass, np.asarray(centre))


def _part(chair: Inertial, mass: float, centre: Array) -> Inertial:
    """The part of a body that has this mass, and this centre (3,) m as far as it can."""
    away = centre - chair.centre
    apart = mass * chair.mass / (chair.mass - mass)
    apart_tensor = apart * (away @ away * np.eye(3) - np.outer(away, away))

    def both(share: float) -> Array:
        return np.asarray(chair.tensor - share**2 * apart_tensor)

    low, high = 0.0, 1.0
    if not _can_be(both(1.0)):  # a chair whose inertia was changed apart from its rider's
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if _can_be(both(middle)) else (low, middle)
        high = low
    return Inertial(mass, chair.centre + high * away, mass / chair.mass * both(high))


def take(spec: mujoco.MjSpec, mass: float) -> Inertial:
    """Take the share that moves off the chair's body, in place, and return it.

    Raises:
      MjchairError: as `share` does.
    """
    chair = _chair(spec)
    moving = share(spec, mass)
    inertials.write(chair, inertials.of_body(chair).plus(moving, sign=-1.0))
    return moving


def _chair(spec: mujoco.MjSpec) -> mujoco.MjsBody:
    return inertials.explicit(spec, "chair")


def _can_be(tensor: Array) -> bool:
    """Whether a body has this inertia (3, 3), with a hundredth to spare."""
    low, middle, high = np.linalg.eigvalsh(tensor)
    return bool(low > 0.0 and low + middle > 1.01 * high)
