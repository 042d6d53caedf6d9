"""Figure 13 of Silva & Dedini (COBEM 2007): figure 7 again, on the coefficients they measured.

As figure7.py, which says what the paper gives and what is assumed, with the wheelchair set of
section 3.2 on the rear wheels. The paper prints a0 = 48, which cannot be meant (the force would
change sign inside the measured range); 1.48 is read here, see the tire file. The paper says that
the chair "slips a little" at the end and blames the parameters: their peak friction is 0.2.
"""

from __future__ import annotations

from figure7 import main

CAPTION = (
    "Coefficients measured by the paper at 30-210 N (section 3.2, a0 read as 1.48): peak friction "
    "0.2, {stiffness:.1f} N/deg at 300 N, so the rear tires slip up to {slip:.1f} deg in the same "
    "run. Loads near 0.3 kN lie beyond the measured ones. Pushes, chair and speed are assumptions."
)

if __name__ == "__main__":
    raise SystemExit(
        main("wheelchair_a0_148", "figure13", "Unequal propulsion on the measured tires", CAPTION)
    )
