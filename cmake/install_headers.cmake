# SPDX-License-Identifier: GPL-2.0-or-later
#
# Run at installation: installs stage.hh and every header of ours that it includes, directly or not,
# into DESTINATION under the name by which it is included. INCLUDE_ROOTS are the folders to look in.

cmake_policy(VERSION 3.22)

set(waiting stage.hh)
set(installed "")
while(waiting)
  list(POP_FRONT waiting name)
  if(name IN_LIST installed)
    continue()
  endif()
  list(APPEND installed "${name}")
  unset(path)
  foreach(root IN LISTS INCLUDE_ROOTS)
    if(EXISTS "${root}/${name}")
      set(path "${root}/${name}")
      break()
    endif()
  endforeach()
  if(NOT path)
    message(FATAL_ERROR "the public header ${name} was not found in ${INCLUDE_ROOTS}")
  endif()
  get_filename_component(folder "${name}" DIRECTORY)
  file(INSTALL "${path}" DESTINATION "${DESTINATION}/${folder}")
  file(STRINGS "${path}" includes REGEX "^[ \t]*#[ \t]*include[ \t]+\"")
  list(TRANSFORM includes REPLACE "^[^\"]*\"([^\"]*)\".*$" "\\1")
  list(APPEND waiting ${includes})
endwhile()
