"""The keys that a .tir file may hold, and which of them an unknown key was probably meant to be.

In: a family of .tir files, or a key that is in no list. Out: names.

The names are those of MF-Tyre/MF-Swift 5.2 to 6.2 and, where they differ, of PAC2002 and PAC89 of
Adams Tire. `KNOWN` has those too that this project does not use: a file may hold them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from mjchair.tire.formula.mf_names import NAMES_52, NAMES_61, SECTIONS_52

SIDE = "TYRESIDE"
SAID_IN_MODEL = ("FITTYP", "PROPERTY_FILE_FORMAT", SIDE)
NOT_USED = {
    "MODEL": (
        "TYPE USE_MODE VXLOW ROAD_INCREMENT ROAD_DIRECTION FUNCTION_NAME USER_SUB_ID N_TIRE_STATES "
        "HMAX_LOCAL SWITCH_INTEG TIME_SWITCH_INTEG MFSAFE1 MFSAFE2 MFSAFE3 CONTACT_MODEL "
        "BELT_DYNAMICS FE_METHOD LOCAL_SOLVER LOCAL_SOLVER_HP"
    ),
    "DIMENSION": "WIDTH ASPECT_RATIO RIM_RADIUS RIM_WIDTH LOADED_RADIUS",
    "OPERATING_CONDITIONS": "IP IP_NOM",
    "TIRE_CONDITIONS": "IP IP_NOM",
    "SHAPE": "",
    "INERTIA": "MASS IXX IYY IZZ BELT_MASS BELT_IXX BELT_IYY BELT_IZZ GRAVITY",
    "VERTICAL": (
        "VERTICAL_STIFFNESS VERTICAL_DAMPING MC_CONTOUR_A MC_CONTOUR_B BREFF DREFF FREFF Q_RE0 "
        "Q_V1 Q_V2 Q_FZ1 Q_FZ2 Q_FZ3 Q_FCX Q_FCY Q_FCX1 Q_FCY1 Q_FCY2 Q_FCG1 Q_CAM Q_CAM1 Q_CAM2 "
        "Q_CAM3 Q_FYS1 Q_FYS2 Q_FYS3 PFZ1 QV1 QV2 QRE0 QFZ1 QFZ2 QFZ3 QFCX QFCY QFCX1 QFCY1 QFCG1 "
        "QPFZ1 BOTTOM_OFFST BOTTOM_STIFF BOTTOM_TRNSF"
    ),
    "STRUCTURAL": (
        "YAW_STIFFNESS FREQ_LAT FREQ_LONG FREQ_WINDUP FREQ_YAW DAMP_LAT DAMP_LONG DAMP_RESIDUAL "
        "DAMP_VLOW DAMP_WINDUP DAMP_YAW Q_BVX Q_BVT PCMZ1"
    ),
    "CONTACT_PATCH": (
        "Q_RA1 Q_RA2 Q_RB1 Q_RB2 Q_A1 Q_A2 Q_B1 Q_B2 ELLIPS_SHIFT ELLIPS_LENGTH ELLIPS_HEIGHT "
        "ELLIPS_ORDER ELLIPS_MAX_STEP ELLIPS_NWIDTH ELLIPS_NLENGTH ENV_C1 ENV_C2"
    ),
    "SCALING_COEFFICIENTS": "LMP LGYR LCZ LMUV LAMU LCC LKC LEC LHC",
    "LONGITUDINAL_COEFFICIENTS": "PTX4",
    "LATERAL_COEFFICIENTS": "PCY2 PTY3",
    "ROLLING_COEFFICIENTS": "",
    "ALIGNING_COEFFICIENTS": "QDZ5 QTZ1 MBELT QPZ1",
    "TURNSLIP_COEFFICIENTS": (
        "PDXP1 PDXP2 PDXP3 PKYP1 PDYP1 PDYP2 PDYP3 PDYP4 PHYP1 PHYP2 PHYP3 PHYP4 PECP1 PECP2 QDTP1 "
        "QCRP1 QCRP2 QBRP1 QDRP1 QDRP2"
    ),
    "ZETA_FACTORS": " ".join(f"ZETA{i}" for i in range(9)),
}
KNOWN_SECTIONS = {*SECTIONS_52, *NOT_USED}
KNOWN = {
    *NAMES_52,
    *NAMES_61,
    *SAID_IN_MODEL,
    *(name for names in NOT_USED.values() for name in names.split()),
}

SHORT = 3  # letters; a name so short is one letter from too many others
_DIGITS_MEANT = str.maketrans("OIL", "011")


def meant(key: str, missing: Iterable[str]) -> str | None:
    """The one of the `missing` names that an unknown key was probably meant to be; None: none.

    That is the name one slip of the keyboard away: a letter too many or too few, two letters the
    other way round, another letter (not a digit: PKY8 beside PKY1 is another coefficient), or a
    letter for the digit that looks like it.
    """
    names = sorted(missing)
    for slip in (_one_more, _turned, _other_letter):
        for name in names:
            if slip(key, name):
                return name
    return None


def _one_more(key: str, name: str) -> bool:
    """Whether one of the two is the other with a letter more."""
    longer, shorter = sorted((key, name), key=len, reverse=True)
    if len(longer) != len(shorter) + 1:
        return False
    return any(longer[:i] + longer[i + 1 :] == shorter for i in range(len(longer)))


def _turned(key: str, name: str) -> bool:
    """Whether two neighbouring letters stand the other way round."""
    return len(key) == len(name) and any(
        key[:i] + key[i + 1] + key[i] + key[i + 2 :] == name for i in range(len(key) - 1)
    )


def _other_letter(key: str, name: str) -> bool:
    """Whether one letter is another, or a letter stands for a digit that looks like it."""
    if len(key) != len(name):
        return False
    differ = [(a, b) for a, b in zip(key, name, strict=True) if a != b]
    if len(differ) != 1:
        return False
    a, b = differ[0]
    if re.fullmatch(r"\d", b):
        return a.translate(_DIGITS_MEANT) == b
    return len(name) > SHORT and not a.isdigit()
