"""Standard tire property files (.tir): Magic Formula 5.2, 6.1, 6.2, and PAC89.

In: the text of a file. Out: a `Tire`; or a `Tire` in and the text out.

Sections in brackets hold lines ``KEY = value``; ``$`` and ``!`` start comments; a section may hold
a table of bare rows. Values left blank count as left out. What this project does not use goes into
`Tire.unused`, with its text, and is written back. A key that is none of the Magic Formula's is
refused where it is a slip away from one that the file lacks, and else named in a note.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import fields

from mjchair.errors import MjchairError, nearest, note
from mjchair.tire.formula.mf_names import SECTIONS_52, SECTIONS_61
from mjchair.tire.tir_keys import KNOWN, KNOWN_SECTIONS, SAID_IN_MODEL, SIDE, meant
from mjchair.tire.tire import SIDES, Tire

UNITS = {
    "LENGTH": ("meter", "metre", "m", "meters"),
    "FORCE": ("newton", "n", "newtons"),
    "ANGLE": ("radians", "radian", "rad"),
    "MASS": ("kg", "kilogram"),
    "TIME": ("second", "sec", "s", "seconds"),
    "PRESSURE": ("pascal", "pa"),
}
# FITTYP, or PROPERTY_FILE_FORMAT where there is none
FORMATS = {
    "5": "mf52",  # MF-Tyre 5.0 and 5.1: the names and the form of 5.2
    "6": "mf52",
    "61": "mf61",
    "62": "mf61",
    "PAC2002": "mf52",
    "MF_05": "mf52",
    "PAC89": "pac89",
}
SECTIONS_PAC89 = {
    "LATERAL_COEFFICIENTS": tuple(f"A{i}" for i in range(14)),
    "LONGITUDINAL_COEFFICIENTS": tuple(f"B{i}" for i in range(11)),
    "ALIGNING_COEFFICIENTS": tuple(f"C{i}" for i in range(18)),
}
SECTIONS = {"mf52": SECTIONS_52, "mf61": SECTIONS_61, "pac89": SECTIONS_PAC89}
REQUIRED = {
    "mf52": (
        "DIMENSION",
        "VERTICAL",
        "LONGITUDINAL_COEFFICIENTS",
        "LATERAL_COEFFICIENTS",
        "ALIGNING_COEFFICIENTS",
    ),
    "pac89": ("LATERAL_COEFFICIENTS",),
}
REQUIRED["mf61"] = REQUIRED["mf52"]
NO_SIDE = ("", "unknown")  # what stands for a side that was not said
OWN = "MJCHAIR"  # this project's section: the numbers of the standstill law
OWN_TEXTS = ("NAME", "SOURCE", "LOAD_UNIT")
ASSUMED_RADIUS = next(item.default for item in fields(Tire) if item.name == "radius")
DAMPING_TIME = 0.001  # s, where the file has no [MJCHAIR]: an assumption

Raw = dict[str, dict[str, str]]  # section -> key -> text


def parse(text: str, stem: str) -> Tire:
    """The tire in the .tir `text`; `stem` names it.

    Raises:
      MjchairError: a line that is none, a key or a section twice, a section missing, units other
        than SI, a format or a side that is not known, a misspelled key, or as Tire does.
    """
    raw = _sections(text)
    _check_units(_section(raw, "UNITS"))
    family = _family(_section(raw, "MODEL"))
    for section in REQUIRED[family]:
        _section(raw, section)
    _check_keys(raw, family, stem)
    own = {key: _bare(text) for key, text in raw.get(OWN, {}).items()}
    coefficients = _coefficients(raw, family)
    if family == "pac89":
        unit = {"KN": 1000.0, "N": 1.0}.get(own.get("LOAD_UNIT", "kN").upper())
        if unit is None:
            raise MjchairError(f"[{OWN}] LOAD_UNIT is {own['LOAD_UNIT']!r}; it must be N or kN")
        coefficients = _pac89(coefficients, unit)
    return Tire(
        name=own.get("NAME", stem),
        family=family,
        source=own.get("SOURCE", ""),
        side=_side(raw["MODEL"]),
        coefficients=coefficients,
        unused=_unused(raw, family),
        **_fields(raw, own, family, coefficients, stem),
    )


def compose(tire: Tire) -> str:
    """The .tir text of `tire`; what `parse` makes of it is equal to it.

    Raises:
      MjchairError: the family is not one of .tir files.
    """
    if tire.family not in SECTIONS:
        raise MjchairError(
            f"tire {tire.name}: .tir files have no family {tire.family!r}; write a .toml"
        )
    out: Raw = {}
    for place, text in tire.unused.items():
        section, _, key = place.partition(".")
        out.setdefault(section, {})[key] = text
    _put(
        out, "UNITS", {k: f"'{UNITS[k][0]}'" for k in ("LENGTH", "FORCE", "ANGLE", "MASS", "TIME")}
    )
    _put(out, "MODEL", {"PROPERTY_FILE_FORMAT": "'PAC89'"} if tire.family == "pac89" else {})
    if tire.family != "pac89" and not _said_format(out["MODEL"]):
        _put(out, "MODEL", {"FITTYP": "61" if tire.family == "mf61" else "6"})
    if tire.side:
        _put(out, "MODEL", {SIDE: f"'{tire.side.upper()}'"})
    for section in REQUIRED[tire.family]:
        _put(out, section, {})
    for section, names in SECTIONS[tire.family].items():
        lines = {n: repr(tire.coefficients[_inner(n, tire.family)]) for n in names if _has(tire, n)}
        _put(out, section, lines)
    _put(out, OWN, _own_lines(tire))
    first = ("MDI_HEADER", "UNITS", "MODEL")
    ordered = [*first, *(name for name in out if name not in first)]
    return "".join(_section_text(name, out[name]) for name in ordered if name in out)


def _said_format(model: Mapping[str, str]) -> bool:
    return "FITTYP" in model or "PROPERTY_FILE_FORMAT" in model


def _has(tire: Tire, name: str) -> bool:
    """Whether the file names this coefficient (PAC89: whether its list is there)."""
    inner = _inner(name, tire.family)
    if tire.family == "pac89" and name[0] in "BC":
        return inner in tire.coefficients and tire.coefficients.get(f"has_{inner[0]}", 0.0) != 0.0
    return inner in tire.coefficients


def _inner(name: str, family: str) -> str:
    return name.lower() if family == "pac89" else name


def _own_lines(tire: Tire) -> dict[str, str]:
    lines = {"NAME": f"'{_plain(tire.name)}'", "SOURCE": f"'{_plain(tire.source)}'"}
    if tire.family == "pac89":
        kilo = tire.coefficients.get("load_unit") == 1000.0
        lines["LOAD_UNIT"] = "'kN'" if kilo else "'N'"
    for item in fields(tire):
        if item.metadata:
            lines[item.name.upper()] = repr(float(getattr(tire, item.name)))
    return lines


def _plain(text: str) -> str:
    """`text` without what would end a quoted value or its line."""
    return re.sub(r"\s+", " ", text.replace("'", "’"))


def _put(out: Raw, section: str, lines: Mapping[str, str]) -> None:
    out.setdefault(section, {}).update(lines)


def _section_text(name: str, lines: Mapping[str, str]) -> str:
    body = (text if key.startswith("#") else f"{key:<24} = {text}" for key, text in lines.items())
    return "\n".join([f"[{name}]", *body, ""])


def _sections(text: str) -> Raw:
    """Sections of the file: keys in capitals to their text, bare rows as #1, #2, ..."""
    sections: Raw = {}
    current: dict[str, str] | None = None
    name = ""
    for number, line in enumerate(text.split("\n"), 1):
        line = _uncommented(line)
        if not line:
            continue
        if line.startswith("["):
            name = line[1:].split("]")[0].strip().upper()
            if "]" not in line or not name:
                raise MjchairError(f"line {number}: {line[:40]!r} is no [SECTION]; cut short?")
            if name in sections:
                raise MjchairError(f"line {number}: section [{name}] is there twice; keep one")
            current = sections[name] = {}
        elif current is None:
            raise MjchairError(f"line {number}: {line[:40]!r} before any [SECTION]; a .tir file?")
        elif "=" in line:
            key, value = (part.strip() for part in line.split("=", 1))
            if key.upper() in current:
                raise MjchairError(f"line {number}: {key} is twice in [{name}]; keep one")
            current[key.upper()] = value
        elif line[0] in "{+-.0123456789":
            current[f"#{sum(k.startswith('#') for k in current) + 1}"] = line
        else:
            raise MjchairError(f"line {number}: {line[:40]!r} has no '='; is the file cut short?")
    if not sections:
        raise MjchairError("no [SECTION] in it; a .tir file starts with [MDI_HEADER] or [UNITS]")
    return sections


