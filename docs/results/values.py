#!/usr/bin/env python3
"""Writes values of tables/checks.csv, tables of tables/variations.csv, and errors of studies/*.csv, into the pages of this folder and
the README, so that no page has an older build's.

    docs/results/values.py [--check]

A comment behind a number says where it is from: `23.5<!--rings/usavg:they-fly-off-->` is the value of the check of that
variant (none: the scene as it stands) whose name begins so; `<!--rings:energy:error*100-->` is another column in percent. The
number keeps its decimals, or its digits if it has an exponent. `<!-- variations: NAME -->` stands above a table of variations.py;
`0.244<!--variations/gate:the-scene:hit-->` is of its row that is called so or has these words, in the column that begins so.
`--check` changes nothing and fails if a page differs.
"""

import csv
import functools
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
PAGES = [*sorted(HERE.glob("*.md")), HERE.parent.parent / "README.md"]
SOURCE = re.compile(r"(-?\d[\d.]*(?:e-?\d+)?)<!--([\w/]+):([\w.,^()'=+-]+)(?::([\w.,/-]+))?(?:([*/])(-?[\d.]+(?:e-?\d+)?))?-->")
VARIATIONS = re.compile(r"(<!-- variations: (\w+) -->\n)\n*(?:\|.*\n)*\n*")

STUDY = re.compile(r"(<!-- study: (\w+) -->\n)\n*(?:\|.*\n)*\n*")


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


def errors(match):
    """A table of the errors of a study, over its resolution."""
    with open(HERE / "studies" / f"{match[2]}.csv", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["error [1]"]]
    orders = re.search(rf"\[{match[2]}\]\S* \| (.*?) \|", (HERE / "studies.md").read_text())[1]
    text = "| curve | order | resolution: error |\n| --- | --- | --- |\n"
    for curve in dict.fromkeys(row["curve"] for row in rows):
        of = [row for row in rows if row["curve"] == curve]
        name = curve or "all runs"
        order = re.search(rf"{re.escape(name)} (-?[\d.]+|none)", orders)[1]
        number = lambda value: re.sub(r"e([+-])0*", lambda e: "e" + e[1].strip("+"), f"{float(value):.2g}")
        text += f"| {name} | {order} | " + ", ".join(f"{float(row['resolution']):.4g}: {number(row['error [1]'])}" for row in of) + " |\n"
    return f"{match[1]}\n{text}\n"


def found(rows, scene, check):
    """The row of a check."""
    scene, _, variant = scene.partition("/")
    rows = [row for row in rows if row["scene"].split("/")[1] == scene and row["variant"] == (variant or "plain")]
    rows = [row for row in rows if row["check"].replace(" ", "-").startswith(check)]
    if len(rows) != 1:
        sys.exit(f"{len(rows)} checks of {scene}/{variant} begin with {check}")
    return rows[0]


def varied(name, changed, column):
    """A value of variations."""
    words = lambda text: text.replace(" ", "-")
    rows = [row for row in table("variations") if row["table"] == name and words(row["column"]).startswith(column)]
    rows = [row for row in rows if words(row["changed"]) == changed] or [row for row in rows if changed in words(row["changed"])]
    if len(rows) != 1:
        sys.exit(f"{len(rows)} values of the table {name} are of {changed}, {column}")
    return re.match(r"[-+]?[\d.]+(e-?\d+)?", rows[0]["value"])[0]


def written(rows, match):
    old, scene, check, column, sign, factor = match.groups()
    source, _, name = scene.partition("/")
    value = float(varied(name, check, column) if source == "variations" else found(rows, scene, check)[column or "value"])
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
        new = STUDY.sub(errors, VARIATIONS.sub(variations, SOURCE.sub(lambda match: written(rows, match), text)))
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
