# SPDX-License-Identifier: GPL-2.0-or-later
# shellcheck shell=bash
# Access to Debian with debootstrap, shared by tools/dev/fresh and tools/dev/cross, which source this file.

# host_mirror: prints the mirror that apt uses on this machine; prints nothing if this is not Debian.
host_mirror() {
  command -v apt-get >/dev/null || return 0
  # shellcheck disable=SC2016 # apt expands it
  apt-get indextargets --format '$(ORIGIN)|$(LABEL)|$(SITE)' 'Created-By: Packages' 2>/dev/null |
    sed -n 's/^Debian|Debian|//p' | sed -n 1p
}

# use_proxies: exports apt's proxies, because debootstrap only reads the environment.
use_proxies() {
  command -v apt-config >/dev/null || return 0
  local http='' https=''
  eval "$(apt-config shell http Acquire::http::Proxy https Acquire::https::Proxy)"
  if [[ -n $http && $http != DIRECT ]]; then export http_proxy=$http; fi
  if [[ -n $https && $https != DIRECT ]]; then export https_proxy=$https; fi
}

# stage_make_links_relative TREE: makes absolute links relative, so that they do not leave the tree.
stage_make_links_relative() {
  local tree=$1 link target
  find "$tree" -xdev -type l -lname '/*' -print0 | while IFS= read -r -d '' link; do
    target=$tree$(readlink "$link")
    if [[ -e $target ]]; then ln -sfn --relative "$target" "$link"; fi
  done
}

# stage_merge_usr TREE: moves what packages unpacked into /lib64 and the like to /usr, as apt does. Otherwise the tree
# cannot be set up.
stage_merge_usr() {
  local tree=$1 name
  for name in lib32 lib64 libo32 libx32; do
    if [[ ! -d $tree/$name || -L $tree/$name ]]; then continue; fi
    mkdir -p "$tree/usr/$name"
    cp -a "$tree/$name/." "$tree/usr/$name/"
    rm -r -- "${tree:?}/$name"
    ln -s "usr/$name" "$tree/$name"
  done
}

# stage_fetch_tree ARCH: fetches the libraries to link with into build/cross/ARCH, unless they exist. Runs nothing from
# the tree.
stage_fetch_tree() {
  local arch=$1 tree=$root/build/cross/$1
  if [[ -e $tree.made ]]; then return; fi
  "$root/tools/setup" --no-gui --cross="$arch" >&2
  if [[ $EUID -ne 0 ]]; then
    echo "fetching libraries for $arch needs root, as debootstrap does: sudo $0 $arch" >&2
    return 1
  fi
  local suite mirror include=libc6-dev,libpng-dev,libjpeg-dev,libgif-dev,nlohmann-json3-dev,liblz4-dev,libzstd-dev
  include+=,ocl-icd-opencl-dev,opencl-headers,pocl-opencl-icd,libgtest-dev,libbenchmark-dev
  suite=$(. /etc/os-release && [[ $ID == debian ]] && echo "${VERSION_CODENAME:-bookworm}") || suite=bookworm
  mirror=$(host_mirror)
  use_proxies
  rm -rf --one-file-system -- "$tree"
  mkdir -p "$tree"
  echo "fetching libraries for $arch ($suite) into $tree" >&2
  debootstrap --foreign --variant=minbase --arch="$arch" --include="$include" "$suite" "$tree" \
    ${mirror:+"$mirror"} >"$tree.log" 2>&1 || {
    echo "that failed; see $tree.log" >&2
    return 1
  }
  local package
  for package in "$tree"/var/cache/apt/archives/*.deb; do
    dpkg --fsys-tarfile "$package" | tar --extract --directory="$tree" --keep-directory-symlink
  done
  stage_merge_usr "$tree"
  stage_make_links_relative "$tree"
  : >"$tree.made"
}

# stage_run_foreign_programs ARCH: enables the kernel to run programs for that processor, in an emulator if necessary.
stage_run_foreign_programs() {
  local tree=$root/build/cross/$1 name registry=/proc/sys/fs/binfmt_misc
  export QEMU_LD_PREFIX=$tree
  case $1 in
    arm64) name=qemu-aarch64 ;;
    armhf) name=qemu-arm ;;
    *)
      name=''
      # Programs for i386 run natively with the tree's libraries. The loader ignores libraries of the other word size.
      export LD_LIBRARY_PATH=$tree/usr/lib/i386-linux-gnu:$tree/lib/i386-linux-gnu${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
      ;;
  esac
  if [[ -n $name && ! -e $registry/$name ]]; then
    mount -t binfmt_misc binfmt_misc "$registry" 2>/dev/null || true
    cat "/usr/lib/binfmt.d/$name.conf" >"$registry/register" 2>/dev/null || true
  fi
  if "$tree/bin/true" 2>/dev/null; then return; fi
  if [[ -n $name ]]; then
    echo "programs of $1 can't be run: that needs root once, the package qemu-user-static and binfmt_misc" >&2
  else
    echo "programs of $1 can't be run: apt-get install libc6-i386" >&2
  fi
  return 1
}
