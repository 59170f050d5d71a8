// SPDX-License-Identifier: GPL-2.0-or-later
//
// Runs a node on the stand-in for rclcpp by commands on standard input, one per line:
//
//   parameter NAME bool|int|double|text VALUE   before the node is made, a value of a parameter
//   node                                        makes the node
//   set NAME bool|int|double|text VALUE         changes a parameter
//   listen TOPIC                                makes a topic have a subscriber; "*": all topics
//   leave TOPIC                                 removes the subscriber
//   publish TOPIC HEX                           sends a message, in CDR, to the node
//   call SERVICE HEX                            calls a service
//   turn                                        calls the node's timers once
//   wait SECONDS                                waits
//
// It prints, in CDR as hexadecimal digits, what the node does:
//
//   publisher TOPIC TYPE DEPTH reliable|best_effort kept|volatile
//   subscription TOPIC TYPE
//   message TOPIC HEX
//   response SERVICE HEX
//   refused REASON                              the node or a parameter was refused

#include <algorithm>
#include <iostream>
#include <rclcpp_components/register_node_macro.hpp>
#include <sstream>
#include <thread>

namespace {

using rclcpp_stub::Bytes;
using rclcpp_stub::Graph;

Bytes FromHex(const std::string& text) {
  Bytes bytes;
  for (size_t i = 0; i + 1 < text.size(); i += 2)
    bytes.push_back(static_cast<uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  return bytes;
}

std::string ToHex(const Bytes& bytes) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const uint8_t byte : bytes) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

rclcpp::Parameter ReadParameter(std::istream& line) {
  std::string name, type, value;
  line >> name >> type;
  std::getline(line >> std::ws, value);
  if (type == "bool") return {name, rclcpp::ParameterValue(value == "true")};
  if (type == "int") return {name, rclcpp::ParameterValue(int64_t{std::stoll(value)})};
  if (type == "double") return {name, rclcpp::ParameterValue(std::stod(value))};
  return {name, rclcpp::ParameterValue(value)};
}

class Driver {
 public:
  void Do(const std::string& text) {
    std::istringstream line(text);
    std::string command, name, hex;
    line >> command;
    if (command == "parameter")
      return options_.parameter_overrides().push_back(ReadParameter(line));
    if (command == "node") return MakeNode();
    if (command == "set") return Set(ReadParameter(line));
    if (command == "turn") return node_->FireTimers();
    line >> name >> hex;
    Graph& graph = Graph::Get();
    if (command == "listen" && name == "*") {
      graph.all_listened = graph.publishers.empty();
      for (const auto& made : graph.publishers) graph.listened.insert(made.topic);
    } else if (command == "listen") {
      graph.listened.insert(name);
    } else if (command == "leave") {
      graph.listened.erase(name);
    } else if (command == "publish") {
      graph.subscriptions.at(name)(FromHex(hex));
    } else if (command == "call") {
      const Bytes response = graph.services.at(name)(FromHex(hex));
      Print();
      std::cout << "response " << name << ' ' << ToHex(response) << '\n';
    } else if (command == "wait") {
      std::this_thread::sleep_for(std::chrono::duration<double>(std::stod(name)));
    } else {
      throw std::runtime_error("found the command " + command);
    }
  }

  /// Prints the messages since the last call.
  static void Print() {
    Graph& graph = Graph::Get();
    for (const auto& [topic, bytes] : graph.published)
      std::cout << "message " << topic << ' ' << ToHex(bytes) << '\n';
    graph.published.clear();
  }

 private:
  void MakeNode() {
    try {
      node_ = rclcpp_stub::NodeMakers().at("stage_ros2_cpp::StageNode")(options_);
    } catch (const std::exception& error) {
      std::cout << "refused " << error.what() << '\n';
      std::exit(0);
    }
    for (const auto& made : Graph::Get().publishers)
      std::cout << "publisher " << made.topic << ' ' << made.type << ' ' << made.depth << ' '
                << (made.reliable ? "reliable" : "best_effort") << ' '
                << (made.kept ? "kept" : "volatile") << '\n';
    for (const auto& [topic, type] : Graph::Get().subscribed_types)
      std::cout << "subscription " << topic << ' ' << type << '\n';
  }

  void Set(const rclcpp::Parameter& parameter) {
    const auto result = node_->set_parameter(parameter);
    if (!result.successful) std::cout << "refused " << result.reason << '\n';
  }

  rclcpp::NodeOptions options_;
  std::shared_ptr<rclcpp::Node> node_;
};

}  // namespace

int main() {
  Driver driver;
  for (std::string line; std::getline(std::cin, line);) {
    driver.Do(line);
    Driver::Print();
  }
}
