# SPDX-License-Identifier: GPL-2.0-or-later
#
# Debian packages: `cpack -G DEB` in the build folder makes one per component from what was built. Builds and
# installations are not affected.

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME stage)
set(CPACK_PACKAGE_VENDOR "The Stage 5 contributors")
set(CPACK_PACKAGE_CONTACT "The Stage 5 contributors <stage5@example.org>") # as in package.xml
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
# Dependencies on foreign libraries come from the linked files, those on our components from stage_package().
if(CMAKE_CROSSCOMPILING)
  # dpkg-shlibdeps only knows the packages of the build machine.
  set(CPACK_DEBIAN_LIBSTAGE5_PACKAGE_DEPENDS
      "libc6 (>= 2.34), libgcc-s1, libstdc++6 (>= 12), libpng16-16 | libpng16-16t64, zlib1g")
  if(STAGE_JPEG_ENABLED)
    string(APPEND CPACK_DEBIAN_LIBSTAGE5_PACKAGE_DEPENDS ", libjpeg62-turbo | libjpeg-turbo8")
  endif()
  if(STAGE_GIF_ENABLED)
    string(APPEND CPACK_DEBIAN_LIBSTAGE5_PACKAGE_DEPENDS ", libgif7")
  endif()
  if(STAGE_LZ4_ENABLED)
    string(APPEND CPACK_DEBIAN_LIBSTAGE5_PACKAGE_DEPENDS ", liblz4-1")
  endif()
  if(STAGE_ZSTD_ENABLED)
    string(APPEND CPACK_DEBIAN_LIBSTAGE5_PACKAGE_DEPENDS ", libzstd1")
  endif()
  set(CPACK_DEBIAN_STAGE-OPENCL_PACKAGE_DEPENDS "ocl-icd-libopencl1 | libopencl1")
else()
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${CMAKE_LIBRARY_OUTPUT_DIRECTORY}")
endif()

# Files that Debian requires in each package: a compressed changelog in its own format, and the licence.
string(TIMESTAMP package_date "%a, %d %b %Y %H:%M:%S +0000" UTC)
set(package_files "${PROJECT_BINARY_DIR}/package")
configure_file(cmake/debian/changelog.in "${package_files}/changelog" @ONLY)
execute_process(COMMAND gzip -9nf "${package_files}/changelog" COMMAND_ERROR_IS_FATAL ANY)
# Debian's trigger updates the linker's cache after installation and removal.
file(COPY cmake/debian/triggers DESTINATION "${package_files}")

# stage_package(NAME SECTION SUMMARY DESCRIPTION [COMPONENT...]): makes the package NAME from the component of that
# name. It depends on the packages of the other components.
macro(stage_package name section summary description)
  list(APPEND CPACK_COMPONENTS_ALL ${name})
  string(TOUPPER ${name} upper_name)
  set(CPACK_DEBIAN_${upper_name}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${upper_name}_PACKAGE_SECTION ${section})
  set(CPACK_COMPONENT_${upper_name}_DESCRIPTION "${summary}\n${description}")
  set(CPACK_COMPONENT_${upper_name}_DEPENDS ${ARGN})
  install(
    FILES cmake/debian/copyright "${package_files}/changelog.gz"
    DESTINATION "${CMAKE_INSTALL_DATAROOTDIR}/doc/${name}"
    COMPONENT ${name})
endmacro()

set(CPACK_COMPONENTS_ALL "")
stage_package(
  libstage5 libs "2D multi-robot simulator, library and worlds"
  "Stage simulates crowds of mobile robots in the plane. This is the library, with\ncontrollers and worlds.")
set(window_component "")
if(STAGE_GUI_ENABLED)
  set(window_component libstagegui5)
  stage_package(
    libstagegui5 libs "2D multi-robot simulator, window" "The window of Stage, and pictures and films without one."
    libstage5)
  set(CPACK_DEBIAN_LIBSTAGEGUI5_PACKAGE_RECOMMENDS "libgl1-mesa-dri | libgl1-nvidia-glvnd-glx")
  # For the includes of <stage.hh> and the libraries in stage.pc.
  set(CPACK_DEBIAN_LIBSTAGE-DEV_PACKAGE_DEPENDS
      "libfltk1.3-dev, libgl-dev, libglu1-mesa-dev | libglu-dev")
  set(CPACK_DEBIAN_STAGE_PACKAGE_RECOMMENDS libstagegui5)
endif()
stage_package(
  libstage-dev libdevel "2D multi-robot simulator, headers"
  "To build programs and controllers for Stage with CMake or pkg-config." libstage5 ${window_component})
stage_package(
  stage science "2D multi-robot simulator, program" "The program, which runs world files in a window or without one." libstage5)
set(CPACK_DEBIAN_STAGE_PACKAGE_SUGGESTS "stage-opencl, ffmpeg") # ffmpeg: --record FILE.mp4
if(STAGE_OPENCL_ENABLED)
  stage_package(
    stage-opencl science "2D multi-robot simulator, OpenCL"
    "The plug-in of Stage that walks the rays of sensors on OpenCL devices." libstage5)
  set(CPACK_DEBIAN_STAGE-OPENCL_PACKAGE_RECOMMENDS "pocl-opencl-icd | opencl-icd")
endif()

foreach(name IN LISTS CPACK_COMPONENTS_ALL)
  string(TOUPPER ${name} upper_name)
  if(NOT CMAKE_CROSSCOMPILING AND name MATCHES "^libstage(gui)?5$")
    set(CPACK_DEBIAN_${upper_name}_PACKAGE_CONTROL_EXTRA "${package_files}/triggers")
  endif()
endforeach()

set(CPACK_PROJECT_CONFIG_FILE "${CMAKE_CURRENT_LIST_DIR}/package_tools.cmake")

include(CPack)
