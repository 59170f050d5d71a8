# SPDX-License-Identifier: GPL-2.0-or-later
#
# 32-bit x86 with SSE2, because x87 registers would round twice.

set(CMAKE_SYSTEM_PROCESSOR i686)
set(stage_architecture i386)
set(stage_triplet i686-linux-gnu)
set(stage_triplet_of_libraries i386-linux-gnu)
if(NOT CMAKE_HOST_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|i[3-6]86)$" OR NOT EXISTS /lib/ld-linux.so.2)
  set(stage_emulator qemu-i386-static)
endif()
set(CMAKE_CXX_FLAGS_INIT "-msse2 -mfpmath=sse")
include("${CMAKE_CURRENT_LIST_DIR}/debian.cmake")
