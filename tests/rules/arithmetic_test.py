#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Code that results depend on calls no function whose result depends on the processor or the run.

The test checks the sources and the undefined symbols of the libraries, so that neither a macro nor a
`using` can hide a call. Compiler flags that change arithmetic are refused.
"""

from __future__ import annotations

import os
import platform
import re
import subprocess
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])
BINARY_DIR = Path(os.environ.get("STAGE_BINARY_DIR") or ROOT / "build" / "release")

# Functions for which IEEE 754 does not require correct rounding. Trigonometry: geometry/trigonometry.hh.
INEXACT = """
    acos acosh asin asinh atan atan2 atanh cbrt cos cosh erf erfc exp exp10 exp2 expm1 hypot lgamma
    lgamma_r log log10 log1p log2 pow sin sincos sinh tan tanh tgamma j0 j1 jn y0 y1 yn gamma scalb
    drem significand cospi sinpi tanpi acospi asinpi atanpi exp10m1 exp2m1 log10p1 log2p1 compoundn
    pown powr rootn rsqrt beta riemann_zeta legendre polar
""".split()
# Random generators of the process or the system, and distributions, which differ between standard
# libraries. Streams of random numbers: random/random.hh.
SHARED_CHANCE = """
    rand srand random srandom initstate setstate drand48 erand48 lrand48 nrand48 mrand48 jrand48
    srand48 seed48 lcong48 rand_r random_r getrandom getentropy arc4random arc4random_uniform
""".split()
# Functions that change the whole process; for example, clients have their own locale.
PROCESS = ["setlocale"]
STD_CHANCE = re.compile(r"\b(random_device|random_shuffle|\w+_distribution)\b")
# OpenCL C functions whose results may differ between devices.
OPENCL = re.compile(r"\b(native_\w+|half_(?!t\b)\w+|mad|fast_\w+|(?:float|double)\d*)\b")

# Modules that results depend on. libstage/gui only draws results. libstage/files needs unpredictable
# names of temporary files.
FOLDERS = ["libstage", "libstage_cl", "kernels", "examples"]
LEFT_OUT = ["libstage/gui", "libstage/files"]
LEFT_OUT_SYMBOLS = {"libstage.so": {"getentropy"}, "libstage.a": {"getentropy"}}
# Own members and functions with the names of C library functions.
OURS = {
    "log": re.compile(r"(?:\.|->)log\(\)|LogEntry>& log\("),
    "random": re.compile(r"(?:\.|->)random\(\)|RandomStream&? random\("),
}

COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
STRING = re.compile(r'"(?:\\.|[^"\\\n])*"')


def sources() -> list[Path]:
    left_out = [ROOT / folder for folder in LEFT_OUT]
    return [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*"))
            if path.suffix in (".cc", ".hh", ".h", ".cl", ".in")
            and not any(folder in path.parents for folder in left_out)]


def blank(match: re.Match[str]) -> str:
    """Replaces a match by its line ends, so that line numbers stay correct."""
    return "\n" * match.group().count("\n")


def calls_in(text: str, names: list[str]) -> list[str]:
    """"LINE: NAME" of each mention of one of the functions, called or not."""
    code = STRING.sub('""', COMMENT.sub(blank, text))
    for allowed in OURS.values():
        code = allowed.sub("", code)
    any_name = "|".join(sorted(names, key=len, reverse=True))
    mention = re.compile(rf"(?:\bstd::|(?<!\w)::)(?:{any_name})[fl]?\b|"
                         rf"(?<![\w.>:])(?:{any_name})[fl]?\s*\(")
    return [f"{code[:found.start()].count(chr(10)) + 1}: {found.group().strip()}"
            for found in mention.finditer(code)]


def wanted_symbols(library: Path) -> set[str]:
    """The undefined symbols of a library, without versions."""
    table = ["-D"] if library.suffix == ".so" else []
    lines = subprocess.run(["nm", *table, "--undefined-only", str(library)], text=True, check=True,
                           capture_output=True).stdout.splitlines()
    return {line.split()[-1].split("@")[0] for line in lines if line}


def forbidden_symbols() -> set[str]:
    suffixes = ["", "f", "l", "f128", "_finite"]
    inexact = {name + suffix for name in INEXACT for suffix in suffixes}
    return (inexact | {f"__{name}_finite" for name in INEXACT}
            | {f"__{name}" for name in ("sincos", "exp10")} | set(SHARED_CHANCE) | set(PROCESS))


def libraries() -> list[Path]:
    return sorted(path for pattern in ("lib/libstage.so", "lib/libstage.a", "lib/stage-*/*.so")
                  for path in BINARY_DIR.glob(pattern))


def compiler() -> str:
    cache = (BINARY_DIR / "CMakeCache.txt").read_text()
    found = re.search(r"^CMAKE_CXX_COMPILER:\w+=(.+)$", cache, re.MULTILINE)
    return found.group(1) if found else "c++"


def compile_errors(*flags: str) -> str:
    """The compiler's errors for a source with the header that all sources include."""
    source = '#include "geometry/geometry.hh"\n'
    command = [compiler(), "-std=c++20", "-I" + str(ROOT / "libstage/include"), f"-I{ROOT / 'libstage'}",
               "-fsyntax-only", *flags,
               "-x", "c++", "-"]
    return subprocess.run(command, input=source, text=True, capture_output=True,
                          check=False).stderr


