# SPDX-License-Identifier: GPL-2.0-or-later
# shellcheck shell=bash
# Shared by the tools that source this file: setting up and building. Functions report on standard error, because
# standard output belongs to the program that is run.

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)

oldest_cmake=3.22

# stage_fail TEXT...: prints one line (the problem and what to do) and exits.
stage_fail() {
  echo "$(realpath -s --relative-to="$root" -- "$0"): $*" >&2
  exit 1
}

# stage_check_writable PATH...: fails with one line if a path exists and is not writable, for example in another user's
# tree or on a read-only medium.
stage_check_writable() {
  local path owner advice
  for path in "$@"; do
    if [[ ! -e $path || -w $path ]]; then continue; fi
    owner=$(stat -c %U -- "$path")
    advice="copy the tree, without build, to a folder of yours"
    if [[ -x $root/build/release/bin/stage ]]; then advice+=", or use build/release/bin/stage as it is"; fi
    stage_fail "can't write $path, which belongs to $owner: $advice"
  done
}

# stage_check_tree PRESET: fails unless the preset can be built in this tree.
stage_check_tree() {
  local cache=$root/build/$1/CMakeCache.txt source
  if [[ ! -e $root/build ]]; then stage_check_writable "$root"; fi
  stage_check_writable "$root/build" "$root/build/.lock" "$root/build/$1" "$cache"
  source=$(sed -n 's/^CMAKE_HOME_DIRECTORY:INTERNAL=//p' "$cache" 2>/dev/null) || true
  if [[ -n $source && ! $source -ef $root ]]; then
    stage_fail "build/$1 was made for the tree $source, not for this one: rm -r $root/build"
  fi
}

# stage_check_cmake: fails if CMake is too old for presets.
stage_check_cmake() {
  local version
  command -v cmake >/dev/null || stage_fail "CMake is not installed: install CMake $oldest_cmake or later"
  version=$(cmake --version | sed -n 's/^cmake version \([0-9.]*\).*/\1/p')
  if [[ $(printf '%s\n' "$oldest_cmake" "$version" | sort --version-sort | head -1) != "$oldest_cmake" ]]; then
    stage_fail "found CMake $version ($(command -v cmake)), expected $oldest_cmake or later: install a newer one," \
      "such as by python3 -m pip install cmake, and put it first in PATH"
  fi
}

# stage_alone COMMAND...: runs the command under a lock, because two builds in one folder would corrupt it.
stage_alone() {
  mkdir -p "$root/build"
  (
    if command -v flock >/dev/null; then flock 9; fi
    "$@" 9>&-
  ) 9>"$root/build/.lock"
}

# stage_configure PRESET [SETUP OPTION]...: installs what tools/setup finds missing, and configures.
stage_configure() {
  local preset=$1 log=$root/build/$1/configure.log
  shift
  # Without root, some packages may stay missing. CMake decides whether that is fatal.
  if ! "$root/tools/setup" "$@" >&2; then
    # tools/setup has printed the reason and what to do.
    if ! command -v cmake >/dev/null || ! command -v "${CXX:-c++}" >/dev/null; then exit 1; fi
    echo "tools/${0##*/}: going on with what is there" >&2
  fi
  stage_check_cmake
  if [[ ! -e $root/build/$preset/CMakeCache.txt ]] && command -v ninja >/dev/null; then
    local -x CMAKE_GENERATOR=${CMAKE_GENERATOR:-Ninja}
  fi
  mkdir -p "$root/build/$preset"
  if ! cmake -S "$root" --preset "$preset" >"$log" 2>&1; then
    sed -n '/^CMake Error/,$p' "$log" >&2
    stage_fail "CMake can't configure build/$preset; see above, and $log"
  fi
}

# stage_jobs: prints the number of parallel compilers: one per processor, if memory allows for the largest files.
stage_jobs() {
  local jobs memory most
  jobs=$(nproc)
  memory=$(sed -n 's/^MemAvailable: *\([0-9]*\) kB$/\1/p' /proc/meminfo 2>/dev/null)
  most=$((${memory:-999999999} / 620000))
  if [[ $jobs -gt $most ]]; then jobs=$most; fi
  echo $((jobs < 1 ? 1 : jobs))
}

# stage_show_build: prints a build's output without CMake's messages. Progress lines stay in place on a terminal;
# elsewhere every tenth of the build is printed.
stage_show_build() {
  local line tenth=-1 open=no terminal=no
  if [[ -t 2 ]]; then terminal=yes; fi
  while IFS= read -r line; do
    case $line in
      'ninja: no work to do'* | *'Re-checking globbed'* | '-- '*) continue ;;
    esac
    if [[ $line =~ ^\[([0-9]+)/([0-9]+)\]' ' || $line =~ ^\[' '*([0-9]+)()%\]' ' ]]; then
      if [[ $terminal == yes ]]; then
        printf '\r\033[K%.76s' "$line" && open=yes
      elif [[ $((10 * BASH_REMATCH[1] / ${BASH_REMATCH[2]:-100})) -ne $tenth ]]; then
        tenth=$((10 * BASH_REMATCH[1] / ${BASH_REMATCH[2]:-100}))
        echo "$line"
      fi
      continue
    fi
    if [[ $open == yes ]]; then echo; fi
    open=no
    printf '%s\n' "$line"
  done >&2
  if [[ $open == yes ]]; then printf '\r\033[K' >&2; fi
}

# stage_build PRESET TARGETS [SETUP OPTION]...
#
# Installs what tools/setup finds missing with these options, configures and builds these targets, which blanks separate. A stamp records a finished build
# with these options; after that, only the build tool runs.
stage_build() {
  stage_check_tree "$1"
  stage_alone stage_build_alone "$@"
}

stage_build_alone() {
  local preset=$1 targets
  read -ra targets <<<"$2"
  shift 2
  local folder=$root/build/$preset
  local stamp="$folder/.setup$*"

  if [[ ! $stamp -nt $root/tools/setup || ! -e $folder/CMakeCache.txt ]]; then
    stage_configure "$preset" "$@"
  fi
  cmake --build "$folder" --target "${targets[@]}" --parallel "$(stage_jobs)" 2>&1 | stage_show_build
  if [[ ! $stamp -nt $root/tools/setup ]]; then : >"$stamp"; fi
}
