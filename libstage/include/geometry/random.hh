// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random numbers. No result of a simulation depends on a generator that the whole process shares,
// such as the C library's: anybody may draw from those, drivers and other threads too. Every world
// and every model has a stream of its own instead (World::random(), Model::random()).
// Part of <stage.hh>; C++11.

#ifndef STAGE_GEOMETRY_RANDOM_HH
#define STAGE_GEOMETRY_RANDOM_HH

#include <cstdint>
#include <memory>

namespace Stg {

class StateExchange;

/// A small deterministic random number generator: the same seed gives the same numbers on every
/// machine. The generator is xoshiro256** 1.0 and its state is filled by splitmix64, both by
/// D. Blackman and S. Vigna (https://prng.di.unimi.it, public domain; "Scrambled Linear
/// Pseudorandom Number Generators", ACM TOMS 47(4), 2021). Not safe to share between threads.
class RandomStream {
 public:
  explicit RandomStream(std::uint64_t seed = 1) { Seed(seed); }

  void Seed(std::uint64_t seed);

  /// 64 random bits.
  std::uint64_t Next();

  /// In [0, 1), a multiple of 2^-53.
  double Uniform();

  /// In [lo, hi); lo where the interval is empty.
  double Uniform(double lo, double hi);

  /// From 0 to count - 1, each number equally likely; 0 where count is 0.
  std::uint32_t Choose(std::uint32_t count);

  /// The stream for functions that are not given one: Pose::Random() and Color::RandomColor().
  /// While a model loads, and during its callbacks and its controller's Init(), it is that model's
  /// stream; otherwise, while a world loads or steps, the world's; otherwise one of this thread.
  static RandomStream& Current();

  /// Begins this thread's own stream anew, and those of threads that have not drawn from theirs.
  static void SeedThreads(std::uint64_t seed);

 private:
  friend class StateExchange;
  std::uint64_t state_[4];
};

/// A new seed, made from a seed and a number. Seeds of neighbouring numbers have nothing in common:
/// with them the parts of a whole get streams of their own.
std::uint64_t MixSeeds(std::uint64_t seed, std::uint64_t part);

/// A stream that is only made when somebody draws from it: most models never do.
class LazyRandomStream {
 public:
  explicit LazyRandomStream(std::uint64_t seed) : seed_(seed) {}
  ~LazyRandomStream();

  std::uint64_t seed() const { return seed_; }
  RandomStream& Get();
  /// The next number will be the first one again.
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

/// While an object of it lives, RandomStream::Current() of this thread is the given stream, unless
/// that has been deleted.
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
