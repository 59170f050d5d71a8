// SPDX-License-Identifier: GPL-2.0-or-later
//
// Who threw what is on its way out of a step. A callback may throw anything; it goes through the
// step to whoever called World::Update(), as it is. What is known of its origin is noted beside it.

#ifndef STAGE_MODELS_THROWN_HH
#define STAGE_MODELS_THROWN_HH

#include <string>

#include "models/model.hh"

namespace Stg {

/// The text is that of the calling thread: "a callback of model "r0" in wander.so", or empty.
const char* Thrower() noexcept;
void SetThrower(const char* text) noexcept;
void ForgetThrower() noexcept;
/// To be called while the exception of a callback passes. The innermost one counts. `model` may be
/// null. Needs no memory, as there may be none.
void NoteThrower(const char* what, const Model* model, void (*function)()) noexcept;

/// To be called while an exception of a model's update passes: NoteThrower(), unless it is for lack
/// of memory, which is no fault of the model.
void NoteUpdateThrower(const Model* model) noexcept;

/// The exception that is being handled: "the number 42".
std::string DescribeException();

}  // namespace Stg

#endif
