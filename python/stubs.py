"""Writes the keywords that come from the library's tables into the package's stubs.

Each place begins with a line ``# TABLE`` and ends with ``# end of TABLE``, where the core has a function TABLE.

usage: stubs.py [STUBS]: PYTHONPATH leads to the built package; STUBS are written anew
"""

import re
import sys
from pathlib import Path

STUBS = Path(__file__).parent / "qjulia" / "__init__.pyi"
# A word stands for a detail that is chosen for the map.
WIDER = {("knob_table", "detail"): "Optional[_Detail]"}


def with_keywords(text):
    """The stubs with the keywords that the built package has; a function's own stand before those of tables."""
    from qjulia import _core

    lines, named, table = [], set(), None
    for line in text.splitlines():
        if table is not None:
            if line.strip() == f"# end of {table}":
                lines.append(line)
                table = None
            continue
        lines.append(line)
        if re.match(r" *def ", line):
            named = set()
        elif keyword := re.match(r" +(\w+): .* = \.\.\.,$", line):
            named.add(keyword.group(1))
        elif place := re.match(r"( +)# (\w+)$", line):
            indent, table = place.groups()
            for row in getattr(_core, table)():
                if row["name"] not in named:
                    kind = WIDER.get((table, row["name"]), row["type"])
                    lines.append(f"{indent}{row['name']}: {kind} = ...,")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.path.pop(0)  # the package's sources lie beside this script, and the core does not
    stubs = Path(sys.argv[1]) if len(sys.argv) > 1 else STUBS
    stubs.write_text(with_keywords(stubs.read_text()))
