"""Magic Formula 6.1 and 5.2 written out equation by equation, to test mjchair's law.

Straight from Pacejka (2006), section 4.3.2 and Besselink, Schmeitz & Pacejka (2010); forward
rolling, no ranges. Slow, and independent of mjchair.
"""

import tomllib
from collections import defaultdict
from pathlib import Path

import numpy as np

BOOK = Path(__file__).parents[1] / "tests" / "data" / "tire" / "mf61_book205.toml"
BOOK_RADIUS = 0.313  # m, of the book's 205/60R15; the reference leaves it out

SCALING = (
    "LFZO LCX LMUX LEX LKX LHX LVX LCY LMUY LEY LKY LHY LVY LTR LRES LXAL LYKA LVYKA LS LKYC "
    "LKZC LVMX LMX LMY"
)


def book(**changes):
    """Coefficients of the book's tire; see tests/data/tire for their origin."""
    numbers = tomllib.loads(BOOK.read_text())
    del numbers["WIDTH"]  # not in the force equations
    return numbers | {"UNLOADED_RADIUS": BOOK_RADIUS} | changes


def magic(b, c, d, e, x):
    return d * np.sin(c * np.arctan(b * x - e * (b * x - np.arctan(b * x))))


def shape(b, c, e, x):
    return np.cos(c * np.arctan(b * x - e * (b * x - np.arctan(b * x))))


