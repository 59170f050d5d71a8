// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/state_exchange.hh"

#include <algorithm>
#include <bit>

#include "models/model.hh"

namespace Stg {

namespace {

constexpr uint64_t kFirstHash = 0xcbf29ce484222325u, kFactor = 0x100000001b3u;
constexpr uint32_t kNoModel = 0xffffffffu, kGoneModel = 0xfffffffeu;

/// Stands for a model that has been deleted: like any pointer to one it must not be followed.
Model* GoneModel() {
  alignas(Model) static char nobody[1];
  return reinterpret_cast<Model*>(nobody);
}

}  // namespace

StateExchange::StateExchange(const std::vector<Model*>& models)
    : models_(models),
      use_(kHash),
      to_(nullptr),
      from_(nullptr),
      end_(nullptr),
      hash_(kFirstHash),
      failed_(false) {}

StateExchange::StateExchange(const std::vector<Model*>& models, Bytes* to)
    : models_(models),
      use_(kSave),
      to_(to),
      from_(nullptr),
      end_(nullptr),
      hash_(kFirstHash),
      failed_(false) {}

StateExchange::StateExchange(const std::vector<Model*>& models, const unsigned char* from,
                             size_t size)
    : models_(models),
      use_(kRestore),
      to_(nullptr),
      from_(from),
      end_(from + size),
      hash_(kFirstHash),
      failed_(false) {}

void StateExchange::Fail(const std::string& message) {
  if (!restoring() || failed_) return;
  failed_ = true;
  message_ = message;
}

void StateExchange::Number(uint64_t* bits, size_t bytes) {
  switch (use_) {
    case kHash:
      for (size_t i = 0; i < bytes; i++) hash_ = (hash_ ^ (*bits >> 8 * i & 0xff)) * kFactor;
      break;
    case kSave:
      for (size_t i = 0; i < bytes; i++)
        to_->push_back(static_cast<unsigned char>(*bits >> 8 * i & 0xff));
      break;
    case kRestore:
      if (left() < bytes) Fail("the state ends too early");
      if (failed_) break;
      *bits = 0;
      for (size_t i = 0; i < bytes; i++) *bits |= uint64_t{*from_++} << 8 * i;
      break;
  }
}

void StateExchange::Expect(uint64_t value, const char* what) {
  uint64_t saved = value;
  Number(&saved, sizeof saved);
  if (saved != value)
    Fail("found " + std::to_string(saved) + ", expected " + std::to_string(value) + ": " + what);
}

uint64_t StateExchange::Count(uint64_t count) {
  Number(&count, sizeof count);
  if (!restoring()) return count;
  if (count > left()) Fail("found more values than there are bytes");
  return failed_ ? 0 : count;
}

void StateExchange::Exchange(double& value) {
  uint64_t bits = std::bit_cast<uint64_t>(value);
  Number(&bits, sizeof bits);
  value = std::bit_cast<double>(bits);
}

void StateExchange::Exchange(float& value) {
  uint64_t bits = std::bit_cast<uint32_t>(value);
  Number(&bits, sizeof value);
  value = std::bit_cast<float>(static_cast<uint32_t>(bits));
}

void StateExchange::Exchange(std::string& text) {
  const uint64_t size = Count(text.size());
  if (restoring() && !failed_) text.resize(static_cast<size_t>(size));
  for (char& c : text) Exchange(c);
}

void StateExchange::Exchange(Pose& pose) { (*this)(pose.x, pose.y, pose.z, pose.a); }

void StateExchange::Exchange(RandomStream& stream) {
  for (std::uint64_t& word : stream.state_) Exchange(word);
}

void StateExchange::Exchange(LazyRandomStream& stream) {
  bool made = stream.stream_ != nullptr;
  (*this)(stream.seed_, made);
  if (restoring() && !made) stream.stream_.reset();
  if (made) Exchange(stream.Get());
}

void StateExchange::Exchange(Model*& model) {
  uint32_t id = model ? model->GetId() : 0;
  Reference(model, id);
}

void StateExchange::Reference(Model*& model, uint32_t& id) {
  uint32_t place = kNoModel;
  if (model) {
    const auto older = [](const Model* m, uint32_t number) { return m->GetId() < number; };
    const auto found = std::lower_bound(models_.begin(), models_.end(), id, older);
    const bool is_there = found != models_.end() && *found == model;
    place = is_there ? static_cast<uint32_t>(found - models_.begin()) : kGoneModel;
  }
  Exchange(place);
  if (!restoring() || failed_) return;
  if (place == kGoneModel) {
    model = GoneModel();
    id = kGoneModel;
    return;
  }
  if (place != kNoModel && place >= models_.size()) return Fail("found a model that is not there");
  model = place == kNoModel ? nullptr : models_[place];
  if (model) id = model->GetId();
}

}  // namespace Stg
