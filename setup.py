"""Builds the Python package with CMake, where pip is used instead of CMake's own install."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent


class BuildWithCMake(build_ext):
    """Has CMake build the extension, and puts it beside the package's Python files."""

    def build_extension(self, ext):
        folder = Path(self.build_temp).resolve()
        subprocess.run(
            [
                "cmake",
                "-S",
                ROOT,
                "-B",
                folder,
                "-DCMAKE_BUILD_TYPE=Release",
                "-DCMAKE_UNITY_BUILD=ON",
                "-DCMAKE_UNITY_BUILD_BATCH_SIZE=64",
                "-DQJULIA_BUILD_TESTS=OFF",
                f"-DPython3_EXECUTABLE={sys.executable}",
            ],
            check=True,
        )
        subprocess.run(
            ["cmake", "--build", folder, "--parallel", "--target", "qjulia_python"], check=True
        )
        (built,) = (folder / "python" / "qjulia").glob("_core.*.so")
        target = Path(self.get_ext_fullpath(ext.name)).resolve()
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(built, target)


VERSION = re.search(r"project\(qjulia VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
setup(
    version=VERSION,
    packages=["qjulia"],
    package_dir={"": "python"},
    package_data={"qjulia": ["*.pyi", "py.typed"]},
    ext_modules=[Extension("qjulia._core", sources=[])],
    cmdclass={"build_ext": BuildWithCMake},
)