def forces(numbers, fz, kappa, alpha, gamma, vx, old=False):
    """Fx, Fy, Mx, My, Mz of one point."""
    c = defaultdict(float, numbers)
    for name in SCALING.split():
        c.setdefault(name, 1.0)
    c.setdefault("PKY4", 2.0)
    f0 = c["LFZO"] * c["FNOMIN"]
    df = (fz - f0) / f0
    dp = (c["INFLPRES"] - c["NOMPRES"]) / c["NOMPRES"] if c["NOMPRES"] else 0.0
    a, g = np.tan(alpha), gamma if old else np.sin(gamma)  # 5.2 takes the angle
    r0 = c["UNLOADED_RADIUS"]

    mux = (c["PDX1"] + c["PDX2"] * df) * (1 + c["PPX3"] * dp + c["PPX4"] * dp**2)
    mux *= (1 - c["PDX3"] * gamma**2) * c["LMUX"]
    kx = fz * (c["PKX1"] + c["PKX2"] * df) * np.exp(c["PKX3"] * df)
    kx *= (1 + c["PPX1"] * dp + c["PPX2"] * dp**2) * c["LKX"]
    cx, dx = c["PCX1"] * c["LCX"], mux * fz
    x = kappa + (c["PHX1"] + c["PHX2"] * df) * c["LHX"]
    ex = (c["PEX1"] + c["PEX2"] * df + c["PEX3"] * df**2) * (1 - c["PEX4"] * np.sign(x)) * c["LEX"]
    svx = fz * (c["PVX1"] + c["PVX2"] * df) * c["LVX"] * c["LMUX"]
    fx0 = magic(kx / (cx * dx), cx, dx, min(ex, 1), x) + svx

    def lateral(g):
        ky = c["PKY1"] * f0 * (1 + c["PPY1"] * dp) * (1 - c["PKY3"] * abs(g)) * c["LKY"]
        best = (c["PKY2"] + c["PKY5"] * g**2) * (1 + c["PPY2"] * dp)
        ky *= np.sin(c["PKY4"] * np.arctan(fz / f0 / best))
        svg = fz * (c["PVY3"] + c["PVY4"] * df) * g * c["LKYC"] * c["LMUY"]
        kg = fz * (c["PKY6"] + c["PKY7"] * df) * (1 + c["PPY5"] * dp) * c["LKYC"]
        shift = c["PHY3"] * g * c["LKYC"] if old else (kg * g - svg) / ky
        sh = (c["PHY1"] + c["PHY2"] * df) * c["LHY"] + shift
        sv = fz * (c["PVY1"] + c["PVY2"] * df) * c["LVY"] * c["LMUY"] + svg
        mu = (c["PDY1"] + c["PDY2"] * df) * (1 + c["PPY3"] * dp + c["PPY4"] * dp**2)
        mu *= (1 - c["PDY3"] * g**2) * c["LMUY"]
        cy, y = c["PCY1"] * c["LCY"], a + sh
        e = (c["PEY1"] + c["PEY2"] * df) * c["LEY"]
        e *= 1 + c["PEY5"] * g**2 - (c["PEY3"] + c["PEY4"] * g) * np.sign(y)
        by = ky / (cy * mu * fz)
        return magic(by, cy, mu * fz, min(e, 1), y) + sv, mu, ky, sh, sv, by, cy

    fy0, muy, ky, shy, svy, by, cy = lateral(g)
    fy00 = lateral(0.0)[0]

    bxa = (c["RBX1"] + c["RBX3"] * g**2) * np.cos(np.arctan(c["RBX2"] * kappa)) * c["LXAL"]
    exa, h = min(c["REX1"] + c["REX2"] * df, 1), c["RHX1"]
    fx = fx0 * shape(bxa, c["RCX1"], exa, a + h) / shape(bxa, c["RCX1"], exa, h)
    byk = (c["RBY1"] + c["RBY4"] * g**2) * np.cos(np.arctan(c["RBY2"] * (a - c["RBY3"])))
    byk *= c["LYKA"]
    eyk, h = min(c["REY1"] + c["REY2"] * df, 1), c["RHY1"] + c["RHY2"] * df
    gyk = shape(byk, c["RCY1"], eyk, kappa + h) / shape(byk, c["RCY1"], eyk, h)
    dvyk = muy * fz * (c["RVY1"] + c["RVY2"] * df + c["RVY3"] * g)
    dvyk *= np.cos(np.arctan(c["RVY4"] * a))
    svyk = dvyk * np.sin(c["RVY5"] * np.arctan(c["RVY6"] * kappa)) * c["LVYKA"]
    fy = gyk * fy0 + svyk

    at = a + c["QHZ1"] + c["QHZ2"] * df + (c["QHZ3"] + c["QHZ4"] * df) * g
    ar = a + shy + svy / ky
    bt = (c["QBZ1"] + c["QBZ2"] * df + c["QBZ3"] * df**2) * c["LKY"] / c["LMUY"]
    bt *= 1 + c["QBZ4"] * gamma + c["QBZ5"] * abs(gamma)
    dt = fz * (c["QDZ1"] + c["QDZ2"] * df) * (1 - c["PPZ1"] * dp) * r0 / f0 * c["LTR"] * c["LFZO"]
    dt *= 1 + c["QDZ3"] * gamma + c["QDZ4"] * gamma**2
    ct = c["QCZ1"]
    et = c["QEZ1"] + c["QEZ2"] * df + c["QEZ3"] * df**2
    et *= 1 + (c["QEZ4"] + c["QEZ5"] * g) * 2 / np.pi * np.arctan(bt * ct * at)
    dr = (c["QDZ6"] + c["QDZ7"] * df) * c["LRES"]
    camber = (c["QDZ8"] + c["QDZ9"] * df) * (1 + c["PPZ2"] * dp)
    dr += (camber + (c["QDZ10"] + c["QDZ11"] * df) * abs(g)) * g * c["LKZC"]
    dr *= fz * r0 * c["LMUY"] * np.cos(alpha)
    br = c["QBZ9"] * c["LKY"] / c["LMUY"] + c["QBZ10"] * by * cy
    k2 = (kx / ky * kappa) ** 2
    teq = np.arctan(np.sqrt(np.tan(at) ** 2 + k2)) * np.sign(at)
    req = np.arctan(np.sqrt(np.tan(ar) ** 2 + k2)) * np.sign(ar)
    trail = dt * shape(bt, ct, min(et, 1), teq) * np.cos(alpha)
    s = c["SSZ1"] + c["SSZ2"] * fy / c["FNOMIN"] + (c["SSZ3"] + c["SSZ4"] * df) * gamma
    force = fy - svyk if old else gyk * fy00
    mz = -trail * force + dr * np.cos(np.arctan(br * req)) + s * r0 * c["LS"] * fx

    fn = c["FNOMIN"]
    mx = c["QSX1"] * c["LVMX"] - c["QSX2"] * gamma * (1 + c["PPMX1"] * dp) + c["QSX3"] * fy / fn
    mx += -c["QSX12"] * gamma * abs(gamma) + c["QSX10"] * np.arctan(c["QSX11"] * fz / fn) * gamma
    wave = np.sin(c["QSX7"] * gamma + c["QSX8"] * np.arctan(c["QSX9"] * fy / fn))
    mx += c["QSX4"] * np.cos(c["QSX5"] * np.arctan((c["QSX6"] * fz / fn) ** 2)) * wave
    mx = r0 * c["LMX"] * (fz * mx + fy * (c["QSX13"] + c["QSX14"] * abs(gamma)))

    v = vx / c["LONGVL"]
    my = c["QSY1"] + c["QSY2"] * fx / fn + c["QSY3"] * abs(v) + c["QSY4"] * v**4
    if old:
        return fx, fy, mx, -r0 * fz * c["LMY"] * my, mz
    my += (c["QSY5"] + c["QSY6"] * fz / fn) * gamma**2
    pressure = (1 + dp) ** c["QSY8"] if c["NOMPRES"] else 1.0
    my *= (fz / fn) ** c["QSY7"] * pressure
    return fx, fy, mx, -r0 * fn * c["LMY"] * my, mz
