# SPDX-License-Identifier: GPL-2.0-or-later
#
# What the Python package is built with: Python's headers, and nanobind with its backend, which are on
# PyPI. tools/setup --python puts them into build/venv, whose Python is taken if it is there. Sets
# python_package_FOUND, STAGE_NANOBIND_DIR and what find_package(Python) sets.

set(python_package_FOUND OFF)
# A Python that is no program of ours can't load what a sanitizer has gone over.
if(CMAKE_CROSSCOMPILING OR STAGE_SANITIZE OR STAGE_FUZZ)
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
