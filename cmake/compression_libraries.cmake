# SPDX-License-Identifier: GPL-2.0-or-later
#
# Finds the compression libraries for logs. Defines the imported targets stage_LZ4 and stage_ZSTD, LZ4_FOUND and
# ZSTD_FOUND. Debian's packages of these libraries contain no files for CMake.

# stage_find_library(NAME HEADER LIBRARY)
function(stage_find_library name header library)
  find_path(${name}_HEADERS ${header})
  find_library(${name}_LIBRARY ${library})
  mark_as_advanced(${name}_HEADERS ${name}_LIBRARY)
  set(${name}_FOUND FALSE PARENT_SCOPE)
  if(${name}_HEADERS AND ${name}_LIBRARY)
    set(${name}_FOUND TRUE PARENT_SCOPE)
    add_library(stage_${name} UNKNOWN IMPORTED)
    set_target_properties(
      stage_${name} PROPERTIES IMPORTED_LOCATION "${${name}_LIBRARY}"
                               INTERFACE_INCLUDE_DIRECTORIES "${${name}_HEADERS}")
  endif()
endfunction()

stage_find_library(LZ4 lz4frame.h lz4)
stage_find_library(ZSTD zstd.h zstd)
