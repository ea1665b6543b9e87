"""Profiles in other programs' formats, against what these programs document of them.

usage: profile_formats.py QJULIA FOLDER MAP
"""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import jsonschema

NUMBER = {"type": "number"}
TEXT = {"type": "string"}


def record(required, **properties):
    return {"type": "object", "properties": properties, "required": required.split()}


def array(items, least=1):
    return {"type": "array", "items": items, "minItems": least}


# https://github.com/google/benchmark: reporters and tools/gbench/report.py
GOOGLE_BENCHMARK = record(
    "context benchmarks",
    context=record("date executable num_cpus caches load_avg library_build_type", num_cpus={"type": "integer"}),
    benchmarks=array(record(
        "name run_name run_type repetitions repetition_index threads iterations real_time cpu_time time_unit",
        run_type={"enum": ["iteration", "aggregate"]}, real_time=NUMBER, cpu_time=NUMBER,
        time_unit={"enum": ["ns", "us", "ms", "s"]})))
# https://bencher.dev/docs/reference/bencher-metric-format
METRIC = record("value", value=NUMBER, lower_value=NUMBER, upper_value=NUMBER)
BENCHER = {"type": "object", "minProperties": 1,
           "additionalProperties": {**record("latency"), "additionalProperties": METRIC}}
# Results and inputs of autotuners: the rules of kernel_tuner/schema/T4/1.0.0/results-schema.json and
# T1/1.0.0/input-schema.json for what is written here, and stricter where these allow anything.
T4 = record("schema_version results",
            schema_version={"type": "string", "pattern": r"^[0-9]+\.[0-9]+\.[0-9]+$"},
            results=array(record(
                "timestamp configuration objectives times invalidity correctness measurements",
                timestamp=TEXT, configuration={"type": "object", "minProperties": 1}, objectives=array(TEXT),
                times=record("runtimes", runtimes=array(NUMBER, 0), compilation_time=NUMBER, framework=NUMBER,
                             search_algorithm=NUMBER, validation=NUMBER),
                invalidity={"enum": ["timeout", "compile", "runtime", "correctness", "constraints", "correct"]},
                correctness=NUMBER,
                measurements=array(record("name value unit", name=TEXT, value=NUMBER, unit=TEXT)))))
T1 = record("ConfigurationSpace KernelSpecification",
            General=record("FormatVersion", FormatVersion={"type": "integer"},
                           TimeUnit={"enum": ["Nanoseconds", "Microseconds", "Milliseconds", "Seconds"]},
                           OutputFormat={"enum": ["JSON", "XML"]}),
            ConfigurationSpace=record(
                "TuningParameters",
                TuningParameters=array(record(
                    "Name Type Values", Name=TEXT, Type={"enum": ["int", "uint", "float", "bool", "string"]},
                    Values=TEXT)),
                Conditions=array(record("Parameters Expression", Parameters=array(TEXT), Expression=TEXT), 0)),
            KernelSpecification=record("Language KernelName KernelFile GlobalSize LocalSize",
                                       Language={"enum": ["OpenCL", "CUDA", "Vulkan"]}, KernelName=TEXT, KernelFile=TEXT,
                                       Device=record("Name", Name=TEXT),
                                       GlobalSize=record("X", X=TEXT), LocalSize=record("X", X=TEXT)))
