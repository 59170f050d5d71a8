#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Stage's machine code has no fused multiply-add instructions, which round once instead of twice.

Compilers generate such instructions if the processor has them. cmake/forbid_fused.cmake forbids it. This test
disassembles all built files, and also the sources with rotations, compiled for newer processors than that of the build.
"""

from __future__ import annotations

import json
import os
import platform
import re
import shlex
import shutil
import subprocess
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])
BINARY_DIR = Path(os.environ.get("STAGE_BINARY_DIR") or ROOT / "build" / "release")

# x86: vfmadd132sd, vfnmsub231ps, vfmaddsub213pd, vfmaddpd (FMA4), vfmaddcph. Arm: fmadd, fnmsub, fmla, fmls,
# fcmla, vfma.f64, vfnms.f32, bfmlalb, and vmla.f32, which fuses on some processors.
FUSED = re.compile(r"v?fn?m(?:add|sub)\w*|v?fc?m(?:add|sub)c\w*|b?fml(?:a|s)\w*|v?fcmla\w*|fn?ml[as]\w*|fn?mad\w*|"
                   r"fn?msb\w*|vfn?m[as]\.f\w*|vn?ml[as]\.f\w*|vfmal\S*|vfmsl\S*")
# Compiler options that enable fused instructions. The sources of the core take longer, so they are compiled only with
# the last option, which vectorizes most. The rotations below are compiled with all of them.
X86 = ["-O2 -march=x86-64-v3", "-O3 -march=x86-64-v3", "-O2 -march=native", "-O3 -march=native",
       "-O3 -march=x86-64-v4"]
# On Arm, cmake/forbid_fused.cmake checks the processor at configuration, so commands for other processors are not
# tested.
ARM = ["-O2 -march=armv8-a", "-O3 -march=armv8-a"]
# Rotations as in the project. GCC 12.2 compiles them to vfmaddsub in spite of -ffp-contract=off.
ROTATIONS = """
struct Body { double vx, vy, wx, wy; };
void SinCos(double, double*, double*);
void Rotate(Body* b, double step, double a) {
  double s, c;
  SinCos(a, &s, &c);
  b->wx = step * (c * b->vx - s * b->vy);
  b->wy = step * (s * b->vx + c * b->vy);
}
void RotateAll(Body* b, int n, double c, double s) {
  for (int i = 0; i < n; i++) {
    b[i].wx += c * b[i].vx - s * b[i].vy;
    b[i].wy += s * b[i].vx + c * b[i].vy;
  }
}
"""
#: Sources that are compiled at a time, which takes half of the time. Those that use the same names are split.
BATCH = 8
TURNS = re.compile(r"\b(?:cosine|sine|SinCos)\b")


def objdump() -> str:
    cache = (BINARY_DIR / "CMakeCache.txt").read_text()
    found = re.search(r"^CMAKE_OBJDUMP:\w+=(.+)$", cache, re.MULTILINE)
    tool = found.group(1) if found else "objdump"
    return tool if shutil.which(tool) else "objdump"


def mnemonic(line: str) -> str:
    """The instruction's name in a line of objdump -d --no-show-raw-insn, without prefixes; else ""."""
    code = re.match(r"\s*[0-9a-f]+:\s+(.*)", line)
    words = code.group(1).split() if code else []
    while words and words[0] in ("lock", "rep", "repz", "repnz", "notrack", "bnd", "data16"):
        words.pop(0)
    return words[0] if words else ""


def fused_in(file: Path) -> list[str]:
    """"FUNCTION: INSTRUCTION" of each fused instruction, once, in the order of the code."""
    found: dict[str, None] = {}
    function = "?"
    with subprocess.Popen([objdump(), "-d", "-C", "--no-show-raw-insn", str(file)], text=True,
                          stdout=subprocess.PIPE, errors="replace") as process:
        for line in process.stdout or []:
            if line.endswith(">:\n"):
                function = line[line.find("<") + 1:-3]
            elif FUSED.fullmatch(mnemonic(line)):
                found[f"{function}: {mnemonic(line)}"] = None
    if process.returncode != 0:
        raise AssertionError(f"objdump can't read {file}")
    return list(found)


