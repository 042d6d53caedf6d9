"""The next experiment: what separates effects that one run cannot tell apart.

Each line is a manoeuvre, the effects that it separates, and the evidence to expect.
"""

from __future__ import annotations

from collections.abc import Iterable

SEPARATES: tuple[tuple[frozenset[str], frozenset[str], str], ...] = tuple(
    (frozenset(a.split()), frozenset(b.split()), text)
    for a, b, text in (
        (
            "rolling_resistance bearing_friction toe air_drag surface_patch",
            "floor_slope wind",
            "Coast it the other way: start where the run ended, heading reversed, same speed. A "
            "slope or a wind then speeds the chair up where it slowed it down; friction slows it "
            "the same. Or let it stand: only a slope is there at v = 0.",
        ),
        (
            "rolling_resistance",
            "bearing_friction",
            "Coast again with 15-20 kg on the seat: rolling resistance keeps the deceleration, "
            "bearing friction loses it in proportion to the mass.",
        ),
        (
            "rolling_resistance bearing_friction",
            "toe",
            "Coast in a steady turn: toe brakes more in a turn, rolling resistance does not.",
        ),
        (
            "rolling_resistance bearing_friction",
            "air_drag",
            "Coast from twice the speed: air drag is then four times as large, friction the same.",
        ),
        (
            "air_drag",
            "bearing_friction back_emf",
            "Coast from twice the speed: air drag grows fourfold, viscous friction twofold.",
        ),
        (
            "wheel_radius sensor_scale",
            "torque_gain",
            "Coast beside a driven run: a wheel's radius shows in both, a torque gain only when "
            "driven.",
        ),
        (
            "wheel_radius toe mass_offset floor_slope torque_gain",
            "wheel_radius toe mass_offset floor_slope torque_gain",
            "Run it forward, backward, and with the heading turned by 180 degrees: a slope keeps "
            "its side in the world, toe and radius keep theirs on the chair and change sign with "
            "the speed in different ways.",
        ),
        (
            "sensor_bias sensor_scale sensor_delay",
            "floor_slope rolling_resistance turning_scrub mass_offset toe bearing_friction",
            "Let it stand for ten seconds with everything recording: a sensor's bias is there at "
            "v = 0, a force is not.",
        ),
        (
            "relaxation_length",
            "sensor_delay drive_lag",
            "Sweep the steering at two speeds: a relaxation length lags by distance, a delay by "
            "time.",
        ),
        (
            "surface_patch",
            "floor_slope rolling_resistance wind",
            "Repeat the run with the start moved by a metre: a patch stays at its place.",
        ),
        (
            "payload mass_offset",
            "torque_gain drive_lag",
            "Coast in a turn, without torque: mass shows, the drive does not.",
        ),
        (
            "drive_lag",
            "torque_gain back_emf",
            "Drive with short steps of torque, then with long ones: a lag shows at the steps only.",
        ),
    )
)
OTHERWISE = (
    "Run a slalom at two speeds, a coast in both headings, and a minute at rest: the manoeuvres in "
    "which these effects differ most."
)


def suggest(names: Iterable[str]) -> str:
    """The experiment that separates the effects of these names best."""
    found = set(names)
    best, most = "", 0
    for one, other, text in SEPARATES:
        split = {(a, b) for a in found & one for b in found & other if a != b}
        if len(split) > most:
            best, most = text, len(split)
    return best or OTHERWISE
