# SPDX-License-Identifier: GPL-2.0-or-later
#
# Cross-compiles with Debian's compilers and the libraries of a tree made by tools/dev/cross. The toolchain file of each
# processor includes it after setting
#   CMAKE_SYSTEM_PROCESSOR
#   stage_architecture          Debian's name of the architecture
#   stage_triplet               prefix of the compilers
#   stage_triplet_of_libraries  name of the library folders
#   stage_emulator              runs the programs; empty if this machine can run them

set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_CXX_COMPILER ${stage_triplet}-g++)
set(CMAKE_LIBRARY_ARCHITECTURE ${stage_triplet_of_libraries})
get_filename_component(CMAKE_SYSROOT "${CMAKE_CURRENT_LIST_DIR}/../../build/cross/${stage_architecture}" ABSOLUTE)
if(stage_emulator)
  set(CMAKE_CROSSCOMPILING_EMULATOR "${stage_emulator};-L;${CMAKE_SYSROOT}")
endif()

set(CMAKE_FIND_ROOT_PATH "${CMAKE_SYSROOT}")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)

set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE ${stage_architecture})
