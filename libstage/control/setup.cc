// SPDX-License-Identifier: GPL-2.0-or-later
//
// Sets up the robots of batch controllers: their arguments and sensors.

#include <locale>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "control/batch_controller.hh"
#include "messages/report.hh"
#include "models/position.hh"
#include "models/ranger.hh"
#include "sensing/fan.hh"

namespace Stg {

namespace {

std::vector<std::string> WordsAfterTheFirst(const std::string& text) {
  std::vector<std::string> words;
  std::istringstream stream(text);
  for (std::string word; stream >> word;) words.push_back(word);
  if (!words.empty()) words.erase(words.begin());
  return words;
}

std::string NumberText(double value) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << value;
  return text.str();
}

/// Reads the whole text as a number. Blanks, names and hexadecimals are none.
bool ReadNumber(const std::string& text, double* value) {
  if (text.find_first_not_of("0123456789.eE+-") != std::string::npos || text.starts_with('+'))
    return false;
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  return (stream >> *value) && stream.eof();
}

std::string NamesOf(const std::vector<ControllerNumber>& numbers) {
  std::string names;
  for (const ControllerNumber& number : numbers)
    names += (names.empty() ? "" : ", ") + std::string(number.name) + "=NUMBER";
  return names.empty() ? "none" : names;
}

void ReadWord(const std::string& word, const std::vector<ControllerNumber>& numbers) {
  const size_t equals = word.find('=');
  const std::string_view name = std::string_view(word).substr(0, equals);
  for (const ControllerNumber& number : numbers) {
    if (equals == std::string::npos || name != number.name) continue;
    double value = 0;
    if (!ReadNumber(word.substr(equals + 1), &value) ||
        !(value >= number.min && value <= number.max))
      throw std::runtime_error("found " + messages::Quoted(word) + ", expected a number from " +
                               NumberText(number.min) + " to " + NumberText(number.max));
    *number.value = value;
    return;
  }
  throw std::runtime_error("found the argument " + messages::Quoted(word) + ", expected " +
                           NamesOf(numbers));
}

/// Frame of the ranger's sensors on the robot. It is computed from local poses, which are equal to
/// the bit for all robots of a kind.
Pose FrameOnRobot(const ModelRanger& ranger, const Model& robot) {
  Pose frame = ranger.GetPose() + ranger.GetGeom().pose;
  for (const Model* above = ranger.Parent(); above && above != &robot; above = above->Parent())
    frame = above->GetPose() + frame;
  return frame;
}

ControllerSensor Describe(const ModelRanger::Sensor& sensor, const Pose& frame) {
  ControllerSensor described{frame + sensor.pose, sensor.fov, sensor.range, {}};
  for (uint32_t i = 0; i < sensor.sample_count; i++)
    described.bearings.push_back(
        internal::sensing::SampleBearing(sensor.fov, sensor.sample_count, i));
  return described;
}

}  // namespace

ControllerSetup::ControllerSetup(ModelPosition* robot, const std::string& text)
    : robot_(robot), words_(WordsAfterTheFirst(text)) {}

void ControllerSetup::ReadNumbers(const std::vector<ControllerNumber>& numbers) const {
  for (const std::string& word : words_) ReadWord(word, numbers);
  for (const ControllerNumber& number : numbers)
    if (std::isnan(*number.value))
      throw std::runtime_error(std::string("found no argument ") + number.name + ", expected " +
                               number.name + "=NUMBER");
}

void ControllerSetup::Use(ModelRanger* ranger) {
  const Pose frame = FrameOnRobot(*ranger, *robot_);
  for (const ModelRanger::Sensor& sensor : ranger->GetSensors())
    sensors_.push_back(Describe(sensor, frame));
  rangers_.push_back(ranger);
  ranger->Subscribe();
}

ModelRanger* ControllerSetup::FindUnusedRanger() const {
  return dynamic_cast<ModelRanger*>(robot_->GetUnsubscribedModelOfType("ranger"));
}

}  // namespace Stg
