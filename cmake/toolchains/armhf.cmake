# SPDX-License-Identifier: GPL-2.0-or-later
#
# 32-bit Arm, ARMv7 with NEON: Odroid XU4, Raspberry Pi 2 and later with a 32-bit system.

set(CMAKE_SYSTEM_PROCESSOR armv7l)
set(stage_architecture armhf)
set(stage_triplet arm-linux-gnueabihf)
set(stage_triplet_of_libraries arm-linux-gnueabihf)
set(stage_emulator qemu-arm-static)
set(CMAKE_CXX_FLAGS_INIT "-march=armv7-a -mfpu=neon")
include("${CMAKE_CURRENT_LIST_DIR}/debian.cmake")