class ArithmeticTest(unittest.TestCase):
    def test_sources_name_no_function_that_differs(self) -> None:
        self.assertGreater(len(sources()), 100)
        for path in sources():
            with self.subTest(file=str(path.relative_to(ROOT))):
                text = path.read_text()
                self.assertEqual(calls_in(text, INEXACT + SHARED_CHANCE + PROCESS), [])
                self.assertIsNone(STD_CHANCE.search(COMMENT.sub(blank, text)))

    def test_kernels_calculate_in_integers(self) -> None:
        """Ranges are doubles; the operations on them are in headers."""
        for path in sorted((ROOT / "kernels").glob("*.cl")):
            with self.subTest(file=path.name):
                found = set(OPENCL.findall(COMMENT.sub(blank, path.read_text())))
                self.assertEqual(found, {"double"} if path.name == "ranges.cl" else set())

    def test_sources_are_searched(self) -> None:
        """The search finds exactly the forbidden calls."""
        for call in ("x = std::hypot(a, b);", "using std::atan2;", "y = sinf(a);", "::pow (a, b)",
                     "[] { return random(); }", "return rand() % 3;", "auto f = std::exp;"):
            self.assertEqual(len(calls_in(call, INEXACT + SHARED_CHANCE)), 1, call)
        for call in ("// std::hypot(a, b)", 's = "sin(x)";', "world->random().Next()",
                     "direction.cos(3)", "RandomStream& random() {", "Stg::ArcTangent(y, x)",
                     "std::expected"):
            self.assertEqual(calls_in(call, INEXACT + SHARED_CHANCE), [], call)

    def test_libraries_want_no_function_that_differs(self) -> None:
        self.assertIn("libstage", {library.stem for library in libraries()})
        for library in libraries():
            with self.subTest(library=library.name):
                wanted = wanted_symbols(library)
                allowed = LEFT_OUT_SYMBOLS.get(library.name, set())
                self.assertEqual(wanted & forbidden_symbols() - allowed, set())
                self.assertEqual({name for name in wanted if "random_device" in name}, set())

    def test_other_arithmetic_is_refused(self) -> None:
        self.assertEqual(compile_errors(), "")
        self.assertEqual(compile_errors("-O2"), "")
        for flag in ("-ffast-math", "-Ofast"):
            self.assertIn("#error \"Stage: -ffast-math", compile_errors(flag), flag)

    @unittest.skipUnless(platform.machine() == "x86_64", "needs an x86-64 processor")
    def test_x87_is_refused(self) -> None:
        if "unrecognized" in compile_errors("-mfpmath=387") or "clang" in compiler():
            self.skipTest("this compiler knows no x87 arithmetic")
        self.assertIn("#error \"Stage: x87", compile_errors("-mfpmath=387"))


if __name__ == "__main__":
    unittest.main()
