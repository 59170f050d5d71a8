// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/state_exchange.hh"

#include <algorithm>

#include "messages/assert.hh"
#include "models/model.hh"

namespace Stg {

namespace {

constexpr uint32_t kNoModel = 0xffffffffu, kGoneModel = 0xfffffffeu;

/// A placeholder for a deleted model. It must not be dereferenced.
Model* GoneModel() {
  alignas(Model) static char nobody[1];
  return reinterpret_cast<Model*>(nobody);
}

}  // namespace

StateExchange::StateExchange(const std::vector<Model*>& models)
    : models_(models),
      use_(kHash),
      to_(nullptr),
      at_(nullptr),
      end_(nullptr),
      hash_(kFnv1aStart),
      failed_(false),
      omits_readings_(false) {}

StateExchange::StateExchange(const std::vector<Model*>& models, Bytes* to)
    : models_(models),
      use_(kSave),
      to_(to),
      at_(to->data() + to->size()),
      end_(at_),
      hash_(kFnv1aStart),
      failed_(false),
      omits_readings_(false) {}

StateExchange::StateExchange(const std::vector<Model*>& models, const unsigned char* from,
                             size_t size)
    : models_(models),
      use_(kRestore),
      to_(nullptr),
      at_(const_cast<unsigned char*>(from)),
      end_(at_ + size),
      hash_(kFnv1aStart),
      failed_(false),
      omits_readings_(false) {}

void StateExchange::Finish() {
  if (use_ != kSave || at_ == end_) return;  // there is no spare capacity
  to_->resize(saved());
  end_ = at_ = to_->data() + to_->size();
}

void StateExchange::Reserve(size_t bytes) {
  STAGE_ASSERT(!hashing());
  if (restoring()) return Fail("the state ends too early");
  constexpr size_t kSome = 256;
  const size_t so_far = saved();
  to_->resize(std::max(to_->capacity(), 2 * so_far + bytes + kSome));
  at_ = to_->data() + so_far;
  end_ = to_->data() + to_->size();
}

void StateExchange::Fail(const std::string& message) {
  if (!restoring() || failed_) return;
  failed_ = true;
  message_ = message;
}

void StateExchange::Plain(void* bytes, size_t size) {
  auto* const place = static_cast<unsigned char*>(bytes);
  if (hashing()) {
    for (size_t i = 0; i < size; i++) HashByte(place[i]);
    return;
  }
  if (left() < size) Reserve(size);
  if (failed_) return;
  if (restoring())
    std::copy_n(at_, size, place);
  else
    std::copy_n(place, size, at_);
  at_ += size;
  STAGE_ASSERT(at_ <= end_);
}

void StateExchange::Expect(uint64_t value, const char* what) {
  uint64_t saved = value;
  Exchange(saved);
  if (saved != value)
    Fail("found " + std::to_string(saved) + ", expected " + std::to_string(value) + ": " + what);
}

size_t StateExchange::Count(size_t count) {
  uint64_t found = count;
  Exchange(found);
  if (!restoring()) return count;
  if (found > left()) Fail("found more values than there are bytes");
  return failed_ ? 0 : static_cast<size_t>(found);
}

void StateExchange::Exchange(std::string& text) {
  const size_t size = Count(text.size());
  if (restoring() && !failed_) text.resize(size);
  Plain(text.data(), text.size());
}

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
  if (model && !restoring()) {
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
  if (place != kNoModel && place >= models_.size())
    return Fail("found an invalid index of a model");
  model = place == kNoModel ? nullptr : models_[place];
  if (model) id = model->GetId();
}

}  // namespace Stg
