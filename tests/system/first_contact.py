"""tools/dev/first-contact: a step that hangs is ended and reported, and the page says so; with --whole, all
steps on the device that there is.
Usage: first_contact.py TOOL QJULIA FOLDER [--whole]"""

import json
import shutil
import subprocess
import sys
import tarfile
import time
from pathlib import Path

# Knows the devices, and hangs in doctor, with a child, whatever it is asked to do.
HANGING = """#!/bin/bash
case $1 in
  --version) echo "qjulia 0" ;;
  devices) echo '{"chosen": "0:0", "devices": [{"id": "0:0", "name": "A GPU"}]}' ;;
  doctor) trap "" TERM; sleep 1000 & echo $! > child; echo "half a report"; wait; sleep 1000 ;;
  *) echo "no such thing" >&2; exit 3 ;;
esac
"""


def check(condition, what):
    if not condition:
        raise SystemExit("FAILED: " + what)


def is_alive(process):
    stat = Path(f"/proc/{process}/stat")
    return stat.exists() and stat.read_text().rsplit(")", 1)[1].split()[0] != "Z"


def contact(tool, qjulia, output, *options):
    return subprocess.run([sys.executable, tool, "--qjulia", qjulia, "-o", output, *options],
                          capture_output=True, text=True)


def states(output):
    steps = json.loads((output / "report.json").read_text())["steps"]
    return {step["name"]: step["state"] for step in steps}


def page_of(tool, output):
    page = output.parent / "page.md"
    made = subprocess.run([sys.executable, tool, "--page", f"{output}.tar.gz", "-o", page],
                          capture_output=True, text=True)
    check(made.returncode == 0, "a page is made of the bundle: " + made.stderr)
    return page.read_text()


def hanging(tool, folder):
    told = subprocess.run([sys.executable, tool, "--help"], capture_output=True, text=True)
    check(told.returncode == 0 and "please send it" in told.stdout, "it says what it does")
    fake = folder / "qjulia"
    fake.write_text(HANGING)
    fake.chmod(0o755)
    quick = folder / "quick"
    run = contact(tool, fake, quick, "--only", "devices,tune")
    check(run.returncode == 1, f"a step that fails is a failure: {run.stdout}{run.stderr}")
    found = states(quick)
    check(found == {"devices": "done", "tune": "failed with exit code 3"}, f"the next step runs: {found}")
    check("# A GPU" in page_of(tool, quick), "the page names the device")
    output = folder / "hanging"
    run = contact(tool, fake, output, "--only", "doctor", "--limits", "0.01")
    check(run.returncode == 1, f"a step that hangs is a failure: {run.stdout}{run.stderr}")
    found = states(output)
    check(found["doctor"] == "ended at its limit", f"the doctor is ended: {found}")
    child = output / "child"  # there, unless the machine is too busy to begin
    process = int(child.read_text() or 0) if child.exists() else 0
    for _ in range(50):
        if not process or not is_alive(process):
            break
        time.sleep(0.1)
    check(not process or not is_alive(process), "what the step started is ended with it")
    with tarfile.open(f"{output}.tar.gz") as archive:
        names = archive.getnames()
    check({"hanging/report.json", "hanging/logs/doctor.txt"} <= set(names), f"the bundle is whole: {names}")
    page = page_of(tool, output)
    check("| doctor | ended at its limit |" in page, "the page says so: " + page)
    late = folder / "late"
    contact(tool, fake, late, "--only", "doctor,tune", "--limits", "0.001")
    found = states(late)
    check(found["tune"] == "left out: the time for all steps is over", f"all steps have a limit: {found}")
    again = contact(tool, fake, output)
    check(again.returncode == 2 and "is there already" in again.stderr, "no folder is overwritten")


def whole(tool, qjulia, folder):
    output = folder / "whole"
    run = contact(tool, qjulia, output, "--limits", "6")
    found = states(output)
    check(run.returncode == 0, f"all steps are done: {found} {run.stdout}{run.stderr}")
    page = page_of(tool, output)
    for part in ("## Doctor", "## Kernels", "| fit |", "| explore |", "picture.png"):
        check(part in page, f"the page has {part}: {page}")


def main():
    tool, qjulia, folder = sys.argv[1], Path(sys.argv[2]).resolve(), Path(sys.argv[3]).resolve()
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    if "--whole" in sys.argv:
        whole(tool, qjulia, folder)
    else:
        hanging(tool, folder)
    print("first contact: as expected")


if __name__ == "__main__":
    main()
