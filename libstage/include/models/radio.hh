// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelRadio: sends short messages to nearby radios, which measure where they come from (range and
// bearing). Part of <stage.hh>.
//
// Controllers run after the sensing of a step. What they send in the step at time t is received at
// the beginning of the step at t + (1 + delay) * interval. Each running radio receives it that is
// of another tree, on the channel on which the message was sent, and within the sender's range. The
// range is measured horizontally, between origins. If the sender has line_of_sight, a horizontal
// ray at its height must not meet a body that rangers see, except for both trees. Ranges and
// bearings belong to the poses at that instant, before the moves of the step. A radio keeps what it
// receives until its next update, usually in the same step, and then reports it.

#ifndef STAGE_MODELS_RADIO_HH
#define STAGE_MODELS_RADIO_HH

#include <cstddef>
#include <cstdint>
#include <vector>

#include "models/model.hh"
#include "random/random.hh"

namespace Stg {

class RadioTraffic;

class ModelRadio : public Model {
 public:
  static const size_t kMaxBytes = 64;  ///< maximum length of a message

  /// A message that has been received.
  struct Message {
    uint32_t sender;                ///< id of the radio that sent it, which may be deleted
    uint32_t size;                  ///< number of bytes
    usec_t sent;                    ///< simulated time
    meters_t range;                 ///< horizontal distance to the sender
    radians_t bearing;              ///< direction of the sender, relative to this radio's heading
    unsigned char data[kMaxBytes];  ///< the bytes; 0 from `size` on

    Message() : sender(0), size(0), sent(0), range(0), bearing(0), data() {}
    void ExchangeState(StateExchange& exchange);
  };

  ModelRadio(World* world, Model* parent, const std::string& type);
  ~ModelRadio();

  /// Sends a message once to all radios that hear it, also without subscribers. Does not fail if
  /// nobody does. Parallel callbacks may call it for radios of their own robot. Refused with a
  /// message, returning false, if there are more than kMaxBytes bytes.
  bool Send(const void* data, size_t bytes);
  /// Messages that were received until the last update and not reported by an earlier one: by step,
  /// then by distance, by the sender's id, and in the order of sending.
  const std::vector<Message>& Received() const { return received_; }
  /// Number of messages that have been sent and are still under way.
  size_t GetSendingCount() const { return sending_.size(); }

  // May be changed between steps and by controllers. The first three concern messages that this
  // radio sends, the others messages that it receives.
  meters_t range;           ///< how far messages are heard
  bool line_of_sight;       ///< bodies block messages
  unsigned int delay;       ///< steps, in addition to the usual one
  int channel;              ///< only radios on the same channel hear each other
  double loss;              ///< probability that a message is lost
  meters_t range_noise;     ///< standard deviation of measured ranges
  radians_t bearing_noise;  ///< standard deviation of measured bearings
  bool collisions;          ///< a radio that could hear two others in a step hears none
  unsigned int capacity;    ///< maximum number of messages for an update

  using Model::Load;
  void Load() override;
  void ExchangeState(StateExchange& exchange) override;

 protected:
  void Reseed(uint64_t seed) override;
  void Startup() override;
  void Shutdown() override;
  void Update() override;
  /// Reports the messages that have arrived.
  void Gather(internal::sensing::FanList* fans) override;

 private:
  friend class RadioTraffic;

  /// A message under way.
  struct Sending {
    usec_t due;  // simulated time of the step in which it is received
    usec_t sent;
    int channel;
    uint32_t size;
    unsigned char data[kMaxBytes];

    Sending() : due(0), sent(0), channel(0), size(0), data() {}
    void ExchangeState(StateExchange& exchange);
  };

  unsigned int ReadCount(const char* name, unsigned int value, int least);
  /// The random numbers of what is received.
  RandomStream* Noise();
  /// Draws whether a message is lost.
  bool Loses();
  /// Draws an error of a measurement; 0 if the deviation is 0 or no number.
  double Error(double deviation);

  std::vector<Sending> sending_;   // in the order of sending
  std::vector<Message> arrived_;   // since the last update
  std::vector<Message> received_;  // as of the last update
  RandomStream noise_;
  bool seeded_;
};

}  // namespace Stg

#endif
