"""`pip install .`: the module and the program by CMake. docs/python.md

HYBMSS_BUILD_DIR is a build directory to make use of, by default one of its own; HYBMSS_CMAKE_ARGUMENTS more options, by blanks.
"""

import os
import pathlib
import re
import shlex
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = pathlib.Path(__file__).resolve().parent


def version():
    numbers = re.findall(r"#define HYBMSS_VERSION_\w+ (\d+)", (ROOT / "include/hybmss/version.h").read_text())
    return ".".join(numbers)


class BuildByCMake(build_ext):
    def run(self):
        build = os.environ.get("HYBMSS_BUILD_DIR")
        options = []
        if not build:
            build = str(ROOT / "build/python")
            options = ["-DCMAKE_BUILD_TYPE=Release", "-DHYBMSS_BUILD_TESTS=OFF", "-DHYBMSS_BUILD_BENCHMARKS=OFF",
                       "-DHYBMSS_BUILD_SHARED=OFF", "-DHYBMSS_INSTALL=OFF", "-DCMAKE_UNITY_BUILD=ON"]
        if not (pathlib.Path(build) / "CMakeCache.txt").is_file():
            options += ["-G", "Ninja"]
        options += ["-DHYBMSS_BUILD_PYTHON=ON", f"-DPython_EXECUTABLE={sys.executable}"]
        try:
            import pybind11
            options.append(f"-Dpybind11_DIR={pybind11.get_cmake_dir()}")
        except ImportError:
            pass  # Debian's is found by itself
        options += shlex.split(os.environ.get("HYBMSS_CMAKE_ARGUMENTS", ""))
        subprocess.run(["cmake", "-S", str(ROOT), "-B", build, *options], check=True)
        subprocess.run(["cmake", "--build", build, "-j", str(os.cpu_count()), "--target", "hybmss_python", "hybmss_app"],
                       check=True)
        # In place: nothing, for the build directory has the whole package.
        if not self.inplace:
            subprocess.run(["cmake", "--install", build, "--component", "python", "--strip", "--prefix",
                            str(pathlib.Path(self.build_lib).resolve())], check=True)


setup(version=version(), packages=["hybmss"], package_dir={"hybmss": "bindings/python/hybmss"},
      package_data={"hybmss": ["*.pyi", "py.typed"]}, ext_modules=[Extension("hybmss._hybmss", [])],
      cmdclass={"build_ext": BuildByCMake})