def built() -> list[Path]:
    """All built libraries and programs that results depend on."""
    found = [path for pattern in ("lib/*.so", "lib/*.a", "lib/stage-*/*.so", "bin/*", "python/stagesim/_core*.so")
             for path in BINARY_DIR.glob(pattern)]
    return sorted({path.resolve() for path in found if path.is_file()})


def sources_of(file: Path) -> list[Path]:
    """The file, or the sources that it includes if CMake made it to compile them at a time."""
    if file.parent.name != "Unity":
        return [file]
    return [Path(path) for path in re.findall(r'^#include "(.+)"$', file.read_text(), re.MULTILINE)]


def commands() -> dict[str, list[str]]:
    """The compiler commands of the core's sources, by path in the tree. The window computes no results."""
    entries = json.loads((BINARY_DIR / "compile_commands.json").read_text())
    return {str(source.relative_to(ROOT)): shlex.split(entry["command"]) for entry in entries
            for source in sources_of(Path(entry["file"]))
            if source.is_relative_to(ROOT / "libstage")
            and not source.is_relative_to(ROOT / "libstage" / "gui")}


def is_kept(option: str) -> bool:
    return not re.fullmatch(r"-O\w|-g\d?|-W\S*|-M[MDPG]*", option)


def compile_for(command: list[str], processor: str, source: str, target: Path) -> str:
    """Compiles with `command`, for the given processor as if CXXFLAGS selected it. Returns "", or the reason why
    that is impossible."""
    level, march = processor.split()
    # The compiler comes first, possibly after ccache. -march follows it, at the place of CXXFLAGS.
    first = next(i for i, word in enumerate(command) if word.startswith("-"))
    words, skip = [*command[:first], march], False
    for i, word in enumerate(command[first:], first):
        if skip or not is_kept(word):
            skip = False
            continue
        if word in ("-o", "-c", "-MT", "-MF") or (word == "-include" and "cmake_pch" in command[i + 1]):
            skip = True
            continue
        words.append(word)
    # An option of the build precedes those of a single source, such as -O3.
    words.insert(first + 1, level)
    result = subprocess.run([*words, "-w", "-x", "c++", "-c", source, "-o", str(target)], text=True, check=False,
                            capture_output=True, cwd=BINARY_DIR)
    return "" if result.returncode == 0 else result.stderr.strip()[:500]


def batches_of(sources: dict[str, list[str]]) -> list[list[str]]:
    """The sources in batches that can be compiled at a time: with equal options, and not too many."""
    batches: dict[tuple[str, ...], list[list[str]]] = {}
    for name, command in sorted(sources.items()):
        options = tuple(word for word in command if not re.search(r"\.(?:o|d|cc|cxx)$", word))
        groups = batches.setdefault(options, [[]])
        if len(groups[-1]) == BATCH:
            groups.append([])
        groups[-1].append(name)
    return [batch for groups in batches.values() for batch in groups]


def processors() -> list[str]:
    machine = platform.machine()
    if (BINARY_DIR / "CMakeCache.txt").read_text().count("CMAKE_CROSSCOMPILING_EMULATOR"):
        return []
    return X86 if machine in ("x86_64", "AMD64") else ARM if machine in ("aarch64", "arm64") else []


