"""Long calls: callbacks, Ctrl-C, other threads, memory."""

import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import qjulia


def test_a_fit_tells_how_it_goes(torus, device):
    stages, energies, progress = [], [], []
    result = qjulia.fit(
        *torus,
        factors=16,
        max_evaluations=25,
        device=device,
        on_stage=stages.append,
        on_evaluation=energies.append,
        on_progress=lambda *all: progress.append(all),
    )
    assert stages[0].name == "placement" and isinstance(stages[0].map, qjulia.Map)
    assert [stage.name for stage in stages[1:]] == [stage.name for stage in result.stages]
    assert result.stages[-1].map is None
    assert len(energies) == result.evaluations == 25
    assert len(stages[-1].map.factors) == 16
    assert {len(entry) for entry in progress} == {4} and progress[0][0]
    assert result.stopped == "evaluations" and "evaluations" in str(result)
    assert str(stages[1]).startswith(stages[1].name)


def test_callbacks_run_on_the_calling_thread_and_may_call(torus, device):
    seen = []

    def look(stage):
        seen.append((threading.get_ident(), len(stage.map.surface(8, n=1, device=device).faces)))

    qjulia.fit(*torus, factors=16, max_evaluations=10, device=device, on_stage=look)
    assert seen and all(thread == threading.get_ident() and faces > 0 for thread, faces in seen)


def test_a_callback_that_raises_ends_the_fit(torus, device):
    def fails(stage):
        raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        qjulia.fit(*torus, factors=16, device=device, on_stage=fails)
    with pytest.raises(LookupError):
        qjulia.fit(*torus, factors=16, device=device, on_evaluation=fails)


def test_stop_iteration_gives_what_was_reached(torus, device):
    count = []

    def stops(energy):
        count.append(energy)
        if len(count) == 5:
            raise StopIteration

    result = qjulia.fit(*torus, factors=16, device=device, on_evaluation=stops)
    assert result.stopped == "interrupted"
    assert 5 <= result.evaluations < 20
    assert np.isfinite(result.map.field(np.zeros((1, 3)), device=device)).all()


def press_ctrl_c_after(seconds):
    timer = threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    return timer


def test_ctrl_c_ends_a_fit_with_what_was_reached(torus, device):
    # Counted from the first evaluation, so that there is something to give.
    pressed = []

    def press(energy):
        if not pressed:
            pressed.append(press_ctrl_c_after(0.2))

    start = time.monotonic()
    result = qjulia.fit(*torus, factors=256, device=device, on_evaluation=press)
    assert result.stopped == "interrupted"
    assert len(result.map.factors) == 256
    assert time.monotonic() - start < 30


def test_ctrl_c_ends_other_calls(map, device):
    points = np.random.default_rng(6).uniform(-1, 1, (4_000_000, 3))
    for call in (
        lambda: map.surface(2000, device=device),
        lambda: map.sample(700, device=device),
        lambda: map.field(points, n=16, device=device),
        lambda: qjulia.morph(map, map, 9999, flicker_cells=0, device=device),
    ):
        timer = press_ctrl_c_after(0.5)
        with pytest.raises(KeyboardInterrupt):
            call()
        timer.join()


def test_other_threads_run_on_during_a_fit(torus, device, capsys):
    gaps, stop = [], threading.Event()

    def tick():
        last = time.perf_counter()
        while not stop.is_set():
            time.sleep(0.005)
            now = time.perf_counter()
            gaps.append(now - last)
            last = now

    ticker = threading.Thread(target=tick)
    ticker.start()
    start = time.perf_counter()
    qjulia.fit(*torus, factors=64, max_evaluations=100, device=device)
    seconds = time.perf_counter() - start
    stop.set()
    ticker.join()
    with capsys.disabled():
        print(
            f"\n{len(gaps)} ticks in {seconds:.2f} s, {1e3 * np.median(gaps):.1f} ms between them, "
            f"{100 * np.mean(np.array(gaps) < 0.010):.1f} % below 10 ms, at most "
            f"{1e3 * max(gaps):.1f} ms"
        )
    assert len(gaps) > seconds / 0.1


def test_threads_share_a_device(map, device):
    points = np.random.default_rng(7).uniform(-1, 1, (300, 3))
    expected = map.field(points, n=3, device=device)
    found, errors = [], []

    def work():
        try:
            for _ in range(20):
                found.append(map.field(points, n=3, device=device))
                map.surface(6, n=1, device=device)
        except Exception as error:  # noqa: BLE001
            errors.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
    assert len(found) == 80 and all(np.array_equal(values, expected) for values in found)


