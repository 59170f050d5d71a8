// SPDX-License-Identifier: GPL-2.0-or-later
//
// Messages that the robots of a fleet send and receive by their radios, as arrays.

#include <nanobind/ndarray.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "array_groups.hh"
#include "bindings.hh"
#include "crowd.hh"
#include "simulation.hh"

namespace Stg::python {

namespace {

using Payloads = nb::ndarray<const uint8_t, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;
using Mask = nb::ndarray<const bool, nb::shape<-1>, nb::c_contig, nb::device::cpu>;

/// Messages that the radios of a fleet have received: an element of each column per message.
struct ReceivedMessages {
  std::vector<int32_t> receiver, sender, size;
  std::vector<double> range, bearing, sent;
  std::vector<uint8_t> payload;  // kMaxBytes for each message
};

/// Finds the robot of a fleet to which a radio belongs.
class SenderFinder {
 public:
  SenderFinder(const World& world, const std::vector<ModelPosition*>& robots) : world_(world) {
    for (size_t i = 0; i < robots.size(); i++)
      if (robots[i]) robots_[robots[i]] = static_cast<int32_t>(i);
  }
  /// The robot's index; -1 if the radio is gone or belongs to none of the robots.
  int32_t Find(uint32_t radio) {
    const auto [known, is_new] = known_.try_emplace(radio, kNobody);
    if (!is_new) return known->second;
    for (const Model* model = world_.FindModel(radio); model; model = model->Parent())
      if (const auto robot = robots_.find(model); robot != robots_.end())
        return known->second = robot->second;
    return kNobody;
  }

 private:
  static constexpr int32_t kNobody = -1;
  const World& world_;
  std::unordered_map<const Model*, int32_t> robots_;
  std::unordered_map<uint32_t, int32_t> known_;  // by the id of a radio
};

void Append(const ModelRadio& radio, int32_t receiver, SenderFinder* senders,
            ReceivedMessages* to) {
  for (const ModelRadio::Message& message : radio.Received()) {
    to->receiver.push_back(receiver);
    to->sender.push_back(senders->Find(message.sender));
    to->size.push_back(static_cast<int32_t>(message.size));
    to->range.push_back(message.range);
    to->bearing.push_back(message.bearing);
    to->sent.push_back(static_cast<double>(message.sent) / 1e6);
    to->payload.insert(to->payload.end(), std::begin(message.data), std::end(message.data));
  }
}

/// A new NumPy array with these numbers, `width` to a row; 0: without rows.
template <typename T>
nb::object ArrayOf(std::vector<T> numbers, size_t width = 0) {
  auto kept = std::make_unique<std::vector<T>>(std::move(numbers));
  const nb::capsule owner(kept.get(),
                          [](void* held) noexcept { delete static_cast<std::vector<T>*>(held); });
  std::vector<T>& all = *kept.release();
  const size_t shape[] = {all.size() / std::max<size_t>(width, 1), width};
  return nb::cast(nb::ndarray<nb::numpy, T>(all.data(), width > 0 ? 2 : 1, shape, owner));
}

void Send(Simulation& simulation, Crowd& crowd, size_t index, const Payloads& payloads,
          const Mask& which) {
  if (payloads.shape(0) != crowd.size() || which.shape(0) != crowd.size())
    throw nb::value_error("found another number of messages than there are robots");
  const size_t bytes = payloads.shape(1);
  if (bytes > ModelRadio::kMaxBytes) throw nb::value_error("found a message of more than 64 bytes");
  simulation.With([&](World&) {
    const std::vector<ModelRadio*> radios = crowd.RadiosOf(simulation, 0, index);
    for (size_t i = 0; i < radios.size(); i++)
      if (radios[i] && which.data()[i]) radios[i]->Send(payloads.data() + i * bytes, bytes);
  });
}

nb::tuple Receive(Simulation& simulation, Crowd& crowd, size_t index) {
  ReceivedMessages received = simulation.With([&](World& world) {
    const std::vector<ModelRadio*> radios = crowd.RadiosOf(simulation, 0, index);
    SenderFinder senders(world, crowd.RobotsOf(simulation, 0));
    ReceivedMessages all;
    for (size_t i = 0; i < radios.size(); i++) {
      if (!radios[i]) continue;
      EnsureSubscribed(radios[i]);
      Append(*radios[i], static_cast<int32_t>(i), &senders, &all);
    }
    return all;
  });
  return nb::make_tuple(ArrayOf(std::move(received.receiver)), ArrayOf(std::move(received.sender)),
                        ArrayOf(std::move(received.range)), ArrayOf(std::move(received.bearing)),
                        ArrayOf(std::move(received.sent)), ArrayOf(std::move(received.size)),
                        ArrayOf(std::move(received.payload), ModelRadio::kMaxBytes));
}

}  // namespace

void BindRadio(nb::class_<Simulation>& world) {
  world
      .def("send", &Send, nb::arg("crowd"), nb::arg("index"), nb::arg("payloads"), nb::arg("which"))
      .def("messages", &Receive, nb::arg("crowd"), nb::arg("index"));
}

}  // namespace Stg::python
