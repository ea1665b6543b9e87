#!/usr/bin/python3
"""tools/experiments/reproduce lists its claims, each with what is expected, and refuses a claim it does not know.

    reproduce.py REPOSITORY
"""
import re
import subprocess
import sys
from pathlib import Path

TOOL = Path(sys.argv[1]) / "tools/experiments/reproduce"


def run(*arguments):
    return subprocess.run([sys.executable, TOOL, *arguments], capture_output=True, text=True)


listed = run("--list")
assert listed.returncode == 0, listed.stderr
claims = {}
for line in listed.stdout.splitlines():
    if not line.startswith(" "):
        name, _, about = line.partition(": ")
        assert about, f"{name} is not described"
        claims[name] = 0
    else:
        bounds = re.fullmatch(r" +.*: (\S+) to (\S+)", line)
        assert bounds and float(bounds[1]) <= float(bounds[2]), f"no bounds: {line}"
        claims[name] += 1
assert len(claims) == 7, claims
for name, expected in claims.items():
    assert expected > 0, f"{name} expects nothing"

page = (Path(sys.argv[1]) / "docs/theory/kim2015.md").read_text()
for name in claims:
    assert f"`{name}`" in page, f"docs/theory/kim2015.md does not say what the paper says of {name}"

assert "--quick" in run("--help").stdout
wrong = run("--only", "nonsense")
assert wrong.returncode == 2 and "nonsense" in wrong.stderr, wrong.stderr
