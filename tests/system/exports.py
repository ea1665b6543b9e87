"""The shared libraries show what public headers declare, all of it and nothing else.

usage: exports.py REPOSITORY NM FOLDER
"""
import pathlib
import re
import subprocess
import sys

# What stands in the namespace qjulia itself, after what nm calls vtables and the like.
SHOWN = re.compile(r"^(?:(?:typeinfo(?: name)?|vtable|VTT) for )?qjulia::(~?\w+|operator[^(]+)")
PRIVATE = "QJULIA_PRIVATE_"
# The shared libraries, and the rooms in each that others of them need.
LIBRARIES = {
    "qjulia_field": {"base", "device", "map", "reference", "energy"},
    "qjulia_mesh": {"shape", "surface"},
    "qjulia_fit": {"fitting"},
    "qjulia_picture": {"picture"},
    "qjulia": set(),
}


def symbols(nm, *words):
    """Pairs of a symbol's demangled name and its version, of those that are defined."""
    lines = subprocess.run([nm, *words, "--defined-only"], check=True, capture_output=True, text=True).stdout
    found = []
    for line in lines.splitlines():
        match = re.match(r"^[0-9a-f]+ ([A-Z]) (.*)$", line)
        if match and match[1] not in "A":
            name, _, version = match[2].partition("@")
            found.append((match[1], name, version.lstrip("@")))
    return found


def main(repository, nm, folder):
    words = set()
    for header in pathlib.Path(repository, "include").rglob("*.hpp"):
        words |= set(re.findall(r"\w+", header.read_text()))
    problems, count = [], 0
    for name, rooms in LIBRARIES.items():
        shown = set()
        for _, symbol, version in symbols(nm, "-DC", "--with-symbol-versions", f"{folder}/lib{name}.so"):
            first = SHOWN.match(symbol)
            shown.add(symbol)
            if version.startswith(PRIVATE):
                if not any(f"qjulia::{room}::" in symbol for room in rooms):
                    problems.append(f"lib{name}.so: {symbol} has a private version")
            elif not first or (first[1] not in words and "operator" not in first[1]):
                problems.append(f"lib{name}.so shows {symbol}, which no public header declares")
        for kind, symbol, _ in symbols(nm, "-C", f"{folder}/lib{name}.a"):
            first = SHOWN.match(symbol)
            # Functions, and members of classes, that are compiled once; templates are in headers.
            if kind != "T" or not first or "[clone" in symbol:
                continue
            is_nested = re.match(r"qjulia::[a-z_0-9]+::", symbol)
            if first[1] in words and not is_nested:
                count += 1
                if symbol not in shown:
                    problems.append(f"lib{name}.so hides {symbol}")
    if count < 150:
        problems.append(f"only {count} public functions were found in the static libraries")
    print("\n".join(problems) or f"{count} public functions are shown, and nothing else")
    return 1 if problems else 0


sys.exit(main(*sys.argv[1:]))
