"""Writes core/simulator/optics/glass_catalogue/*.inc from the vendors' published tables.

    pip install opticalglass
    python tests/peers/make_glass_catalogue.py core/simulator/optics/glass_catalogue

opticalglass contains the vendors' own spreadsheets. The coefficients of every glass must give the printed index of the d line
within 2e-5; other glasses are left out and printed. core/simulator/optics/glass_catalogue/other.inc is written by hand.
"""

import math
import sys
from pathlib import Path

import opticalglass
from opticalglass import glassfactory

LINE_D_UM = 0.5875618
VENDORS = ["Schott", "Ohara", "Hoya", "Hikari", "CDGM", "Sumita"]  # where two have a name, the earlier one keeps it
SELLMEIER, POLYNOMIAL, LONG_POLYNOMIAL = 2, 1, 13  # numbers of AGF formulas
FORMULAS = {"Schott": SELLMEIER, "Ohara": SELLMEIER, "Hikari": LONG_POLYNOMIAL}


def index(formula, c, um):
    w = um * um
    if formula == SELLMEIER:
        return math.sqrt(1 + sum(c[i] * w / (w - c[i + 1]) for i in (0, 2, 4)))
    powers = [0, 1, -1, -2, -3, -4] if formula == POLYNOMIAL else [0, 1, 2, -1, -2, -3, -4, -5, -6]
    return math.sqrt(sum(value * w**power for value, power in zip(c, powers)))


def rows(vendor, taken):
    catalogue = glassfactory.get_glass_catalog(vendor)
    formula = FORMULAS.get(vendor, POLYNOMIAL)
    for name in sorted({str(name) for name in catalogue.get_glass_names()}):
        try:
            glass = catalogue.create_glass(name, vendor)
        except ValueError:  # without coefficients in the table
            print(f"left out: {vendor} {name}", file=sys.stderr)
            continue
        c = [float(value) for value in glass.coefs]
        if formula == SELLMEIER:  # B1 B2 B3 C1 C2 C3 in the table
            c = [c[0], c[3], c[1], c[4], c[2], c[5]]
        c = [float(f"{value:.10g}") for value in c]
        data = catalogue.glass_data(name)
        printed = next(float(data[key]) for key in data.index if key[1] in ("d", "nd"))
        if any(math.isnan(value) for value in c) or not abs(index(formula, c, LINE_D_UM) - printed) < 2e-5:
            print(f"left out: {vendor} {name}", file=sys.stderr)
            continue
        while len(c) > 1 and c[-1] == 0:
            c.pop()
        unique = name.rstrip("*")
        key = unique.upper()
        if key in taken:
            if taken[key] == vendor:
                continue
            unique += "_" + vendor.upper()
        taken[unique.upper()] = vendor
        yield f'{{"{unique}", {formula}, {{{", ".join(repr(value) for value in c)}}}}},'


def main():
    folder = Path(sys.argv[1])
    taken = {}
    for vendor in VENDORS:
        text = [
            f"// {vendor}: published dispersion coefficients, from the vendor's spreadsheet in opticalglass "
            f"{getattr(opticalglass, '__version__', '')}".rstrip() + ".",
            "// Written by tests/peers/make_glass_catalogue.py; name, number of the AGF formula, coefficients.",
            *rows(vendor, taken),
        ]
        (folder / f"{vendor.lower()}.inc").write_text("\n".join(text) + "\n")
        print(vendor, len(text) - 2)


if __name__ == "__main__":
    main()
