# SPDX-License-Identifier: GPL-2.0-or-later
#
# For other processors, with Debian's cross compilers and the libraries of a tree that tools/cross has
# made. Included by the toolchain file of each, which says
#   CMAKE_SYSTEM_PROCESSOR
#   stage_architecture          Debian's name of it
#   stage_triplet               that its compilers begin with
#   stage_triplet_of_libraries  of the folders with libraries
#   stage_emulator              what runs its programs; nothing if this machine can

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
