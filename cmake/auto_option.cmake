# SPDX-License-Identifier: GPL-2.0-or-later

# stage_auto_option(NAME DOC FOUND)
#
# Adds an option for a part that needs an optional package. AUTO (the default) builds the part if the variable named
# FOUND is true, ON requires it, OFF omits it. Sets NAME_ENABLED. A plain option() with a default would remember that
# a package was missing after it has been installed.
function(stage_auto_option name doc found)
  set(${name} AUTO CACHE STRING "${doc}: AUTO, ON or OFF")
  set_property(CACHE ${name} PROPERTY STRINGS AUTO ON OFF)
  set(enabled OFF)
  if(${name} STREQUAL "AUTO")
    if(${found})
      set(enabled ON)
    endif()
  elseif(${name})
    if(NOT ${found})
      message(FATAL_ERROR "${name} is on, but what it needs was not found; try tools/setup --tests --python")
    endif()
    set(enabled ON)
  endif()
  message(STATUS "${doc}: ${enabled}")
  set(${name}_ENABLED ${enabled} PARENT_SCOPE)
endfunction()
