# SPDX-License-Identifier: GPL-2.0-or-later
#
# Plug-ins install themselves (stage_add_plugin). A pkg-config file and a CMake package belong here.

install(TARGETS stage LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(TARGETS stage_program RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
install(DIRECTORY worlds DESTINATION "${STAGE_INSTALL_DATA_DIR}")

install(
  CODE "
    set(INCLUDE_ROOTS \"${PROJECT_SOURCE_DIR}/libstage\" \"${PROJECT_SOURCE_DIR}\")
    set(DESTINATION \"\${CMAKE_INSTALL_PREFIX}/${STAGE_INSTALL_INCLUDE_DIR}\")
    include(\"${PROJECT_SOURCE_DIR}/cmake/install_headers.cmake\")")
