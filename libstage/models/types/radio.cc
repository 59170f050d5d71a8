// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/radio.hh"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "messages/report.hh"
#include "models/host.hh"
#include "models/noise.hh"
#include "models/property_checks.hh"
#include "models/state_exchange.hh"
#include "models/types/built_in_types.hh"
#include "models/types/radio_traffic.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

void Describe(const ModelRadio& radio, SensorExtent* extent) {
  extent->rays_vary = radio.line_of_sight;
}

const std::vector<ModelRadio::Message>& Heard(const ModelRadio& radio) { return radio.Received(); }

ReadingShape ShapeOfCount(const ModelRadio&) { return ReadingShape(); }
bool CopyCount(const ModelRadio& radio, size_t, int32_t* to) {
  *to = static_cast<int32_t>(radio.Received().size());
  return true;
}

using Message = ModelRadio::Message;
void PutSender(const Message& heard, int32_t* to) { *to = static_cast<int32_t>(heard.sender); }
void PutRange(const Message& heard, double* to) { *to = heard.range; }
void PutBearing(const Message& heard, double* to) { *to = heard.bearing; }
void PutSent(const Message& heard, double* to) { *to = static_cast<double>(heard.sent) / 1e6; }
void PutSize(const Message& heard, int32_t* to) { *to = static_cast<int32_t>(heard.size); }
void PutData(const Message& heard, uint8_t* to) { std::ranges::copy(heard.data, to); }

/// Exchanges the bytes of a message. Bytes behind `size` are always 0.
void ExchangeBytes(StateExchange* exchange, uint32_t* size, unsigned char* data) {
  (*exchange)(*size);
  if (exchange->restoring() && !exchange->failed()) {
    if (*size > ModelRadio::kMaxBytes) {
      *size = 0;
      return exchange->Fail("found a message of more than 64 bytes");
    }
    std::memset(data, 0, ModelRadio::kMaxBytes);
  }
  exchange->Plain(data, *size);
}

}  // namespace

ModelType RadioType() {
  return ModelTypeOf<ModelRadio>("radio")
      .Moves(ModelType::kStays)
      .Updates(ModelType::kParallel)
      .Senses(Describe)
      .Measurable()
      .Reads(MakeReading("count", "", "Number of messages received.", ShapeOfCount, CopyCount))
      .Reads(MakeListReading("sender", "",
                             "Id of the radio that sent each message; the nearest is first.", Heard,
                             PutSender))
      .Reads(MakeListReading("range", "m", "Measured distance to the sender.", Heard, PutRange))
      .Reads(MakeListReading("bearing", "rad",
                             "Measured direction of the sender, relative to the radio's heading.",
                             Heard, PutBearing))
      .Reads(
          MakeListReading("sent", "s", "Simulated time when the message was sent.", Heard, PutSent))
      .Reads(MakeListReading("size", "", "Number of bytes of the message.", Heard, PutSize))
      .Reads(MakeListReading("data", "", "The bytes of the message, followed by zeros.", Heard,
                             PutData, ModelRadio::kMaxBytes));
}

ModelRadio::ModelRadio(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_),
      range(1),
      line_of_sight(false),
      delay(0),
      channel(0),
      loss(0),
      range_noise(0),
      bearing_noise(0),
      collisions(false),
      capacity(64),
      seeded_(false) {
  ClearBlocks();
  geom.size.Zero();
  vis.obstacle_return = false;
  vis.blob_return = false;
  vis.ranger_return = -1.0;
  host().traffic->Add(this);
}

ModelRadio::~ModelRadio() { host().traffic->Remove(this); }

// ---- loading ------------------------------------------------------------------------------------

void ModelRadio::Load() {
  if (!LoadCommon()) return;
  range = wf->ReadLength(wf_entity, "range", range);
  range_noise = wf->ReadLength(wf_entity, "range_noise", range_noise);
  bearing_noise = wf->ReadAngle(wf_entity, "bearing_noise", bearing_noise);
  const std::pair<const char*, double> kNotNegative[] = {
      {"range", range}, {"range_noise", range_noise}, {"bearing_noise", bearing_noise}};
  for (const auto& [name, value] : kNotNegative) CheckNotNegative(*wf, wf_entity, name, value);
  loss = wf->ReadFloat(wf_entity, "loss", loss);
  if (!(loss >= 0 && loss <= 1))
    wf->Fail(wf_entity, "loss", "found a probability that is not between 0 and 1");
  line_of_sight = wf->ReadInt(wf_entity, "line_of_sight", line_of_sight) != 0;
  collisions = wf->ReadInt(wf_entity, "collisions", collisions) != 0;
  channel = wf->ReadInt(wf_entity, "channel", channel);
  delay = ReadCount("delay", delay, 0);
  capacity = ReadCount("capacity", capacity, 1);
}

unsigned int ModelRadio::ReadCount(const char* name, unsigned int value, int least) {
  const int count = wf->ReadInt(wf_entity, name, static_cast<int>(value));
  if (count < least)
    wf->Fail(wf_entity, name,
             "found " + std::to_string(count) + ", expected " + std::to_string(least) + " or more");
  return static_cast<unsigned int>(count);
}

// ---- messages -----------------------------------------------------------------------------------

bool ModelRadio::Send(const void* data, size_t bytes) {
  if (bytes > kMaxBytes) {
    messages::Report(LogLevel::kError, "stage: " + messages::Quoted(token) +
                                           ": found a message of " + std::to_string(bytes) +
                                           " bytes, expected at most " + std::to_string(kMaxBytes) +
                                           "; send it in several parts");
    return false;
  }
  Sending& message = sending_.emplace_back();
  message.sent = world_base().SimTimeNow();
  message.due = message.sent + (usec_t{delay} + 1) * world_base().sim_interval;
  message.channel = channel;
  message.size = static_cast<uint32_t>(bytes);
  if (bytes > 0) std::memcpy(message.data, data, bytes);
  return true;
}

RandomStream* ModelRadio::Noise() {
  if (!seeded_) noise_.Seed(NoiseSeed(token));
  seeded_ = true;
  return &noise_;
}

bool ModelRadio::Loses() { return loss > 0 && Noise()->Uniform() < loss; }

double ModelRadio::Error(double deviation) {
  constexpr double kMaxDeviation = 1e300;  // keeps measurements finite
  if (!(deviation > 0) || !std::isfinite(deviation)) return 0;
  return std::min(deviation, kMaxDeviation) * NormalError(Noise());
}

void ModelRadio::Startup() {
  arrived_.clear();
  received_.clear();
  Model::Startup();
}

void ModelRadio::Shutdown() {
  arrived_.clear();
  received_.clear();
  Model::Shutdown();
}

void ModelRadio::Update() {
  GatherSerially();
  Model::Update();
}

void ModelRadio::Gather(sensing::FanList*) {
  received_.swap(arrived_);
  arrived_.clear();
}

// ---- state --------------------------------------------------------------------------------------

void ModelRadio::Message::ExchangeState(StateExchange& exchange) {
  exchange(sender, sent, range, bearing);
  ExchangeBytes(&exchange, &size, data);
}

void ModelRadio::Sending::ExchangeState(StateExchange& exchange) {
  exchange(due, sent, channel);
  ExchangeBytes(&exchange, &size, data);
}

void ModelRadio::Reseed(uint64_t seed) {
  Model::Reseed(seed);
  seeded_ = false;
}

void ModelRadio::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  exchange(range, line_of_sight, delay, channel, loss, range_noise, bearing_noise, collisions,
           capacity, sending_, arrived_, received_, noise_, seeded_);
}

}  // namespace Stg
