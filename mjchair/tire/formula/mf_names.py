"""What Magic Formula 5.2 and 6.1/6.2 files call their numbers, and what those are when left out.

In: nothing. Out: names by section, those that change sign in the mirror image, and defaults.
"""

from __future__ import annotations

_SECTIONS = {
    "MODEL": "LONGVL",
    "DIMENSION": "UNLOADED_RADIUS",
    "OPERATING_CONDITIONS": "INFLPRES NOMPRES",
    "VERTICAL": "FNOMIN",
    "STRUCTURAL": "LONGITUDINAL_STIFFNESS LATERAL_STIFFNESS PCFX1 PCFX2 PCFX3 PCFY1 PCFY2 PCFY3",
    "INFLATION_PRESSURE_RANGE": "PRESMIN PRESMAX",
    "VERTICAL_FORCE_RANGE": "FZMIN FZMAX",
    "LONG_SLIP_RANGE": "KPUMIN KPUMAX",
    "SLIP_ANGLE_RANGE": "ALPMIN ALPMAX",
    "INCLINATION_ANGLE_RANGE": "CAMMIN CAMMAX",
    "SCALING_COEFFICIENTS": (
        "LFZO LCX LMUX LEX LKX LHX LVX LCY LMUY LEY LKY LHY LVY LTR LRES LXAL LYKA LVYKA LS "
        "LKYC LKZC LVMX LMX LMY"
    ),
    "LONGITUDINAL_COEFFICIENTS": (
        "PCX1 PDX1 PDX2 PDX3 PEX1 PEX2 PEX3 PEX4 PKX1 PKX2 PKX3 PHX1 PHX2 PVX1 PVX2 "
        "PPX1 PPX2 PPX3 PPX4 RBX1 RBX2 RBX3 RCX1 REX1 REX2 RHX1"
    ),
    "OVERTURNING_COEFFICIENTS": (
        "QSX1 QSX2 QSX3 QSX4 QSX5 QSX6 QSX7 QSX8 QSX9 QSX10 QSX11 QSX12 QSX13 QSX14 PPMX1"
    ),
    "LATERAL_COEFFICIENTS": (
        "PCY1 PDY1 PDY2 PDY3 PEY1 PEY2 PEY3 PEY4 PEY5 PKY1 PKY2 PKY3 PKY4 PKY5 PKY6 PKY7 "
        "PHY1 PHY2 PVY1 PVY2 PVY3 PVY4 PPY1 PPY2 PPY3 PPY4 PPY5 RBY1 RBY2 RBY3 RBY4 RCY1 "
        "REY1 REY2 RHY1 RHY2 RVY1 RVY2 RVY3 RVY4 RVY5 RVY6"
    ),
    "ROLLING_COEFFICIENTS": "QSY1 QSY2 QSY3 QSY4 QSY5 QSY6 QSY7 QSY8",
    "ALIGNING_COEFFICIENTS": (
        "QBZ1 QBZ2 QBZ3 QBZ4 QBZ5 QBZ6 QBZ9 QBZ10 QCZ1 QDZ1 QDZ2 QDZ3 QDZ4 QDZ6 QDZ7 QDZ8 QDZ9 "
        "QDZ10 QDZ11 QEZ1 QEZ2 QEZ3 QEZ4 QEZ5 QHZ1 QHZ2 QHZ3 QHZ4 PPZ1 PPZ2 SSZ1 SSZ2 SSZ3 SSZ4"
    ),
}
_ONLY_52 = {
    "SCALING_COEFFICIENTS": " LGAX LGAY LGAZ LSGKP LSGAL",
    "LONGITUDINAL_COEFFICIENTS": " PTX1 PTX2 PTX3",
    "LATERAL_COEFFICIENTS": " PHY3 PTY1 PTY2",
}

SECTIONS_61 = {section: tuple(names.split()) for section, names in _SECTIONS.items()}
SECTIONS_52 = {
    section: tuple((names + _ONLY_52.get(section, "")).split())
    for section, names in _SECTIONS.items()
}
NAMES_61 = tuple(name for names in SECTIONS_61.values() for name in names)
NAMES_52 = tuple(name for names in SECTIONS_52.values() for name in names)

# what makes a tire unlike its mirror image: ply steer, conicity, and curves that differ between
# slip or camber to the left and to the right
_ODD = "RHX1 QSX1 PEY3 PHY1 PHY2 PVY1 PVY2 RBY3 RVY1 RVY2 QBZ4 QDZ3 QDZ6 QDZ7 QEZ4 QHZ1 QHZ2 SSZ1"
ODD = tuple(_ODD.split())
# ranges that the mirror image has the other way round
ODD_RANGES = (("ALPMIN", "ALPMAX"), ("CAMMIN", "CAMMAX"))

# numbers left out are 0, but for these
DEFAULTS = {name: 1.0 for name in SECTIONS_52["SCALING_COEFFICIENTS"]} | {
    "LONGVL": 16.67,  # m/s
    "PKY4": 2.0,
    "QSY7": 1.0,  # rolling resistance in proportion to the load
}
