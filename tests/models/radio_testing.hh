// SPDX-License-Identifier: GPL-2.0-or-later
//
// Radios for tests.

#ifndef STAGE_TESTS_MODELS_RADIO_TESTING_HH
#define STAGE_TESTS_MODELS_RADIO_TESTING_HH

#include <memory>
#include <string>

#include "support/model_testing.hh"

namespace Stg {

inline std::string Radio(const std::string& name, double x, double y,
                         const std::string& properties = "") {
  return "radio( name \"" + name + "\" pose [" + std::to_string(x) + " " + std::to_string(y) +
         " 0 0] " + properties + " )\n";
}

inline bool SendText(ModelRadio* from, const std::string& text) {
  return from->Send(text.data(), text.size());
}

inline std::string TextOf(const ModelRadio::Message& message) {
  return std::string(reinterpret_cast<const char*>(message.data), message.size);
}

/// The texts of the messages that a radio reports, separated by spaces.
inline std::string Heard(const ModelRadio& radio) {
  Journal journal;
  for (const ModelRadio::Message& message : radio.Received())
    journal.entries.push_back(TextOf(message));
  return journal.Text();
}

/// Radios "a" at the origin and "b" at (3, 4) m, of which b runs.
struct Pair {
  explicit Pair(const std::string& of_a = "", const std::string& of_b = "",
                const std::string& rest = "")
      : world(LoadText(Radio("a", 0, 0, "range 10 " + of_a) + Radio("b", 3, 4, of_b) + rest)),
        a(Find<ModelRadio>(*world, "a")),
        b(FindRunning<ModelRadio>(*world, "b")) {}
  /// Sends a message and makes a step.
  std::string Pass(const std::string& text = "hi") {
    EXPECT_TRUE(SendText(a, text));
    Step(*world);
    return Heard(*b);
  }
  std::unique_ptr<World> world;
  ModelRadio *a, *b;
};

}  // namespace Stg

#endif
