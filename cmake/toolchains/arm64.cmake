# SPDX-License-Identifier: GPL-2.0-or-later
#
# 64-bit Arm: Raspberry Pi 3 and later with a 64-bit system, Jetson, RK3588 and the like.

set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(stage_architecture arm64)
set(stage_triplet aarch64-linux-gnu)
set(stage_triplet_of_libraries aarch64-linux-gnu)
set(stage_emulator qemu-aarch64-static)
include("${CMAKE_CURRENT_LIST_DIR}/debian.cmake")
