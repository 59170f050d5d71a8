# SPDX-License-Identifier: GPL-2.0-or-later
#
# No fused multiply-add, whatever processor one builds for. -ffp-contract=off does not suffice with GCC: its
# vectorizer makes rotations into such instructions all the same (vfmaddsub on x86, as of GCC 12; fcmla on Arm).
# tests/rules/fused_test.py looks for them in what has been built.

include(CheckCXXCompilerFlag)
include(CheckCXXSourceCompiles)

# On x86, the compiler may not use instructions that fuse, and so none of AVX-512, which has its own. These
# options come behind those of CXXFLAGS, such as -march=native, and win.
foreach(set IN ITEMS fma fma4 avx512f)
  check_cxx_compiler_flag(-mno-${set} STAGE_COMPILER_KNOWS_NO_${set})
  if(STAGE_COMPILER_KNOWS_NO_${set})
    add_compile_options(-mno-${set})
  endif()
endforeach()

# Options for what can't do without instructions that fuse, such as lanes of AVX-512: only what the source
# says itself is done in vectors.
set(STAGE_NO_FUSED_VECTORS "")
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set(STAGE_NO_FUSED_VECTORS -fno-tree-loop-vectorize -fno-tree-slp-vectorize)
endif()

# Arm processors of ARMv8.3 and later multiply complex numbers so; none of their options takes that away alone.
check_cxx_source_compiles("
  #if !defined(__ARM_FEATURE_COMPLEX) && !defined(__ARM_FEATURE_SVE)
  #error
  #endif
  int main() {}" STAGE_PROCESSOR_FUSES_COMPLEX_NUMBERS)
if(STAGE_PROCESSOR_FUSES_COMPLEX_NUMBERS)
  add_compile_options(${STAGE_NO_FUSED_VECTORS})
endif()
