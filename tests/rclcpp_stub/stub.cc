// SPDX-License-Identifier: GPL-2.0-or-later

#include <rmw/rmw.h>

#include <rclcpp/rclcpp.hpp>
#include <rclcpp_components/register_node_macro.hpp>

namespace rclcpp_stub {

Graph& Graph::Get() {
  static Graph graph;
  return graph;
}

std::map<std::string, NodeMaker>& NodeMakers() {
  static std::map<std::string, NodeMaker> makers;
  return makers;
}

Bytes Serialize(TypeSupport type, const void* message) {
  rmw_serialized_message_t made = rmw_get_zero_initialized_serialized_message();
  const rcutils_allocator_t allocator = rcutils_get_default_allocator();
  if (rmw_serialized_message_init(&made, 0, &allocator) != RMW_RET_OK ||
      rmw_serialize(message, type, &made) != RMW_RET_OK)
    throw std::runtime_error("a message can't be serialized");
  Bytes bytes(made.buffer, made.buffer + made.buffer_length);
  if (rmw_serialized_message_fini(&made) != RMW_RET_OK) throw std::bad_alloc();
  return bytes;
}

void Deserialize(TypeSupport type, const Bytes& bytes, void* message) {
  rmw_serialized_message_t given = rmw_get_zero_initialized_serialized_message();
  given.buffer = const_cast<uint8_t*>(bytes.data());
  given.buffer_length = given.buffer_capacity = bytes.size();
  given.allocator = rcutils_get_default_allocator();
  if (rmw_deserialize(&given, type, message) != RMW_RET_OK)
    throw std::runtime_error("found bytes that are no such message");
}

}  // namespace rclcpp_stub

namespace rclcpp {

std::string to_string(const ParameterValue& value) {
  switch (value.get_type()) {
    case PARAMETER_BOOL:
      return value.get<bool>() ? "true" : "false";
    case PARAMETER_INTEGER:
      return std::to_string(value.get<int64_t>());
    case PARAMETER_DOUBLE:
      return std::to_string(value.get<double>());
    case PARAMETER_STRING:
      return value.get<std::string>();
    case PARAMETER_NOT_SET:
      break;
  }
  return "not set";
}

const ParameterValue& Node::declare_parameter(
    const std::string& name, const ParameterValue& value,
    const rcl_interfaces::msg::ParameterDescriptor& descriptor) {
  ParameterValue& kept = parameters_[name];
  kept = value;
  for (const Parameter& given : options_.parameter_overrides())
    if (given.get_name() == name) kept = given.get_parameter_value();
  if (!descriptor.dynamic_typing && kept.get_type() != value.get_type())
    throw std::runtime_error("parameter '" + name + "' has invalid type");
  if (descriptor.read_only) read_only_.insert(name);
  return kept;
}

Parameter Node::get_parameter(const std::string& name) const {
  return Parameter(name, parameters_.at(name));
}

rcl_interfaces::msg::SetParametersResult Node::set_parameter(const Parameter& parameter) {
  rcl_interfaces::msg::SetParametersResult result;
  result.successful = read_only_.count(parameter.get_name()) == 0;
  for (const auto& check : checks_)
    if (const auto known = check.lock(); known && result.successful)
      result = known->callback({parameter});
  if (result.successful) parameters_.at(parameter.get_name()) = parameter.get_parameter_value();
  return result;
}

Node::OnSetParametersCallbackHandle::SharedPtr Node::add_on_set_parameters_callback(
    std::function<rcl_interfaces::msg::SetParametersResult(const std::vector<Parameter>&)> call) {
  const auto handle = std::make_shared<OnSetParametersCallbackHandle>();
  handle->callback = std::move(call);
  checks_.push_back(handle);
  return handle;
}

std::string Node::Resolve(const std::string& name) const {
  if (name[0] == '/') return name;
  return name[0] == '~' ? "/" + name_ + name.substr(1) : "/" + name;
}

void Node::FireTimers() {
  const std::vector<TimerBase::SharedPtr> timers = timers_;  // callbacks may make others
  for (const TimerBase::SharedPtr& timer : timers)
    if (!timer->is_canceled()) timer->execute_callback();
}

}  // namespace rclcpp
