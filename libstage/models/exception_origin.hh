// SPDX-License-Identifier: GPL-2.0-or-later
//
// Records the origin of exceptions. A callback may throw anything; it propagates unchanged through
// the step to the caller of World::Update(). Its origin is recorded separately.

#ifndef STAGE_MODELS_EXCEPTION_ORIGIN_HH
#define STAGE_MODELS_EXCEPTION_ORIGIN_HH

#include <string>

#include "models/model.hh"

namespace Stg {

/// Origin recorded by the calling thread, such as `a callback of model "r0" in wander.so`, or "".
const char* ExceptionOrigin() noexcept;
void SetExceptionOrigin(const char* text) noexcept;
void ClearExceptionOrigin() noexcept;
/// Call it while the exception of a callback propagates; the innermost call counts. `model` may be
/// null. Does not allocate, because memory may be exhausted.
void RecordExceptionOrigin(const char* what, const Model* model, void (*function)()) noexcept;

/// Call it while an exception of a model's update propagates. Like RecordExceptionOrigin(), but
/// ignores std::bad_alloc, which is not caused by the model.
void RecordUpdateException(const Model* model) noexcept;

/// Describes the exception being handled, such as "the number 42".
std::string DescribeException();
/// Names its origin as well: `a callback of model "r0" in wander.so has thrown the number 42`.
std::string DescribeThrown();

}  // namespace Stg

#endif
