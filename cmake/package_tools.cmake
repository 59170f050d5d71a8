# SPDX-License-Identifier: GPL-2.0-or-later
#
# Runs in cpack before it makes packages: without these programs cpack fails and does not say why.

set(missing "")
if(NOT EXISTS /usr/bin/dpkg-shlibdeps)
  string(APPEND missing " dpkg-dev")
endif()
if(NOT EXISTS /usr/bin/file)
  string(APPEND missing " file")
endif()
list(GET CPACK_INSTALL_CMAKE_PROJECTS 0 build_folder)
if(NOT EXISTS "${build_folder}/bin/stage")
  message(FATAL_ERROR "${build_folder} has no program yet: build it first, such as by tools/run simple.world --opencl")
endif()
if(CPACK_GENERATOR STREQUAL "DEB" AND missing)
  message(FATAL_ERROR "Debian packages need these tools, which are missing: apt-get install${missing}")
endif()
