// SPDX-License-Identifier: GPL-2.0-or-later
//
// All results rely on IEEE 754 doubles with each operation rounded separately. Compiler options
// that change this are rejected here, because otherwise results would silently differ between
// machines. Part of <stage.hh>.

#ifndef STAGE_GEOMETRY_ARITHMETIC_HH
#define STAGE_GEOMETRY_ARITHMETIC_HH

#include <cfloat>

#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__)
#error "Stage: -ffast-math (part of -Ofast) or a part of it changes results; compile without it"
#elif !defined(FLT_EVAL_METHOD) || FLT_EVAL_METHOD != 0
#error "Stage: x87 arithmetic changes results; compile for SSE2: -msse2 -mfpmath=sse"
#endif

#endif
