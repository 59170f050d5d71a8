# SPDX-License-Identifier: GPL-2.0-or-later
#
# find_package(Stage) for tests: the library in the build tree STAGE_BINARY_DIR, and the headers of these sources.

if(NOT TARGET Stage::stage)
  get_filename_component(sources "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
  add_library(Stage::stage SHARED IMPORTED)
  set_target_properties(
    Stage::stage
    PROPERTIES IMPORTED_LOCATION "${STAGE_BINARY_DIR}/lib/libstage.so"
               INTERFACE_INCLUDE_DIRECTORIES "${sources}/libstage/include;${sources}/libstage"
               INTERFACE_COMPILE_FEATURES cxx_std_17)
endif()