def _uncommented(line: str) -> str:
    """The line without its comment; a quoted value may hold the signs that start one."""
    match = re.match(r"^([^'\"$!]*=\s*('[^']*'|\"[^\"]*\"))", line)
    if match:
        return match.group(1).strip()
    return re.split(r"[$!]", line, maxsplit=1)[0].strip()


def _bare(text: str) -> str:
    return text.strip().strip("'\"").strip()


def _section(raw: Raw, name: str) -> dict[str, str]:
    if name not in raw:
        raise MjchairError(f"section [{name}] is missing; is the file cut short?")
    return raw[name]


def _check_units(units: Mapping[str, str]) -> None:
    for key, text in units.items():
        if key in UNITS and _bare(text).lower() not in UNITS[key]:
            raise MjchairError(
                f"[UNITS] {key} is {_bare(text)!r}; files are read in SI only: {UNITS[key][0]!r}"
            )


def _check_keys(raw: Raw, family: str, stem: str) -> None:
    """Refuse misspelled keys; note those that are none of the Magic Formula's.

    A section of a name of its own may hold anything, but for a misspelled key.
    """
    used = {name for names in SECTIONS[family].values() for name in names} | {*SAID_IN_MODEL}
    there = {key for lines in raw.values() for key in lines}
    missing = used - there
    if family == "pac89":  # a0 to c17 are too short to be told apart
        missing &= {*SAID_IN_MODEL}
    strange = []
    for section, lines in raw.items():
        if section in (OWN, "UNITS", "MDI_HEADER"):
            continue
        for key in lines:
            if key in used or key in KNOWN or key.startswith("#"):
                continue
            if name := meant(key, missing):
                raise MjchairError(f"[{section}] unknown key {key!r}; did you mean {name!r}?")
            if section in KNOWN_SECTIONS:
                strange.append(key)
    if strange:
        note(f"tire {stem}: left out keys that no .tir format has: {', '.join(strange)}")


