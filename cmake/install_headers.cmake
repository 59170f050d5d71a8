# SPDX-License-Identifier: GPL-2.0-or-later
#
# Runs at installation: installs stage.hh, and every header of this project that it includes directly or indirectly,
# into DESTINATION under the name by which it is included. INCLUDE_ROOTS are the folders to search. The header
# OPTIONAL is skipped unless WITH_OPTIONAL is on.
#
# Installed headers include each other by relative paths ("../geometry/color.hh"), so that clients may include
# <Stage-5.0/stage.hh> as well as <stage.hh>. The modified copies are kept in STAGING_DIR and only rewritten if they
# change, so that reinstalling does not recompile clients.

cmake_policy(VERSION 3.22)

# Sets VARIABLE to the path of the header NAME below one of INCLUDE_ROOTS.
function(find_header variable name)
  foreach(root IN LISTS INCLUDE_ROOTS)
    if(EXISTS "${root}/${name}")
      set(${variable} "${root}/${name}" PARENT_SCOPE)
      return()
    endif()
  endforeach()
  message(FATAL_ERROR "the public header ${name} was not found in ${INCLUDE_ROOTS}")
endfunction()

# Sets VARIABLE to the text of the header at PATH, which will be installed in FOLDER, with relative includes of the
# headers in ARGN.
function(read_with_relative_includes variable path folder)
  file(READ "${path}" text)
  foreach(include IN LISTS ARGN)
    file(RELATIVE_PATH relative "/${folder}" "/${include}")
    string(REPLACE "#include \"${include}\"" "#include \"${relative}\"" text "${text}")
  endforeach()
  set(${variable} "${text}" PARENT_SCOPE)
endfunction()

function(write_if_different path text)
  if(EXISTS "${path}")
    file(READ "${path}" old_text)
    if("${old_text}" STREQUAL "${text}")
      return()
    endif()
  endif()
  file(WRITE "${path}" "${text}")
endfunction()

set(waiting stage.hh)
set(installed "")
while(waiting)
  list(POP_FRONT waiting name)
  if(name IN_LIST installed)
    continue()
  endif()
  list(APPEND installed "${name}")
  if(name STREQUAL OPTIONAL AND NOT WITH_OPTIONAL)
    continue()
  endif()
  find_header(path "${name}")
  get_filename_component(folder "${name}" DIRECTORY)
  file(STRINGS "${path}" includes REGEX "^#include \"")
  list(TRANSFORM includes REPLACE "^[^\"]*\"([^\"]*)\".*$" "\\1")
  list(APPEND waiting ${includes})
  read_with_relative_includes(text "${path}" "${folder}" ${includes})
  write_if_different("${STAGING_DIR}/${name}" "${text}")
  file(INSTALL "${STAGING_DIR}/${name}" DESTINATION "${DESTINATION}/${folder}")
endwhile()