MADE = record("program version build date load_average job", load_average=array(NUMBER, 3),
              date={"type": "string", "pattern": r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$"},
              job=record("command options version"))


def check(holds, what):
    if not holds:
        sys.exit(f"profile_formats: {what}")


def expect_valid(name, thing, schema):
    try:
        jsonschema.validate(thing, schema)
    except jsonschema.ValidationError as error:
        sys.exit(f"profile_formats: {name}: {error.message} at {list(error.absolute_path)}")


class Program:
    def __init__(self, path, folder):
        self.path = path
        self.environment = {**os.environ, "XDG_CACHE_HOME": str(folder / "cache"), "QJULIA_DEVICE": "cpu"}
        if "POCL_CACHE_DIR" not in os.environ and "XDG_CACHE_HOME" in os.environ:
            self.environment["POCL_CACHE_DIR"] = os.environ["XDG_CACHE_HOME"] + "/pocl"

    def __call__(self, *words, code=0):
        done = subprocess.run([self.path, *words], env=self.environment, capture_output=True, text=True)
        check(done.returncode == code, f"{words}: exit code {done.returncode}: {done.stderr}")
        return done.stdout if code == 0 else done.stderr


def check_compare(program, small, google, folder):
    """Google Benchmark's own tool (Debian: libbenchmark-tools) reads two profiles and tests the runs of each kernel."""
    tool = Path("/usr/share/benchmark/compare.py")
    if not tool.exists():
        print("compare.py is not here: install libbenchmark-tools")
        return
    (folder / "a.json").write_text(json.dumps(google))
    (folder / "b.json").write_text(program(*small, "--export", "google-benchmark"))
    done = subprocess.run(["/usr/bin/python3", tool, "--no-color", "benchmarks", folder / "a.json", folder / "b.json"],
                          capture_output=True, text=True)
    check(done.returncode == 0, f"compare.py: {done.stderr}")
    rows = [line.split()[0] for line in done.stdout.splitlines() if line.startswith("energy")]
    check(rows.count("energy/n:1") >= 5 and rows.count("energy/n:1_pvalue") == 1, f"compare.py: {done.stdout}")


def check_measure(program, map_file, folder):
    small = ("profile", "measure", map_file, "--kernels", "energy", "--sample-points", "2000", "--repeats", "5")
    report = json.loads(program(*small, "--json"))
    expect_valid("provenance", report["made"], MADE)
    check(len(report["made"]["job"]["fnv1a64"]["map"]) == 16, "the map's hash is missing")
    check("host" not in report["made"], "the host's name is told unasked")
    check("host" in json.loads(program(*small, "--json", "--host-name"))["made"], "the host's name is not told")

    google = json.loads(program(*small, "--export", "google-benchmark"))
    expect_valid("google-benchmark", google, GOOGLE_BENCHMARK)
    names = [row["name"] for row in google["benchmarks"]]
    check(names.count("energy/n:1") >= 5, f"fewer than five runs of energy: {names}")
    check_compare(program, small, google, folder)

    bencher = json.loads(program(*small, "--export", "bencher"))
    expect_valid("bencher", bencher, BENCHER)
    for name, measures in bencher.items():
        for measure in measures.values():
            check(measure["lower_value"] <= measure["value"] <= measure["upper_value"], f"bounds of {name}")

    lines = [json.loads(line) for line in program(*small, "--export", "lines").splitlines()]
    expect_valid("lines", lines[0]["made"], MADE)
    check({row["kernel"] for row in lines[1:]} == {"energy"}, "lines of other kernels")

    text = program(*small, "--export", "pasteable")
    check(text.startswith("qjulia ") and text.count("```") == 2 and "energy" in text, text)
    refused = program(*small, "--export", "lines", "--json", code=2)
    check("--export lines and --json both say what is printed; give one of them" in refused, refused)
    check("google-benchmark, bencher" in program(*small, "--export", "xml", code=2), "a bad format's message")


def check_grid(program):
    small = ("profile", "grid", "panel_block=32,64", "--sample-points", "500", "--factors", "20", "--repeats", "2")
    results = json.loads(program(*small, "--export", "t4"))
    expect_valid("t4", results, T4)
    check([row["configuration"]["panel_block"] for row in results["results"]] == [32, 64], "its configurations")
    check(all(row["invalidity"] == "correct" and len(row["times"]["runtimes"]) == 10 for row in results["results"]),
          "its runs: two of five jobs each")
    space = json.loads(program(*small, "--export", "t1"))
    expect_valid("t1", space, T1)
    parameters = {row["Name"]: row["Values"] for row in space["ConfigurationSpace"]["TuningParameters"]}
    check(parameters["panel_block"] == "[32, 64]", parameters)


def check_page(program, map_file, folder):
    small = ("profile", "measure", map_file, "--kernels", "energy*", "--sample-points", "2000", "--repeats", "5")
    now = json.loads(program(*small, "--json"))
    earlier = json.loads(json.dumps(now))
    earlier["made"].update(date="2020-01-02T03:04:05Z", commit="0123456789ab")
    earlier["device"]["driver"] = "driver <1>"
    for name, report in (("now.json", now), ("earlier.json", earlier), ("other.json", {"kernels": []})):
        (folder / name).write_text(json.dumps(report))
    page = folder / "page.html"
    program("profile", "report", str(folder / "now.json"), str(folder / "earlier.json"), "-o", str(page))
    text = page.read_text()
    check(text.index("earlier.json") < text.index("now.json"), "reports are not in the order of their dates")
    check(f"commit: 0123456789ab → {now['made']['commit'] or '-'}" in text, "a changed commit is not told")
    check("driver: driver &lt;1&gt; → " in text, "a changed driver is not told")
    for place in ("src", "href"):
        for address in re.findall(rf'{place}="([^"]*)"', text):
            check(address.startswith("data:"), f"the page needs {address}")
    # A roofline, and a plot for each kernel of both reports.
    check(text.count("<figure>") == 1 + len(now["kernels"]), "its plots")
    refused = program("profile", "report", str(folder / "other.json"), "-o", str(page), code=2)
    check("'other.json' is no report of 'qjulia profile measure --json'" in refused, refused)
    check(len(refused.splitlines()) == 1, refused)
    now["kernels"][0]["runs"] = {"seconds": [], "cpu_seconds": None}
    (folder / "empty.json").write_text(json.dumps(now))
    refused = program("profile", "report", str(folder / "empty.json"), "-o", str(page), code=2)
    check("'empty.json': a kernel has no runs" in refused, refused)


def check_command(program, map_file, folder):
    program("surface", map_file, "-o", str(folder / "s.ply"), "--resolution", "32", "--profile",
            str(folder / "s.json"))
    expect_valid("--profile", json.loads((folder / "s.json").read_text())["made"], MADE)


def main(path, folder, map_file):
    folder = Path(folder)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    program = Program(path, folder)
    check_measure(program, map_file, folder)
    check_grid(program)
    check_command(program, map_file, folder)
    check_page(program, map_file, folder)
    print("six formats and two profiles hold what is documented")


if __name__ == "__main__":
    main(*sys.argv[1:])
