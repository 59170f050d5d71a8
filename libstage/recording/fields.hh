// SPDX-License-Identifier: GPL-2.0-or-later
//
// The fields of a world that are logged, and their topics.

#ifndef STAGE_RECORDING_FIELDS_HH
#define STAGE_RECORDING_FIELDS_HH

#include <string>
#include <vector>

#include "models/field.hh"

namespace Stg::recording {

struct FieldSource {
  ModelField* field;
  std::string topic;
};
/// All fields whose `log_interval` is not 0, in the order of creation.
std::vector<FieldSource> FieldsOf(const std::vector<Model*>& models);

}  // namespace Stg::recording

#endif
