// SPDX-License-Identifier: GPL-2.0-or-later
#include "random/random.hh"

#include <atomic>
#include <bit>

namespace Stg {
namespace {

// One step of splitmix64.
std::uint64_t SplitMix(std::uint64_t& state) {
  state += 0x9e3779b97f4a7c15U;
  std::uint64_t z = state;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31);
}

std::atomic<std::uint64_t> seed_of_threads{1};
thread_local RandomScope* innermost_scope = nullptr;

RandomStream& StreamOfThread() {
  static thread_local RandomStream stream(seed_of_threads);
  return stream;
}

}  // namespace

void RandomStream::Seed(std::uint64_t seed) {
  for (std::uint64_t& word : state_) word = SplitMix(seed);
}

std::uint64_t RandomStream::Next() {
  const std::uint64_t result = std::rotl(state_[1] * 5, 7) * 9;
  const std::uint64_t shifted = state_[1] << 17;
  state_[2] ^= state_[0];
  state_[3] ^= state_[1];
  state_[1] ^= state_[2];
  state_[0] ^= state_[3];
  state_[2] ^= shifted;
  state_[3] = std::rotl(state_[3], 45);
  return result;
}

double RandomStream::Uniform() { return static_cast<double>(Next() >> 11) * 0x1.0p-53; }

double RandomStream::Uniform(double lo, double hi) {
  const double value = lo + (hi - lo) * Uniform();
  return value < hi ? value : lo;  // rounding may reach hi
}

std::uint32_t RandomStream::Choose(std::uint32_t count) {
  // The upper half of a product of 32-bit numbers. The probabilities of two numbers differ by less
  // than one part in 2^32.
  return static_cast<std::uint32_t>((Next() >> 32) * count >> 32);
}

RandomStream& RandomStream::Current() {
  for (const RandomScope* scope = innermost_scope; scope; scope = scope->outer_)
    if (scope->stream_) return scope->stream_->Get();
  return StreamOfThread();
}

void RandomStream::SeedThreads(std::uint64_t seed) {
  seed_of_threads = seed;
  StreamOfThread().Seed(seed);
}

std::uint64_t MixSeeds(std::uint64_t seed, std::uint64_t part) {
  std::uint64_t mixed = SplitMix(seed) ^ part;
  return SplitMix(mixed);
}

// Clears references, because a callback may delete the model or world that owns the stream.
LazyRandomStream::~LazyRandomStream() {
  for (RandomScope* scope = innermost_scope; scope; scope = scope->outer_)
    if (scope->stream_ == this) scope->stream_ = nullptr;
}

RandomStream& LazyRandomStream::Get() {
  if (!stream_) stream_.reset(new RandomStream(seed_));
  return *stream_;
}

RandomScope::RandomScope(LazyRandomStream* stream) : stream_(stream), outer_(innermost_scope) {
  innermost_scope = this;
}

RandomScope::~RandomScope() { innermost_scope = outer_; }

}  // namespace Stg
