// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/flag.hh"

#include <algorithm>

namespace Stg {

Model::Flag* Model::Flag::Nibble(double portion) {
  if (!(size_ > 0)) return nullptr;
  const double taken = portion > 0 ? std::min(portion, size_) : 0;
  size_ -= taken;
  return new Flag(color_, taken);
}

void Model::AddFlag(Flag* flag) {
  if (!flag) return;
  flag_list.push_back(flag);
  CallCallbacks(CB_FLAGINCR);
}

void Model::PushFlag(Flag* flag) {
  if (!flag) return;
  flag_list.push_front(flag);
  CallCallbacks(CB_FLAGINCR);
}

Model::Flag* Model::PopFlag() {
  if (flag_list.empty()) return nullptr;
  Flag* flag = flag_list.front();
  flag_list.pop_front();
  CallCallbacks(CB_FLAGDECR);
  return flag;
}

void Model::RemoveFlag(Flag* flag) {
  if (!flag) return;
  flag_list.remove(flag);
  CallCallbacks(CB_FLAGDECR);  // even if it was not there, as in Stage 4.3
}

}  // namespace Stg
