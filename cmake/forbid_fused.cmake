# SPDX-License-Identifier: GPL-2.0-or-later
#
# Forbids fused multiply-add on all processors. For GCC -ffp-contract=off is not sufficient: its vectorizer still
# turns rotations into such instructions (vfmaddsub on x86, as of GCC 12; fcmla on Arm). tests/rules/fused_test.py
# looks for them in the built files.

include(CheckCXXCompilerFlag)
include(CheckCXXSourceCompiles)

# On x86, forbids instruction sets with fused instructions, including AVX-512. These options come after those of
# CXXFLAGS, such as -march=native, and override them.
foreach(set IN ITEMS fma fma4 avx512f)
  check_cxx_compiler_flag(-mno-${set} STAGE_COMPILER_KNOWS_NO_${set})
  if(STAGE_COMPILER_KNOWS_NO_${set})
    add_compile_options(-mno-${set})
  endif()
endforeach()

# Options for code that needs such an instruction set, for example lanes of AVX-512: disables automatic vectorization.
set(STAGE_NO_FUSED_VECTORS "")
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set(STAGE_NO_FUSED_VECTORS -fno-tree-loop-vectorize -fno-tree-slp-vectorize)
endif()

# Arm processors from ARMv8.3 on fuse the multiplication of complex numbers, which no option disables separately.
check_cxx_source_compiles("
  #if !defined(__ARM_FEATURE_COMPLEX) && !defined(__ARM_FEATURE_SVE)
  #error
  #endif
  int main() {}" STAGE_PROCESSOR_FUSES_COMPLEX_NUMBERS)
if(STAGE_PROCESSOR_FUSES_COMPLEX_NUMBERS)
  add_compile_options(${STAGE_NO_FUSED_VECTORS})
endif()
