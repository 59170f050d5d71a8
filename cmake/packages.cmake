# SPDX-License-Identifier: GPL-2.0-or-later
#
# Debian packages: `cpack -G DEB` in the build folder makes one for each component. Builds and
# installations do not notice.

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME stage)
set(CPACK_PACKAGE_VENDOR "The Stage 5 contributors")
set(CPACK_PACKAGE_CONTACT "The Stage 5 contributors")
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
# Libraries of others: what the files were linked with. Our own: the component, see below.
if(CMAKE_CROSSCOMPILING)
  # dpkg-shlibdeps knows the packages of this machine alone.
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
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${CMAKE_LIBRARY_OUTPUT_DIRECTORY}")
endif()

# stage_package(NAME SECTION SUMMARY [COMPONENT...]): the package NAME, of the component of that
# name, which needs the other components.
macro(stage_package name section summary)
  list(APPEND CPACK_COMPONENTS_ALL ${name})
  string(TOUPPER ${name} upper_name)
  set(CPACK_DEBIAN_${upper_name}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${upper_name}_PACKAGE_SECTION ${section})
  set(CPACK_COMPONENT_${upper_name}_DESCRIPTION "${summary}")
  set(CPACK_COMPONENT_${upper_name}_DEPENDS ${ARGN})
endmacro()

set(CPACK_COMPONENTS_ALL "")
stage_package(libstage5 libs "The library, the controllers and the worlds that come with it")
set(window_component "")
if(STAGE_GUI_ENABLED)
  set(window_component libstagegui5)
  stage_package(libstagegui5 libs "The window, and pictures without one" libstage5)
  set(CPACK_DEBIAN_LIBSTAGEGUI5_PACKAGE_RECOMMENDS "libgl1-mesa-dri | libgl1-nvidia-glvnd-glx")
  # What <stage.hh> includes, and what stage.pc links with.
  set(CPACK_DEBIAN_LIBSTAGE-DEV_PACKAGE_DEPENDS
      "libfltk1.3-dev, libgl-dev, libglu1-mesa-dev | libglu-dev")
  set(CPACK_DEBIAN_STAGE_PACKAGE_RECOMMENDS libstagegui5)
endif()
stage_package(libstage-dev libdevel "Headers, to build programs and controllers" libstage5
              ${window_component})
stage_package(stage science "The program" libstage5)
set(CPACK_DEBIAN_STAGE_PACKAGE_SUGGESTS stage-opencl)
if(STAGE_OPENCL_ENABLED)
  stage_package(stage-opencl science "Sensor rays on OpenCL devices" libstage5)
  set(CPACK_DEBIAN_STAGE-OPENCL_PACKAGE_RECOMMENDS "pocl-opencl-icd | opencl-icd")
endif()

set(CPACK_PROJECT_CONFIG_FILE "${CMAKE_CURRENT_LIST_DIR}/package_tools.cmake")

include(CPack)
