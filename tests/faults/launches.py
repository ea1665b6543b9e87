"""Refuses launches on the device: each in a run of its own, once or with all that follow, with the
errors by which drivers tell of too little memory. The command then does with less, to the same
result, or says what the device lacks.
Usage: launches.py QJULIA FAULTY_OPENCL_LIBRARY FOLDER [--launches N] [--only NAME]"""

import argparse
import json
import os
import shutil
import subprocess
import sys
from collections import Counter, namedtuple
from concurrent.futures import ThreadPoolExecutor

CODES = {-4: "CL_MEM_OBJECT_ALLOCATION_FAILURE", -5: "CL_OUT_OF_RESOURCES"}
LIMIT = 300  # seconds: what takes longer hangs
Command = namedtuple("Command", "name arguments output")
ICOSAHEDRON = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../data/icosahedron.obj")


class Workshop:
    def __init__(self, qjulia, shim, folder):
        self.qjulia, self.shim, self.folder = qjulia, shim, folder
        shutil.rmtree(folder, ignore_errors=True)
        os.makedirs(folder)

    def path(self, name):
        return os.path.join(self.folder, name)

    def run(self, command, output, environment=None):
        """@return exit code (None: it hangs), what it said, what it printed."""
        words = [self.qjulia, *command.arguments, "-o", output, "--device", "cpu", "--quiet", "--json"]
        try:
            run = subprocess.run(words, capture_output=True, text=True, timeout=LIMIT,
                                 env={**os.environ, "LD_PRELOAD": self.shim,
                                      "ASAN_OPTIONS": "detect_leaks=0:verify_asan_link_order=0",
                                      **(environment or {})})
        except subprocess.TimeoutExpired:
            return None, "", ""
        return run.returncode, run.stderr, run.stdout


def commands(workshop):
    fit = Command("fit", ["fit", ICOSAHEDRON, "--factors", "24", "--max-evaluations", "24"],
                  workshop.path("icosahedron.qjulia.json"))
    workshop.run(fit, fit.output)
    return [fit, Command("surface", ["surface", fit.output, "--resolution", "48"], "surface.ply"),
            Command("render", ["render", fit.output, "--size", "48x36"], "picture.png")]


def result_of(command, output, printed):
    """What must not differ: a fit may take other steps with less memory, to about the same shape."""
    if command.name == "fit":
        return round(json.loads(printed)["metrics"]["iou"], 2)
    with open(output, "rb") as file:
        return file.read()


def spread(count, most):
    """Some numbers below `count`, the first and the last among them."""
    if count <= most:
        return list(range(count))
    return sorted({round(i * (count - 1) / (most - 1)) for i in range(most)})


def trial(workshop, command, whole, first, count, code):
    """@return the state, and what is wrong."""
    suffix = os.path.basename(command.output).split(".", 1)[1]
    output = workshop.path(f"{command.name}.{first}.{count}.{-code}.{suffix}")
    exit_code, said, printed = workshop.run(command, output,
                                            {"QJULIA_TEST_FAULTS": f"{first}:{count}:{code}"})
    if exit_code is None:
        return "hangs", "it hangs"
    if exit_code == 0:
        found = result_of(command, output, printed)
        os.remove(output)
        close = command.name == "fit" and abs(found - whole) <= 0.03
        return "does with less", None if found == whole or close else "another result"
    wrong = None
    if exit_code != 1:
        wrong = f"exit code {exit_code}"
    elif CODES[code] not in said or "too little memory" not in said:
        wrong = "the message does not say what the device lacks"
    elif os.path.exists(output):
        wrong = "it left an output"
    return "says so", wrong and wrong + ": " + said.strip()[-300:]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("qjulia")
    parser.add_argument("shim")
    parser.add_argument("folder")
    parser.add_argument("--launches", type=int, default=1000, help="of each command, at most")
    parser.add_argument("--only", default="", help="the commands whose names hold this")
    arguments = parser.parse_args()
    workshop = Workshop(arguments.qjulia, os.path.abspath(arguments.shim), arguments.folder)
    trials, wholes = [], {}
    for command in commands(workshop):
        if arguments.only not in command.name:
            continue
        log = workshop.path(command.name + ".launches")
        output = workshop.path("whole." + os.path.basename(command.output))
        exit_code, said, printed = workshop.run(command, output, {"QJULIA_TEST_LAUNCHES": log})
        if exit_code != 0:
            raise SystemExit(f"{command.name} fails by itself: {said}")
        wholes[command.name] = result_of(command, output, printed)
        with open(log) as file:
            kernels = file.read().split()
        for number in spread(len(kernels), arguments.launches):
            code = sorted(CODES)[number % 2]
            many = 1 if number % 3 else 1_000_000
            trials.append((command, kernels[number], number, many, code))
        print(f"{command.name}: {len(kernels)} launches")
    states, problems = Counter(), 0
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = pool.map(lambda t: trial(workshop, t[0], wholes[t[0].name], *t[2:]), trials)
        for (command, kernel, number, many, code), (state, wrong) in zip(trials, results):
            states[f"{command.name} {state}"] += 1
            problems += wrong is not None
            if wrong:
                print(f"{command.name}, launch {number} ({kernel}, {many} of them, {code}): {wrong}",
                      flush=True)
    print(f"{len(trials)} refused launches: {dict(sorted(states.items()))}; {problems} with problems")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
