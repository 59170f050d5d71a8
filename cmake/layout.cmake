# SPDX-License-Identifier: GPL-2.0-or-later
#
# Layout of the build tree. It equals that of an installation (bin/, lib/, lib/stage-5.0/, share/stage/worlds), so
# that the program finds its library, and the library its plug-ins and worlds, by the same relative paths in both.

# Installations and packages take what was built, which need not include tests and benchmarks.
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)

# Programs and plug-ins are not linked again when only code inside a shared library has changed.
set(CMAKE_LINK_DEPENDS_NO_SHARED ON)

# Always PREFIX/lib, because clients of Stage look for plug-ins there.
set(CMAKE_INSTALL_LIBDIR lib CACHE PATH "Directory of libraries, below the prefix")
include(GNUInstallDirs)

set(STAGE_PLUGIN_SUBDIR "stage-${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}")
set(STAGE_INSTALL_PLUGIN_DIR "${CMAKE_INSTALL_LIBDIR}/${STAGE_PLUGIN_SUBDIR}")
set(STAGE_INSTALL_DATA_DIR "${CMAKE_INSTALL_DATADIR}/stage")
set(STAGE_INSTALL_INCLUDE_DIR
    "${CMAKE_INSTALL_INCLUDEDIR}/Stage-${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}")

# Path of the installed worlds, relative to the folder of the library.
file(RELATIVE_PATH STAGE_WORLDS_FROM_LIBRARY "/prefix/${CMAKE_INSTALL_LIBDIR}" "/prefix/${STAGE_INSTALL_DATA_DIR}/worlds")
file(MAKE_DIRECTORY "${PROJECT_BINARY_DIR}/share/stage")
file(CREATE_LINK "${PROJECT_SOURCE_DIR}/worlds" "${PROJECT_BINARY_DIR}/share/stage/worlds" SYMBOLIC)

set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/bin")
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/lib")
set(CMAKE_ARCHIVE_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/lib")
set(STAGE_PLUGIN_OUTPUT_DIR "${CMAKE_LIBRARY_OUTPUT_DIRECTORY}/${STAGE_PLUGIN_SUBDIR}")

# stage_set_run_path(TARGET PATH) sets the same relative run path for the build tree and the installation, so that
# both can be moved. Tests and benchmarks are not installed and keep CMake's default.
function(stage_set_run_path target path)
  set_target_properties(${target} PROPERTIES INSTALL_RPATH "${path}" BUILD_WITH_INSTALL_RPATH ON)
endfunction()
file(RELATIVE_PATH bin_to_lib "${CMAKE_INSTALL_FULL_BINDIR}" "${CMAKE_INSTALL_FULL_LIBDIR}")
set(STAGE_PROGRAM_RPATH "$ORIGIN/${bin_to_lib}")
set(STAGE_PLUGIN_RPATH "$ORIGIN/..")

# stage_add_plugin(TARGET SOURCE...): adds a plug-in TARGET.so, linked to libstage, in the folder of plug-ins.
# install_rules.cmake installs it.
function(stage_add_plugin target)
  add_library(${target} MODULE ${ARGN})
  target_link_libraries(${target} PRIVATE stage)
  set_target_properties(
    ${target} PROPERTIES PREFIX "" LIBRARY_OUTPUT_DIRECTORY "${STAGE_PLUGIN_OUTPUT_DIR}")
  stage_set_run_path(${target} "${STAGE_PLUGIN_RPATH}")
  if(NOT STAGE_SANITIZE AND NOT STAGE_FUZZ)
    # Report undefined symbols when the plug-in is built, not when it is loaded.
    target_link_options(${target} PRIVATE LINKER:--no-undefined)
  endif()
  set_property(GLOBAL APPEND PROPERTY STAGE_PLUGIN_TARGETS ${target})
endfunction()
