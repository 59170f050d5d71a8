# SPDX-License-Identifier: GPL-2.0-or-later
#
# Rules of `cmake --install`. packages.cmake makes one package per component.

include(CMakePackageConfigHelpers)

# ---- to run ----

install(
  TARGETS stage
  LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}"
          COMPONENT libstage5
          NAMELINK_COMPONENT libstage-dev)
if(STAGE_GUI_ENABLED)
  install(
    TARGETS stagegui
    LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}"
            COMPONENT libstagegui5
            NAMELINK_COMPONENT libstage-dev)
endif()
install(TARGETS stage_program RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT stage)
get_property(plugin_targets GLOBAL PROPERTY STAGE_PLUGIN_TARGETS)
foreach(plugin IN LISTS plugin_targets)
  set(component libstage5)
  if(plugin STREQUAL "stage_cl")
    set(component stage-opencl)
  endif()
  install(
    TARGETS ${plugin} LIBRARY DESTINATION "${STAGE_INSTALL_PLUGIN_DIR}" COMPONENT ${component})
endforeach()
install(
  DIRECTORY worlds
  DESTINATION "${STAGE_INSTALL_DATA_DIR}"
  COMPONENT libstage5)
install(
  FILES LICENSE
  DESTINATION "${CMAKE_INSTALL_DATAROOTDIR}/doc/stage"
  COMPONENT libstage5)

# ---- to build clients: everything below is relative, so installations can be moved ----

install(
  CODE "
    set(INCLUDE_ROOTS \"${PROJECT_SOURCE_DIR}/libstage/include\" \"${PROJECT_SOURCE_DIR}/libstage\" \"${PROJECT_SOURCE_DIR}\"
                      \"${PROJECT_SOURCE_DIR}/libstage/gui\")
    set(OPTIONAL window/world_gui.hh)
    set(WITH_OPTIONAL ${STAGE_GUI_ENABLED})
    set(STAGING_DIR \"${PROJECT_BINARY_DIR}/installed_headers\")
    set(DESTINATION \"\${CMAKE_INSTALL_PREFIX}/${STAGE_INSTALL_INCLUDE_DIR}\")
    include(\"${PROJECT_SOURCE_DIR}/cmake/install_headers.cmake\")"
  COMPONENT libstage-dev)

# Clients of Stage 4.3 include <Stage-4.3/stage.hh>, with the flags of pkg-config or CMake, or with those of the folder above.
# install_old_header: installs a header of that name in FOLDER, which includes HEADER.
function(install_old_header folder header)
  set(staged "${PROJECT_BINARY_DIR}/old_headers/${folder}/stage.hh")
  file(CONFIGURE OUTPUT "${staged}" CONTENT "// SPDX-License-Identifier: GPL-2.0-or-later\n\n#include \"${header}\"\n")
  install(
    FILES "${staged}"
    DESTINATION "${folder}/Stage-4.3"
    COMPONENT libstage-dev)
endfunction()
get_filename_component(include_name "${STAGE_INSTALL_INCLUDE_DIR}" NAME)
get_filename_component(include_parent "${STAGE_INSTALL_INCLUDE_DIR}" DIRECTORY)
install_old_header("${STAGE_INSTALL_INCLUDE_DIR}" ../stage.hh)
install_old_header("${include_parent}" "../${include_name}/stage.hh")

set(pkgconfig_dir "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
file(RELATIVE_PATH pkgconfig_to_prefix "/prefix/${pkgconfig_dir}" "/prefix")
string(REGEX REPLACE "/$" "" pkgconfig_to_prefix "${pkgconfig_to_prefix}")
# --as-needed: clients without a window do not depend on the window's libraries. These come after libstage, whose
# definitions take precedence for functions that both define.
set(pkgconfig_window_libraries "")
if(STAGE_GUI_ENABLED)
  string(JOIN " " pkgconfig_window_libraries "-Wl,--push-state,--as-needed" -lstagegui
         -lfltk_images -lfltk_gl -lfltk -lX11 -lGL -lGLU "-Wl,--pop-state")
endif()
configure_file(cmake/stage.pc.in stage.pc @ONLY)
install(
  FILES "${PROJECT_BINARY_DIR}/stage.pc"
  DESTINATION "${pkgconfig_dir}"
  COMPONENT libstage-dev)

# CMake finds lower-case file names, and folders in any case, for find_package(stage), (Stage) and (STAGE).
set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/Stage")
set(library_link "${CMAKE_INSTALL_LIBDIR}/libstage.so")
set(library_file "${library_link}.${PROJECT_VERSION}")
set(window_library_link "${CMAKE_INSTALL_LIBDIR}/libstagegui.so")
configure_package_config_file(
  cmake/stage-config.cmake.in "${PROJECT_BINARY_DIR}/stage-config.cmake"
  INSTALL_DESTINATION "${package_dir}"
  PATH_VARS STAGE_INSTALL_INCLUDE_DIR STAGE_INSTALL_PLUGIN_DIR library_link library_file
            window_library_link
  NO_CHECK_REQUIRED_COMPONENTS_MACRO)
write_basic_package_version_file(
  "${PROJECT_BINARY_DIR}/stage-config-version.cmake" COMPATIBILITY AnyNewerVersion)
install(
  FILES "${PROJECT_BINARY_DIR}/stage-config.cmake"
        "${PROJECT_BINARY_DIR}/stage-config-version.cmake"
  DESTINATION "${package_dir}"
  COMPONENT libstage-dev)
# ROS looks for it here.
install(
  FILES package.xml
  DESTINATION "${CMAKE_INSTALL_DATADIR}/Stage"
  COMPONENT libstage-dev)

include(packages)
