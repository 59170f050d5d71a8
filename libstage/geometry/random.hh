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

  /// One of so many, counted from 0, all as likely; 0 where count is 0.
  std::uint32_t Choose(std::uint32_t count);

  /// What functions draw from that are handed no stream, Pose::Random() and Color::RandomColor():
  /// while a model loads, its controller's Init() runs or a callback of it is called, that model's
  /// stream; otherwise, while a world loads or steps, the world's; otherwise one of this thread.
  static RandomStream& Current();

  /// Begins this thread's own stream anew, and those of threads that have not drawn from theirs.
  static void SeedThreads(std::uint64_t seed);

 private:
  std::uint64_t state_[4];
};

/// The seed of something that is part of, or stands beside, something else: well mixed.
std::uint64_t MixSeeds(std::uint64_t seed, std::uint64_t part);

/// A stream that is only made when somebody draws from it: most models never do.
class LazyRandomStream {
 public:
  explicit LazyRandomStream(std::uint64_t seed) : seed_(seed) {}
  ~LazyRandomStream();

  std::uint64_t seed() const { return seed_; }
  RandomStream& Get();
  /// Begins anew.
  void Restart() { stream_.reset(); }
  void Restart(std::uint64_t seed) {
    seed_ = seed;
    stream_.reset();
  }

 private:
  LazyRandomStream(const LazyRandomStream&);
  LazyRandomStream& operator=(const LazyRandomStream&);

  std::uint64_t seed_;
  std::unique_ptr<RandomStream> stream_;
};

/// While it lives, RandomStream::Current() of this thread is this stream, unless that is gone.
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
