# SPDX-License-Identifier: GPL-2.0-or-later
# shellcheck shell=bash
# Setting up and building, shared by tools/run and tools/test, which source this file. Everything
# here reports on standard error: standard output belongs to the program that is run.

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)

# stage_alone COMMAND...: two builds in one folder at once would spoil it; the second waits.
stage_alone() {
  mkdir -p "$root/build"
  (
    if command -v flock >/dev/null; then flock 9; fi
    "$@" 9>&-
  ) 9>"$root/build/.lock"
}

# stage_configure PRESET [SETUP OPTION]...: installs what tools/setup finds missing, and configures.
stage_configure() {
  local preset=$1
  shift
  # Without root some packages may stay missing; whether that matters, CMake knows.
  "$root/tools/setup" "$@" >&2 || echo "Going on with what is there." >&2
  if [[ ! -e $root/build/$preset/CMakeCache.txt ]] && command -v ninja >/dev/null; then
    local -x CMAKE_GENERATOR=${CMAKE_GENERATOR:-Ninja}
  fi
  cmake -S "$root" --preset "$preset" >&2
}

# stage_jobs: how many compilers may run at once: as many as there are processors, if each finds the
# memory that the largest files take.
stage_jobs() {
  local jobs memory most
  jobs=$(nproc)
  memory=$(sed -n 's/^MemAvailable: *\([0-9]*\) kB$/\1/p' /proc/meminfo 2>/dev/null)
  most=$((${memory:-999999999} / 620000))
  if [[ $jobs -gt $most ]]; then jobs=$most; fi
  echo $((jobs < 1 ? 1 : jobs))
}

# stage_build PRESET TARGET [SETUP OPTION]...
#
# Installs what tools/setup with these options finds missing, configures and builds. When the same
# set-up has led to a finished build before (a stamp says so), only the build tool runs, which takes
# no time if nothing has changed.
stage_build() {
  stage_alone stage_build_alone "$@"
}

stage_build_alone() {
  local preset=$1 target=$2
  shift 2
  local folder=$root/build/$preset
  local stamp="$folder/.setup$*"

  if [[ ! $stamp -nt $root/tools/setup || ! -e $folder/CMakeCache.txt ]]; then
    stage_configure "$preset" "$@"
  fi
  cmake --build "$folder" --target "$target" --parallel "$(stage_jobs)" |
    { grep --line-buffered -v -e '^ninja: no work to do' -e 'Re-checking globbed' >&2 || true; }
  if [[ ! $stamp -nt $root/tools/setup ]]; then : >"$stamp"; fi
}
