"""What the tests share. The command is $QJULIA_COMMAND; tests that need it are skipped without."""

import os
import subprocess

import numpy as np
import pytest

import qjulia


def torus_mesh(around=32, across=16, major=1.0, minor=0.35):
    """About the z axis, with coordinates that single precision holds."""
    u, v = np.meshgrid(
        2 * np.pi * np.arange(around) / around,
        2 * np.pi * np.arange(across) / across,
        indexing="ij",
    )
    radius = major + minor * np.cos(v)
    vertices = np.stack([radius * np.cos(u), radius * np.sin(u), minor * np.sin(v)], -1)
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")

    def at(di, dj):
        return ((i + di) % around * across + (j + dj) % across).ravel()

    faces = np.concatenate(
        [np.stack([at(0, 0), at(1, 0), at(1, 1)], -1), np.stack([at(0, 0), at(1, 1), at(0, 1)], -1)]
    )
    return vertices.reshape(-1, 3).astype(np.float32).astype(float), faces


def write_obj(path, vertices, faces):
    with open(path, "w") as file:
        for x, y, z in vertices:
            file.write(f"v {x:.9g} {y:.9g} {z:.9g}\n")
        for a, b, c in faces + 1:
            file.write(f"f {a} {b} {c}\n")


@pytest.fixture(scope="session")
def device():
    return qjulia.Device("cpu")


@pytest.fixture(scope="session")
def torus():
    return torus_mesh()


@pytest.fixture(scope="session")
def torus_file(torus, tmp_path_factory):
    path = tmp_path_factory.mktemp("meshes") / "torus.obj"
    write_obj(path, *torus)
    return path


FIT = {"factors": 24, "max_evaluations": 40}


@pytest.fixture(scope="session")
def result(torus, device):
    return qjulia.fit(*torus, **FIT, device=device)


@pytest.fixture(scope="session")
def map(result):
    return result.map


@pytest.fixture(scope="session")
def command():
    program = os.environ.get("QJULIA_COMMAND")
    if not program:
        pytest.skip("QJULIA_COMMAND does not name the command")

    def run(*arguments):
        done = subprocess.run(
            [program, *(str(a) for a in arguments), "--device", "cpu"],
            capture_output=True,
            text=True,
            timeout=300,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run
