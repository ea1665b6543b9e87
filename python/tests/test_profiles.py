"""Profiles, tuning and checks of a device say what the command says."""

import json
import os

import numpy as np
import pytest

import qjulia

SCHEMAS = os.path.join(os.path.dirname(__file__), "..", "..", "docs", "reference", "schemas")
SMALL = {"sample_points": 500, "factors": 16, "repeats": 1}
CHOSEN = "energy*,gauss*"


def expect_schema(report, name):
    """The report is what the schema of the command's says, but for the command."""
    jsonschema = pytest.importorskip("jsonschema")
    with open(os.path.join(SCHEMAS, name)) as file:
        schema = json.load(file)
    if "made" in report:
        made = schema["properties"]["made"]
        made["required"].remove("job")
        assert "job" not in report["made"]
    jsonschema.validate(report, schema)


@pytest.fixture(scope="module")
def report(device):
    return qjulia.profile(**SMALL, kernels=CHOSEN, device=device)


def test_a_profile_is_that_of_the_command(report, command):
    expect_schema(report, "profile.json")
    words = ["--sample-points", 500, "--factors", 16, "--repeats", 1, "--kernels", CHOSEN]
    theirs = json.loads(command("profile", "measure", *words, "--json"))
    names = ("kernel", "iterations", "samples", "factors", "width", "precision", "slots", "memory_bytes")
    mine = [[kernel[name] for name in names] for kernel in report["kernels"]]
    assert len(mine) == 5
    assert mine == [[kernel[name] for name in names] for kernel in theirs["kernels"]]
    assert set(theirs["made"]) - set(report["made"]) == {"job"}


def test_a_profile_of_a_map_and_a_mesh(map, torus, device):
    said = []
    found = qjulia.profile(
        map,
        *torus,
        sample_points=500,
        repeats=1,
        kernels=["energy", "dist*"],
        device=device,
        on_progress=lambda *progress: said.append(progress),
    )
    kernels = {kernel["kernel"]: kernel for kernel in found["kernels"]}
    assert kernels["energy"]["factors"] == len(map.factors)
    assert any(name.startswith("dist") for name in kernels)
    assert said and "host" not in found["made"]


def test_tuning_leaves_what_it_is_told_to_leave(device):
    found = qjulia.tune(**SMALL, keep=False, device=device)
    expect_schema(found, "profile-tune.json")
    assert found["precision"] == "single" and not os.path.exists(found["file"])


def test_a_doctor_finds_nothing(device):
    found = qjulia.doctor(programs="reduce.*", device=device)
    expect_schema(found, "doctor.json")
    assert found["passed"] and {check["program"] for check in found["programs"]} == {"reduce.cl"}
    assert all(check["seconds"] > 0 for check in found["programs"])


def test_a_launch_of_ones_own_is_measured(map, device):
    points = np.random.default_rng(1).uniform(-1, 1, (20_000, 3))
    map.field(points, n=2, device=device)
    # 2 iterates of a map of K factors: at least 10 slots a factor, and a sixth of what follows it.
    slots = 2 * 10 * len(map.factors) * len(points)
    ran = []

    def run():
        ran.append(map.field(points, n=2, device=device))

    figures = qjulia.profile_launch("field_at_points", run, slots=slots, repeats=5, device=device)
    assert set(figures["runs"]) == {"seconds", "fma_per_second", "cpu_seconds", "fma_per_cpu_second"}
    assert len(figures["runs"]["seconds"]) == 5 and len(ran) >= 6
    assert figures["is_one_kernel"] and figures["slots"] == slots
    assert figures["median_seconds"] > 0
    if figures["share_verdict"] == "judged":  # else other work was in the way
        assert 0 < figures["share_of_limit"] < 1


def test_what_a_launch_raises_is_raised(device):
    def run():
        raise KeyError("no such buffer")

    with pytest.raises(KeyError, match="no such buffer"):
        qjulia.profile_launch("f", run, device=device)


@pytest.mark.parametrize(
    "call, error, message",
    [
        (lambda d: qjulia.profile(sample_points=3, device=d), qjulia.OptionError, "^sample_points: .* 64"),
        (lambda d: qjulia.profile(n=1, device=d), qjulia.OptionError, "^n: .*2 to 16"),
        (lambda d: qjulia.profile(lane_width=3, device=d), qjulia.OptionError, "^lane_width: "),
        (lambda d: qjulia.profile(kernels="nothing*", device=d), qjulia.OptionError, "^kernels: no job or kernel"),
        (lambda d: qjulia.profile(kernels=3, device=d), TypeError, "^kernels must be names, not 3"),
        (lambda d: qjulia.profile("a.json", device=d), TypeError, "^map must be a Map, not str"),
        (lambda d: qjulia.profile(faces=[[0, 1, 2]], device=d), TypeError, "^faces are given without"),
        (lambda d: qjulia.tune(time_limit=3, device=d), TypeError, "no argument 'time_limit'"),
        (lambda d: qjulia.tune(factors=2, device=d), qjulia.OptionError, "^factors: "),
        (lambda d: qjulia.doctor(programs="none.cl", device=d), qjulia.OptionError, "^programs: no check has a name"),
        (lambda d: qjulia.profile_launch("f", 3, device=d), TypeError, "^run must be a function"),
        (lambda d: qjulia.profile_launch(3, print, device=d), TypeError, "^kernel must be a name"),
        (lambda d: qjulia.profile_launch("f", print, slots=-1, device=d), qjulia.OptionError, "^slots: "),
        (lambda d: qjulia.profile_launch("f", print, repeats=0, device=d), qjulia.OptionError, "^repeats: .*1 to 1000"),
    ],
)
def test_mistakes_are_named(call, error, message, device):
    with pytest.raises(error, match=message):
        call(device)
