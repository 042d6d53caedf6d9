"""The moving rider's segments, joints and landmarks, with their names: one table each.

Goes in: nothing. Comes out: `SEGMENTS` and `TABLE` (masses, centres and radii of gyration),
`JOINTS` (names, axes, ranges, units rad) and `LANDMARKS` (names and places), which the model of
the rider, its inputs and measured markers all use.

A segment's frame has its origin at the segment's joint and is parallel to the chair's frame
(x forward, y left, z up; ISO 8855) when the person sits upright with the arms hanging, the elbows
straight and the palms towards the body: trunk and head lie along +z, arms and hands along -z.

Masses, centres and radii of gyration: de Leva P. (1996), Adjustments to Zatsiorsky-Seluyanov's
segment inertia parameters, J Biomech 29(9), 1223-1230, table 4. His sagittal axis points forward
(x here), his transverse axis sideways (y), his longitudinal axis along the segment (z).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

SIDES = {"left": 1.0, "right": -1.0}  # and the sign of y on that side
PREFIX = "rider_"
STATURE = 1.75  # m, of the figure that the shipped chairs show (assumption of their READMEs)


@dataclass(frozen=True)
class Row:
    """A row of de Leva's table for one sex.

    Attributes:
      length: mean of the sample, m (stature 1.741 m male, 1.735 m female).
      mass: share of the body's mass, 1. center: of mass, from the first end point, as a share of
        the length. sagittal, transverse, longitudinal: radii of gyration about the centre of mass
        about the axis of that name, as shares of the length.
    """

    length: float
    mass: float
    center: float
    sagittal: float
    transverse: float
    longitudinal: float


SAMPLE_STATURE = {"male": 1.741, "female": 1.735}  # m, de Leva 1996, table 4
# End points, first to second: upper trunk SUPR-XYPH, middle trunk XYPH-OMPH, lower trunk
# OMPH-MIDH, head VERT-CERV, upper arm SJC-EJC, forearm EJC-WJC, hand WJC-MET3, thigh HJC-KJC,
# shank KJC-LMAL, foot HEEL-TTIP.
TABLE = {
    "male": {
        "upper_trunk": Row(0.1707, 0.1596, 0.2999, 0.716, 0.454, 0.659),
        "middle_trunk": Row(0.2155, 0.1633, 0.4502, 0.482, 0.383, 0.468),
        "lower_trunk": Row(0.1457, 0.1117, 0.6115, 0.615, 0.551, 0.587),
        "head": Row(0.2429, 0.0694, 0.5002, 0.303, 0.315, 0.261),
        "upper_arm": Row(0.2817, 0.0271, 0.5772, 0.285, 0.269, 0.158),
        "forearm": Row(0.2689, 0.0162, 0.4574, 0.276, 0.265, 0.121),
        "hand": Row(0.0862, 0.0061, 0.7900, 0.628, 0.513, 0.401),
        "thigh": Row(0.4222, 0.1416, 0.4095, 0.329, 0.329, 0.149),
        "shank": Row(0.4340, 0.0433, 0.4459, 0.255, 0.249, 0.103),
        "foot": Row(0.2581, 0.0137, 0.4415, 0.257, 0.245, 0.124),
    },
    "female": {
        "upper_trunk": Row(0.1425, 0.1545, 0.2077, 0.746, 0.502, 0.718),
        "middle_trunk": Row(0.2053, 0.1465, 0.4512, 0.433, 0.354, 0.415),
        "lower_trunk": Row(0.1815, 0.1247, 0.4920, 0.433, 0.402, 0.444),
        "head": Row(0.2437, 0.0668, 0.4841, 0.271, 0.295, 0.261),
        "upper_arm": Row(0.2751, 0.0255, 0.5754, 0.278, 0.260, 0.148),
        "forearm": Row(0.2643, 0.0138, 0.4559, 0.261, 0.257, 0.094),
        "hand": Row(0.0780, 0.0056, 0.7474, 0.531, 0.454, 0.335),
        "thigh": Row(0.3685, 0.1478, 0.3612, 0.369, 0.364, 0.162),
        "shank": Row(0.4323, 0.0481, 0.4416, 0.271, 0.267, 0.093),
        "foot": Row(0.2283, 0.0129, 0.4014, 0.299, 0.279, 0.139),
    },
}
# m, of the same samples: middle of the hips to the middle of the shoulders, and to CERV (C7)
TRUNK_LENGTH = {"male": 0.5155, "female": 0.4979}
NECK_HEIGHT = {"male": 0.6033, "female": 0.6148}


@dataclass(frozen=True)
class Segment:
    """A segment that moves.

    Attributes:
      name: of its body, behind `rider_`. parent: the segment it is jointed to; None: the chair.
      row: what of `TABLE` it is made of; two rows lie end to end. up: it lies along +z of its
        frame; else along -z. geoms: of the shipped chairs, that show it.
    """

    name: str
    parent: str | None
    rows: tuple[str, ...]
    up: bool
    geoms: tuple[str, ...]

    @property
    def body(self) -> str:
        """The name of its body in the model."""
        return PREFIX + self.name


def _arm(side: str) -> tuple[Segment, ...]:
    parents = {"upper_arm": "trunk", "forearm": f"{side}_upper_arm", "hand": f"{side}_forearm"}
    return tuple(
        Segment(f"{side}_{part}", parent, (part,), False, (f"{side}_{part}",))
        for part, parent in parents.items()
    )


# The pelvis, de Leva's lower trunk, stays on the seat with the thighs, shanks and feet.
SEGMENTS = (
    Segment(
        "trunk",
        None,
        ("middle_trunk", "upper_trunk"),
        True,
        ("abdomen", "chest", "shoulders", "neck"),
    ),
    Segment("head", "trunk", ("head",), True, ("head", "hair", "nose")),
    *_arm("left"),
    *_arm("right"),
)


@dataclass(frozen=True)
class Joint:
    """A hinge of the rider. Its actuator has its name; the input is the joint's angle, rad.

    The angle is zero in the posture of the shipped chair; it differs from the anatomical angle,
    which is zero upright with hanging arms, by a constant (`seat.posture`).

    Attributes:
      name: of joint and actuator. segment: what it moves. axis: in the segment's frame, x y z,
        right-handed. low, high: anatomical range, rad.
      text: what a positive angle is.
    """

    name: str
    segment: str
    axis: tuple[float, float, float]
    low: float
    high: float
    text: str


def _joint(
    name: str,
    segment: str,
    axis: tuple[float, float, float],
    degrees: tuple[float, float],
    text: str,
) -> Joint:
    low, high = (math.radians(value) for value in degrees)
    return Joint(PREFIX + name, segment, axis, low, high, text)


def _arm_joints(side: str) -> tuple[Joint, ...]:
    y = SIDES[side]
    arm, forearm, hand = f"{side}_upper_arm", f"{side}_forearm", f"{side}_hand"
    return (
        _joint(f"{side}_shoulder_flexion", arm, (0, -1, 0), (-90, 180), "the arm swings forward"),
        _joint(f"{side}_shoulder_abduction", arm, (y, 0, 0), (-45, 180), "away from the body"),
        _joint(f"{side}_shoulder_rotation", arm, (0, 0, -y), (-90, 90), "inwards"),
        _joint(f"{side}_elbow_flexion", forearm, (0, -1, 0), (-5, 150), "the elbow bends"),
        _joint(f"{side}_forearm_pronation", forearm, (0, 0, -y), (-80, 80), "thumb inwards"),
        _joint(f"{side}_wrist_flexion", hand, (-y, 0, 0), (-70, 80), "towards the palm"),
        _joint(f"{side}_wrist_deviation", hand, (0, 1, 0), (-20, 30), "towards the little finger"),
    )


# Several joints of a segment turn one after the other in this order, the first next to its parent.
# Ranges: American Academy of Orthopaedic Surgeons, Joint Motion (1965). Assumptions: the trunk,
# which turns about the hips here, bends forward to 90 deg and back to -40 deg; inward rotation of
# the shoulder has the range of outward rotation (90 deg), adduction 45 deg. The arm swings back to
# -90 deg instead of -60 deg: the shoulder blade goes with it, which is part of the trunk here, and
# arms of racers are beyond 60 deg in their recovery.
JOINTS = (
    _joint("trunk_flexion", "trunk", (0, 1, 0), (-40, 90), "the trunk bends forward"),
    _joint("trunk_lean", "trunk", (1, 0, 0), (-35, 35), "the trunk leans to the right"),
    _joint("trunk_twist", "trunk", (0, 0, 1), (-45, 45), "the chest turns to the left"),
    _joint("head_flexion", "head", (0, 1, 0), (-45, 45), "the head nods forward"),
    _joint("head_lean", "head", (1, 0, 0), (-45, 45), "the head leans to the right"),
    _joint("head_twist", "head", (0, 0, 1), (-60, 60), "the face turns to the left"),
    *_arm_joints("left"),
    *_arm_joints("right"),
)
JOINT_NAMES = tuple(joint.name for joint in JOINTS)


def joints_of(segment: str) -> tuple[Joint, ...]:
    """The joints that move a segment, the first next to its parent."""
    return tuple(joint for joint in JOINTS if joint.segment == segment)


@dataclass(frozen=True)
class Landmark:
    """A palpable place on the body, a site of the model of the same name behind `rider_`.

    Attributes:
      name: of its site, behind `rider_`. segment: it moves with; None: with the chair (the hips).
      along: the distance from the segment's joint along the segment, as a share of its length
        (of the trunk: of the distance from the hips to the middle of the shoulders).
      across: x and y in the segment's frame, m at a stature of 1.75 m; of a trunk's landmark with
        `wide` y is a share of the distance from the middle to a shoulder.
    """

    name: str
    segment: str | None
    along: float
    across: tuple[float, float]
    wide: bool = False


def _arm_landmarks(side: str) -> tuple[Landmark, ...]:
    out = SIDES[side]
    arm, forearm, hand = f"{side}_upper_arm", f"{side}_forearm", f"{side}_hand"
    return (
        Landmark(f"{side}_acromion", "trunk", 1.06, (0.0, out * 1.0), wide=True),
        Landmark(f"{side}_shoulder", arm, 0.0, (0.0, 0.0)),
        Landmark(f"{side}_lateral_epicondyle", arm, 1.0, (0.0, out * 0.035)),
        Landmark(f"{side}_medial_epicondyle", arm, 1.0, (0.0, -out * 0.035)),
        Landmark(f"{side}_elbow", forearm, 0.0, (0.0, 0.0)),
        Landmark(f"{side}_radial_styloid", forearm, 1.0, (0.028, 0.0)),
        Landmark(f"{side}_ulnar_styloid", forearm, 1.0, (-0.028, 0.0)),
        Landmark(f"{side}_wrist", hand, 0.0, (0.0, 0.0)),
        Landmark(f"{side}_grip", hand, 0.79, (0.0, 0.0)),
        Landmark(f"{side}_knuckle_2", hand, 1.0, (0.025, 0.0)),
        Landmark(f"{side}_knuckle_3", hand, 1.0, (0.0, 0.0)),
        Landmark(f"{side}_knuckle_5", hand, 0.9, (-0.035, 0.0)),
    )


# Along the trunk: C7, suprasternale and xiphion of de Leva's male sample over his trunk length.
# Across, and the acromion's height: assumptions, half the width and depth of a person of 1.75 m.
LANDMARKS = (
    Landmark("left_hip", None, 0.0, (0.0, 0.085)),
    Landmark("right_hip", None, 0.0, (0.0, -0.085)),
    Landmark("c7", "trunk", 1.170, (-0.06, 0.0)),
    Landmark("sternum", "trunk", 1.032, (0.08, 0.0)),
    Landmark("xiphoid", "trunk", 0.701, (0.11, 0.0)),
    Landmark("vertex", "head", 1.0, (0.0, 0.0)),
    Landmark("forehead", "head", 0.75, (0.10, 0.0)),
    Landmark("left_ear", "head", 0.50, (0.0, 0.075)),
    Landmark("right_ear", "head", 0.50, (0.0, -0.075)),
    *_arm_landmarks("left"),
    *_arm_landmarks("right"),
)