# In a process of its own, where memory that other tests have let go cannot hide what is lost.
LEAK_CHECK = """
import os
import numpy as np
import qjulia
from conftest import torus_mesh


def memory():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def calls(fields, fits):
    for i in range(fields):
        qjulia.Map.from_json(map.to_json()).field(points, n=2, gradient=True, device=device)
        energy = qjulia.Energy(map, points, device=device)
        energy.value_and_gradient(energy.x0)
        try:
            map.field(points[:, :2], device=device)
        except ValueError:
            pass
    for i in range(fits):
        qjulia.fit(*torus, factors=8, max_evaluations=3, seed=i, device=device,
                   on_stage=lambda stage: stage.map)


device, torus = qjulia.Device("cpu"), torus_mesh()
map = qjulia.fit(*torus, factors=8, max_evaluations=3, device=device).map
points = np.random.default_rng(8).uniform(-1, 1, (1000, 3))
calls(50, 3)
before = memory()
calls(1000, 20)
print(memory() - before)
"""


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="needs /proc")
def test_nothing_leaks(capsys):
    done = subprocess.run(
        [sys.executable, "-c", LEAK_CHECK], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    grown = int(done.stdout)
    with capsys.disabled():
        print(f"\n1,000 calls and 20 fits: {grown / 2**20:+.1f} MB")
    assert grown < 20 * 2**20


def test_a_fit_goes_on_from_a_map(torus, result, device):
    starts = []
    again = qjulia.fit(
        *torus,
        initial=result.map,
        max_evaluations=20,
        device=device,
        on_stage=lambda stage: starts.append(stage.map),
    )
    placed, before = starts[0].factors["center"], result.map.factors["center"]
    assert np.allclose(placed, before, atol=1e-3)
    assert len(again.map.factors) == len(before)
    with pytest.raises(TypeError, match="initial"):
        qjulia.fit(*torus, initial="map", device=device)


def test_a_schedule_may_be_text(torus, device):
    with pytest.raises(qjulia.InputError, match="schedule"):
        qjulia.fit(*torus, factors=8, schedule_text="not = a schedule", device=device)


FORKED = """
import gc, multiprocessing, os, sys, threading, time
import numpy as np
import qjulia

map = qjulia.quadratic_map([-0.2, 0.6, 0.2, 0.2])
points = np.zeros((3, 3))
device = qjulia.Device("cpu")
map.field(points, device=device)
map.field(points)  # opens the default
ball = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, -1.0]])
faces = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1], [5, 2, 1], [5, 3, 2], [5, 4, 3], [5, 1, 4]]
fit = qjulia.Fit(ball, faces, factors=8, max_evaluations=3, device=device)
fit.step()

USES = {
    "field": lambda: map.field(points, device=device),
    "default": lambda: map.field(points),
    "long": lambda: map.field(np.zeros((2_000_000, 3)), device=device),
    "surface": lambda: map.surface(16, device=device),
    "fit": lambda: fit.step(),
    "map": lambda: fit.map,
    "open": lambda: qjulia.Device("cpu"),
    "devices": lambda: qjulia.devices(),
}


def refused(use):
    try:
        use()
    except qjulia.DeviceError as error:
        return str(error)
    return "no error"


def child(name):
    print(name, refused(USES[name]), flush=True)


busy = threading.Thread(target=lambda: map.field(np.zeros((5_000_000, 3)), n=8, device=device))
for held in (False, True):
    if held:  # the device is locked by a thread that the child does not have
        busy.start()
        time.sleep(0.2)
    for name in USES:
        process = os.fork()
        if process == 0:
            child(name)
            sys.exit(0)  # with all that Python does in the end
        os.waitpid(process, 0)  # the driver has children of its own: its linker
busy.join()
for name in USES:
    process = multiprocessing.get_context("fork").Process(target=child, args=(name,))
    process.start()
    process.join()
process = os.fork()
if process == 0:  # objects of the parent are collected
    del device, fit, USES
    gc.collect()
    os._exit(0)
os.waitpid(process, 0)
print("parent", map.field(points, device=device).shape, fit.step() is not None or fit.stopped)
"""


def test_a_forked_child_is_refused_its_parents_device(tmp_path):
    script = tmp_path / "forked.py"
    script.write_text(FORKED)
    done = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, timeout=300, env=os.environ
    )
    assert done.returncode == 0, done.stdout + done.stderr
    lines = done.stdout.splitlines()
    assert len(lines) == 3 * 8 + 1 and lines[-1].startswith("parent (3,)"), done.stdout
    for line in lines[:-1]:
        assert "this process was forked from the one that opened it" in line, line
        assert "spawn" in line


ABANDONED = """
import sys, threading, time
import numpy as np
import qjulia

vertices = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, -1.0]])
faces = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1], [5, 2, 1], [5, 3, 2], [5, 4, 3], [5, 1, 4]]
map = qjulia.quadratic_map([-0.2, 0.6, 0.2, 0.2])
device = qjulia.Device("cpu")
begun = threading.Event()


def fit():
    qjulia.fit(vertices, faces, factors=64, device=device, on_evaluation=lambda e: begun.set())


def fields():
    while True:
        map.field(np.zeros((100, 3)), device=device)
        begun.set()


def surface():
    map.surface(512, device=device, on_progress=lambda *all: begun.set())


# The end of Python stops what runs. A thread that reports this on standard error meanwhile ends Python itself with an
# error, whatever the thread did.
threading.excepthook = lambda *_: None
threading.Thread(target={"fit": fit, "fields": fields, "surface": surface}[sys.argv[1]], daemon=True).start()
if sys.argv[2] == "waits":
    threading.Thread(target=lambda: qjulia.render(map, device=device), daemon=True).start()
begun.wait()
"""


@pytest.mark.parametrize("work", ["fit", "fields", "surface"])
@pytest.mark.parametrize("other", ["alone", "waits"])
def test_python_ends_while_a_thread_works(tmp_path, work, other):
    script = tmp_path / "abandoned.py"
    script.write_text(ABANDONED)
    done = subprocess.run(
        [sys.executable, script, work, other], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stdout + done.stderr

