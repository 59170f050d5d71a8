# SPDX-License-Identifier: GPL-2.0-or-later

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "Type of build" FORCE)
endif()

# Equal IEEE arithmetic on every processor: no fused multiply-add, no reordering.
add_compile_options(-ffp-contract=off -fno-fast-math)
include(forbid_fused)

# x87 registers round twice, so results would differ from other processors.
include(CheckCXXSourceCompiles)
check_cxx_source_compiles("
  #include <cfloat>
  static_assert(FLT_EVAL_METHOD == 0, \"\");
  int main() {}" STAGE_DOUBLES_ARE_PLAIN)
if(NOT STAGE_DOUBLES_ARE_PLAIN)
  message(FATAL_ERROR "This compiler keeps doubles in wider registers (x87), which rounds twice: build with "
                      "CXXFLAGS='-msse2 -mfpmath=sse', as the preset i386 does")
endif()

# Files larger than 2 GB and file systems with more than 2^32 files, also on 32-bit processors.
add_compile_definitions(_FILE_OFFSET_BITS=64)

# Messages name files relative to the project root, not to the build machine's folders.
add_compile_options("-fmacro-prefix-map=${PROJECT_SOURCE_DIR}/=")

# Only line numbers for debuggers and profilers: saves a quarter of the compile time.
add_compile_options("$<$<CONFIG:RelWithDebInfo>:-g1>")

add_compile_options(-Wall -Wextra -Wpedantic -Wshadow -Wconversion)
if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
  add_compile_options(-Wno-sign-conversion) # GCC's -Wconversion includes it for C only
endif()
if(CMAKE_UNITY_BUILD AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # It takes a source that is included in another one for a header, where anonymous namespaces are an error.
  add_compile_options(-Wno-subobject-linkage)
endif()
if(STAGE_WERROR)
  add_compile_options(-Werror)
endif()

if(STAGE_ASSERTIONS)
  add_compile_definitions(STAGE_ASSERTIONS=1)
endif()

if(STAGE_FUZZ)
  if(NOT CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    message(FATAL_ERROR "STAGE_FUZZ needs Clang: cmake --preset fuzz")
  endif()
  set(sanitizers address,undefined)
  add_compile_options(-fsanitize=fuzzer-no-link)
else()
  set(sanitizers "${STAGE_SANITIZE}")
endif()
if(sanitizers)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # GCC 12 warns of uninitialized variables in its own standard library if that is instrumented.
    add_compile_options(-Wno-maybe-uninitialized)
  endif()
  add_compile_options(-fsanitize=${sanitizers} -fno-sanitize-recover=all -fno-omit-frame-pointer -O1)
  add_link_options(-fsanitize=${sanitizers})
endif()