def _family(model: Mapping[str, str]) -> str:
    for key in ("FITTYP", "PROPERTY_FILE_FORMAT"):
        text = _bare(model.get(key, ""))
        if not text:
            continue
        try:
            text = f"{float(text):g}"
        except ValueError:
            text = text.upper()
        if text not in FORMATS:
            raise MjchairError(f"[MODEL] {key} {text!r} is not known" + nearest(text, FORMATS))
        return FORMATS[text]
    raise MjchairError("[MODEL] has no FITTYP (6: 5.2, 61, 62) or PROPERTY_FILE_FORMAT")


def _side(model: Mapping[str, str]) -> str:
    """The side of the vehicle that the coefficients hold for; "" where it is not said."""
    text = _bare(model.get(SIDE, "")).lower()
    if text in NO_SIDE:
        return ""
    if text not in SIDES:
        allowed = ", ".join((*SIDES, "unknown")).upper()
        raise MjchairError(f"[MODEL] {SIDE} is {text.upper()!r}; it must be one of {allowed}")
    return text


def _number(section: str, key: str, text: str) -> float | None:
    """The number of a line; None where it is blank."""
    if not _bare(text):
        return None
    try:
        value = float(_bare(text).replace("D", "e").replace("d", "e"))
    except ValueError:
        raise MjchairError(f"[{section}] {key} is {text[:30]!r}; it must be a number") from None
    if not math.isfinite(value):
        raise MjchairError(f"[{section}] {key} is {value}; it must be finite")
    return value


def _coefficients(raw: Raw, family: str) -> dict[str, float]:
    """The family's coefficients, from whichever section has them, once."""
    known = {name: place for place, names in SECTIONS[family].items() for name in names}
    coefficients: dict[str, float] = {}
    for section, lines in raw.items():
        for key, text in lines.items():
            if key not in known or section == OWN:
                continue
            if key in coefficients:
                raise MjchairError(f"{key} is in [{section}] and in another section; keep one")
            value = _number(section, key, text)
            if value is not None:
                coefficients[key] = value
    return coefficients


def _pac89(capital: Mapping[str, float], unit: float) -> dict[str, float]:
    coefficients = {"load_unit": unit}
    for letter in "BC":
        coefficients[f"has_{letter.lower()}"] = float(any(k.startswith(letter) for k in capital))
    return coefficients | {key.lower(): value for key, value in capital.items()}


def _fields(
    raw: Raw, own: Mapping[str, str], family: str, coefficients: Mapping[str, float], stem: str
) -> dict[str, float]:
    """The other numbers of the tire: those of [MJCHAIR], else those that the file implies."""
    numbers = {"damping_time": DAMPING_TIME}
    if family != "pac89":
        numbers |= {"relaxation_x": 0.0, "relaxation_y": 0.0}  # the file's own
    radius = coefficients.get("UNLOADED_RADIUS")
    if family == "pac89":
        text = raw.get("DIMENSION", {}).get("UNLOADED_RADIUS", "")
        radius = _number("DIMENSION", "UNLOADED_RADIUS", text)
    if radius:
        numbers["radius"] = radius
    elif "RADIUS" not in own:
        note(f"tire {stem}: no UNLOADED_RADIUS; {ASSUMED_RADIUS:g} m is taken")
    nominal = coefficients.get("FNOMIN") or 2000.0
    numbers["nominal_load"] = nominal
    known = {item.name.upper(): item.name for item in fields(Tire) if item.metadata}
    for key, text in own.items():
        if key in OWN_TEXTS:
            continue
        if key not in known:
            raise MjchairError(f"[{OWN}] unknown key {key!r}" + nearest(key, known))
        value = _number(OWN, key, text)
        if value is not None:
            numbers[known[key]] = value
    return numbers


def _unused(raw: Raw, family: str) -> dict[str, str]:
    """What is neither a coefficient nor a unit: section and key to text."""
    known = {name for names in SECTIONS[family].values() for name in names}
    if family == "pac89":
        known |= {"PROPERTY_FILE_FORMAT"}
    skipped = _lines(raw, known, family)
    return {f"{section}.{key}": text for section, key, text in skipped}


def _lines(raw: Raw, known: set[str], family: str) -> Iterable[tuple[str, str, str]]:
    for section, lines in raw.items():
        if section in (OWN, "UNITS"):
            continue
        for key, text in lines.items():
            said = key == "FITTYP" and _bare(text) in ("6", "61")
            said |= key == SIDE and _bare(text).lower() not in NO_SIDE
            if not said and (key not in known or not _bare(text)):
                yield section, key, text
