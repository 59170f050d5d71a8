# SPDX-License-Identifier: GPL-2.0-or-later
#
# Finds what the Python package is built with: Python's headers, and nanobind with its backend from PyPI. tools/setup
# --python installs these into build/venv, whose Python is preferred. Sets python_package_FOUND, STAGE_NANOBIND_DIR,
# the variables of find_package(Python) and STAGE_PYTHON_SANITIZER: libraries that Python must preload if the package
# is built with a sanitizer.

set(python_package_FOUND OFF)
if(CMAKE_CROSSCOMPILING OR STAGE_FUZZ)
  return()
endif()
if(NOT Python_EXECUTABLE AND EXISTS "${PROJECT_SOURCE_DIR}/build/venv/bin/python")
  set(Python_EXECUTABLE "${PROJECT_SOURCE_DIR}/build/venv/bin/python")
endif()
find_package(Python 3.10 QUIET COMPONENTS Interpreter Development.Module)
if(NOT Python_FOUND)
  return()
endif()
execute_process(
  COMMAND "${Python_EXECUTABLE}" -c "import nanobind, nanobind_backend, numpy; print(nanobind.cmake_dir())"
  OUTPUT_VARIABLE STAGE_NANOBIND_DIR
  OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET
  RESULT_VARIABLE result)
if(result EQUAL 0)
  set(python_package_FOUND ON)
endif()
# Python itself is built without sanitizers.
set(STAGE_PYTHON_SANITIZER "")
if(STAGE_SANITIZE)
  set(runtime libasan.so)
  if(STAGE_SANITIZE MATCHES "thread")
    set(runtime libtsan.so)
  endif()
  # The sanitizer looks up functions of the C++ library, such as those that throw, when it is loaded.
  foreach(library IN ITEMS ${runtime} libstdc++.so.6)
    execute_process(
      COMMAND "${CMAKE_CXX_COMPILER}" -print-file-name=${library}
      OUTPUT_VARIABLE path
      OUTPUT_STRIP_TRAILING_WHITESPACE)
    string(JOIN ":" STAGE_PYTHON_SANITIZER ${STAGE_PYTHON_SANITIZER} "${path}")
  endforeach()
endif()
