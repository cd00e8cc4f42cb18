#!/usr/bin/env python3
"""Writes values of tables/checks.csv, and tables of tables/variations.csv, into the pages of this folder and the README, so that no
page has an older build's.

    docs/results/values.py [--check]

A comment behind a number says where it is from: `23.5<!--rings/usavg:they-fly-off-->` is the value of the check of that
variant (none: the scene as it stands) whose name begins so; `<!--rings:energy:error*100-->` is another column in percent. The
number keeps its decimals, or its digits if it has an exponent. `<!-- variations: NAME -->` stands above a table of variations.py.
`--check` changes nothing and fails if a page differs.
"""

import csv
import functools
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
PAGES = [*sorted(HERE.glob("*.md")), HERE.parent.parent / "README.md"]
SOURCE = re.compile(r"(-?\d[\d.]*(?:e-?\d+)?)<!--([\w/]+):([\w.,^()'=+-]+)(?::(\w+))?(?:([*/])(-?[\d.]+(?:e-?\d+)?))?-->")
VARIATIONS = re.compile(r"(<!-- variations: (\w+) -->\n)\n*(?:\|.*\n)*\n*")


@functools.cache
def table(name):
    with open(HERE / "tables" / f"{name}.csv", encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def variations(match):
    """A table of what changed values come to."""
    found = {(row["changed"], row["column"]): row["value"] for row in table("variations") if row["table"] == match[2]}
    labels, columns = ([*dict.fromkeys(key[n] for key in found)] for n in range(2))
    line = lambda words: "| " + " | ".join(words) + " |\n"
    head = line(["changed", *columns]) + line(["---"] * (1 + len(columns)))
    rows = [line([label, *(found.get((label, column), "") for column in columns)]) for label in labels]
    return "\n".join([match[1], head + "".join(rows), ""])


def found(rows, scene, check):
    """The row of a check."""
    scene, _, variant = scene.partition("/")
    rows = [row for row in rows if row["scene"].split("/")[1] == scene and row["variant"] == (variant or "plain")]
    rows = [row for row in rows if row["check"].replace(" ", "-").startswith(check)]
    if len(rows) != 1:
        sys.exit(f"{len(rows)} checks of {scene}/{variant} begin with {check}")
    return rows[0]


def written(rows, match):
    old, scene, check, column, sign, factor = match.groups()
    value = float(found(rows, scene, check)[column or "value"])
    factor = float(factor or 1)
    value = value / factor if sign == "/" else value * factor
    mantissa, exponent, _ = old.partition("e")
    decimals = len(mantissa.partition(".")[2])
    new = re.sub(r"e([+-])0*", lambda e: "e" + e[1].strip("+"), f"{value:.{decimals}e}") if exponent else f"{value:.{decimals}f}"
    return new + match[0][len(old):]


def main():
    rows, differs = table("checks"), False
    for page in PAGES:
        text = page.read_text()
        new = VARIATIONS.sub(variations, SOURCE.sub(lambda match: written(rows, match), text))
        if left := re.search(r"<!--\w+[/:][^>]*-->", SOURCE.sub("", text)):
            sys.exit(f"{page.name}: {left[0]} names no check behind a number")
        if new != text:
            differs = True
            print(f"{page.name}: {sum(a != b for a, b in zip(text.splitlines(), new.splitlines()))} lines differ")
            if "--check" not in sys.argv:
                page.write_text(new)
    if differs and "--check" in sys.argv:
        sys.exit("run docs/results/values.py")


if __name__ == "__main__":
    main()
