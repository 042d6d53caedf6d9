"""Braking distance and range of a power chair with each of its profiles, beside published ones.

    python scripts/power_ranges.py [--model power]

The tests of `mjchair test` with a dummy of 100 kg: a stop from full speed by release, by reverse
and by power off, on the level and down 3 and 6 deg; laps with and without a stop. No number of the
chair or of its drive was chosen by these results. Published: Pearlman 2005, four types of chairs.
"""

from __future__ import annotations

import argparse
import sys

from mjchair.drive.files import profiles
from mjchair.model import assets
from mjchair.model.spec import drive_file
from mjchair.testlab import Design
from mjchair.testlab.brakes import WAYS, brakes
from mjchair.testlab.energy import energy

SLOPES = (0.0, 3.0, 6.0)  # deg
PUBLISHED = "published: braking 7.4 to 117.3 cm, range 18.2 to 32.0 km"


def row(model: str, profile: str) -> str:
    """The numbers of one profile, as a line of a table."""
    design = Design(model, 100.0, drive=profile)
    stops, laps = brakes(design, slopes=SLOPES), energy(design)
    distances = [
        " / ".join(f"{stops[f'stopping_{way}_{slope:g}_deg'] / 10.0:.0f}" for way in WAYS)
        for slope in SLOPES
    ]
    ranges = [f"{laps[f'range_{kind}']:.1f}" for kind in ("manoeuvring", "continuous")]
    return "| " + " | ".join([f"`{profile}`", *distances, *ranges]) + " |"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--model", default="power", help="default: %(default)s")
    args = parser.parse_args()
    print("| profile | level, cm | down 3 deg | down 6 deg | range with stops, km | without |")
    print("|---|---|---|---|---|---|")
    for profile in profiles(drive_file(assets.find("model", args.model, assets.chairs()))):
        print(row(args.model, profile), flush=True)
    print(PUBLISHED)
    return 0


if __name__ == "__main__":
    sys.exit(main())
