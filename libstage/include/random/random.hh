// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random numbers. No simulation result depends on a generator of the whole process such as the C
// library's, which drivers and other threads may use too. Every world and every model has its own
// stream instead (World::random(), Model::random()). Part of <stage.hh>; C++11.

#ifndef STAGE_RANDOM_RANDOM_HH
#define STAGE_RANDOM_RANDOM_HH

#include <cstdint>
#include <memory>

namespace Stg {

class StateExchange;

/// A small deterministic random number generator: equal seeds give equal numbers on every machine.
/// The generator is xoshiro256** 1.0, seeded by splitmix64, both by D. Blackman and S. Vigna
/// (https://prng.di.unimi.it, public domain; "Scrambled Linear Pseudorandom Number Generators", ACM
/// TOMS 47(4), 2021). Must not be shared between threads.
class RandomStream {
 public:
  explicit RandomStream(std::uint64_t seed = 1) { Seed(seed); }

  void Seed(std::uint64_t seed);

  /// Returns 64 random bits.
  std::uint64_t Next();

  /// Returns a multiple of 2^-53 in [0, 1).
  double Uniform();

  /// Returns a number in [lo, hi), or lo if the interval is empty.
  double Uniform(double lo, double hi);

  /// Returns 0 .. count - 1 with equal probability, or 0 if count is 0.
  std::uint32_t Choose(std::uint32_t count);

  /// The stream for functions without a stream argument: Pose::Random() and Color::RandomColor().
  /// It is the model's stream while the model loads, in its callbacks and in its controller's
  /// Init(); otherwise the world's while a world loads or steps; otherwise one per thread.
  static RandomStream& Current();

  /// Reseeds this thread's own stream, and those of threads that have not used theirs yet.
  static void SeedThreads(std::uint64_t seed);

 private:
  friend class StateExchange;
  std::uint64_t state_[4];
};

/// Derives a seed from a seed and a number, so that parts have separate streams. Seeds of
/// neighbouring numbers are uncorrelated.
std::uint64_t MixSeeds(std::uint64_t seed, std::uint64_t part);

/// A stream that is created at its first use, because most models never use theirs.
class LazyRandomStream {
 public:
  explicit LazyRandomStream(std::uint64_t seed) : seed_(seed) {}
  ~LazyRandomStream();

  std::uint64_t seed() const { return seed_; }
  RandomStream& Get();
  /// A copy of the stream in its present state.
  RandomStream Copy() const { return stream_ ? *stream_ : RandomStream(seed_); }
  /// Restarts the sequence.
  void Restart() { stream_.reset(); }
  void Restart(std::uint64_t seed) {
    seed_ = seed;
    stream_.reset();
  }

 private:
  friend class StateExchange;
  LazyRandomStream(const LazyRandomStream&);
  LazyRandomStream& operator=(const LazyRandomStream&);

  std::uint64_t seed_;
  std::unique_ptr<RandomStream> stream_;
};

/// While it exists, RandomStream::Current() of this thread is the given stream (unless deleted).
class RandomScope {
 public:
  explicit RandomScope(LazyRandomStream* stream);
  ~RandomScope();

 private:
  friend class LazyRandomStream;
  friend class RandomStream;
  RandomScope(const RandomScope&);
  RandomScope& operator=(const RandomScope&);

  LazyRandomStream* stream_;
  RandomScope* outer_;
};

}  // namespace Stg

#endif