class FusedTest(unittest.TestCase):
    def test_names_are_told_apart(self) -> None:
        for name in ("vfmadd132sd vfnmadd231pd vfmaddsub213pd vfmsubadd132ps vfnmsub213ss vfmaddpd vfmaddcph "
                     "vfcmaddcph fmadd fmsub fnmadd fnmsub fmla fmls fcmla fmlal fmlsl2 vfma.f64 vfms.f32 vfnma.f64 "
                     "vmla.f32 vmls.f64 bfmlalb fmad fmsb fnmad fnmla fnmls fnmsb").split():
            self.assertTrue(FUSED.fullmatch(name), name)
        for name in ("mulsd addsd vmulpd vaddsubpd vpmadd52luq pmaddwd vpmaddubsw fmul fadd fcadd madd msub smaddl mla "
                     "umlal vmla.i32 fmax fmaxnm fmin fmov fmulx vfmin.f32 vmul.f64 fadd").split():
            self.assertFalse(FUSED.fullmatch(name), name)
        self.assertEqual(mnemonic("  4:\tvfmadd132sd %xmm2,%xmm1,%xmm0"), "vfmadd132sd")
        self.assertEqual(mnemonic("0000000000000000 <f>:"), "")

    def test_nothing_that_was_built_fuses(self) -> None:
        self.assertIn("libstage", {path.name.split(".")[0] for path in built()})
        for path in built():
            with self.subTest(file=path.name):
                self.assertEqual(fused_in(path), [])

    def compare(self, sources: dict[str, list[str]], texts: dict[str, Path], builds: list[str]) -> None:
        """Compiles the texts with the commands of the sources and these options, and finds fused instructions."""
        with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(os.cpu_count() or 1) as pool:
            def look(case: tuple[list[str], str]) -> tuple[list[str], str, str | list[str]]:
                names, processor = case
                target = Path(folder) / (re.sub(r"\W", "_", names[0] + processor) + f"_{len(names)}.o")
                together = target.with_suffix(".cc")
                together.write_text("".join(f'#include "{texts[name]}"\n' for name in names))
                error = compile_for(sources[names[0]], processor, str(together), target)
                if error and len(names) > 1:
                    middle = len(names) // 2
                    halves = [look((half, processor))[2] for half in (names[:middle], names[middle:])]
                    return names, processor, [line for half in halves
                                              for line in ([half] if isinstance(half, str) else half)]
                return names, processor, error or fused_in(target)
            cases = [(names, processor) for processor in builds for names in batches_of(sources)]
            for names, processor, found in pool.map(look, cases):
                with self.subTest(files=names, processor=processor):
                    self.assertEqual(found, [])

    @unittest.skipUnless(processors(), "the processor of this build is compiled for elsewhere")
    def test_sources_that_turn_things_do_not_fuse(self) -> None:
        all_commands = commands()
        sources = {name: command for name, command in all_commands.items()
                   if TURNS.search((ROOT / name).read_text()) or "wide_walk_avx" in name}
        self.assertGreater(len(sources), 10)
        self.compare(sources, {name: ROOT / name for name in sources}, [processors()[-1]])

    @unittest.skipUnless(processors(), "the processor of this build is compiled for elsewhere")
    def test_rotations_do_not_fuse(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            source = Path(folder) / "rotations.cc"
            source.write_text(ROTATIONS)
            # Each source may have its own compiler options.
            sources = {name: command for name, command in commands().items()
                       if name.endswith(("models/types/position.cc", "sensing/tracer.cc", "wide_walk_avx512.cc"))}
            self.assertGreater(len(sources), 1)
            self.compare(sources, {name: source for name in sources}, processors())

    @unittest.skipUnless(platform.machine() in ("x86_64", "aarch64") and processors(), "needs instructions that fuse")
    def test_fused_instructions_are_found(self) -> None:
        """The test detects the fused instructions of an unrestricted compiler."""
        with tempfile.TemporaryDirectory() as folder:
            source, target = Path(folder) / "rotations.cc", Path(folder) / "rotations.o"
            source.write_text(ROTATIONS)
            compiler = next(iter(commands().values()))
            first = next(i for i, word in enumerate(compiler) if word.startswith("-"))
            march = ["-mfma"] if platform.machine() == "x86_64" else []
            subprocess.run([*compiler[:first], "-O2", *march, "-ffp-contract=fast", "-c", str(source), "-o",
                            str(target)], check=True)
            self.assertTrue(any(line.startswith("Rotate(") for line in fused_in(target)))


if __name__ == "__main__":
    unittest.main()
