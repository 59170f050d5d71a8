// SPDX-License-Identifier: GPL-2.0-or-later
//
// A stand-in for rclcpp, which PyPI does not have: the classes and functions that
// ros2/stage_ros2_cpp uses, with the names and signatures of rclcpp's documentation. Nodes are in
// one process and there is no DDS: a Graph records all messages that are published, and calls
// subscriptions, services and timers when it is told to. Messages are those of ROS.

#ifndef STAGE_TESTS_RCLCPP_STUB_HPP
#define STAGE_TESTS_RCLCPP_STUB_HPP

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <rcl_interfaces/msg/parameter_descriptor.hpp>
#include <rcl_interfaces/msg/set_parameters_result.hpp>
#include <rosidl_runtime_cpp/traits.hpp>
#include <rosidl_typesupport_cpp/message_type_support.hpp>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace rclcpp_stub {

using Bytes = std::vector<uint8_t>;
using TypeSupport = const rosidl_message_type_support_t*;

/// Serializes a message in CDR.
Bytes Serialize(TypeSupport type, const void* message);
/// Throws std::runtime_error if the bytes are no such message.
void Deserialize(TypeSupport type, const Bytes& bytes, void* message);

template <class M>
Bytes BytesOf(const M& message) {
  return Serialize(rosidl_typesupport_cpp::get_message_type_support_handle<M>(), &message);
}
template <class M>
M MessageOf(const Bytes& bytes) {
  M message;
  Deserialize(rosidl_typesupport_cpp::get_message_type_support_handle<M>(), bytes, &message);
  return message;
}

/// A topic that a node publishes, and its quality of service.
struct Advertised {
  std::string topic, type;
  size_t depth;
  bool reliable, kept;
};

/// What the nodes of this process have made.
struct Graph {
  std::vector<Advertised> publishers;
  std::vector<std::pair<std::string, Bytes>> published;  // by topic
  std::set<std::string> listened;                        // topics with a subscriber
  bool all_listened = false;
  std::map<std::string, std::function<void(const Bytes&)>> subscriptions;
  std::map<std::string, std::string> subscribed_types;
  std::map<std::string, std::function<Bytes(const Bytes&)>> services;

  static Graph& Get();
};

}  // namespace rclcpp_stub

namespace rclcpp {

inline bool ok() { return true; }

// ---- logging ------------------------------------------------------------------------------------

class Logger {};

class Clock {
 public:
  using SharedPtr = std::shared_ptr<Clock>;
};

#define RCLCPP_STUB_LOG(logger, ...)   \
  do {                                 \
    (void)(logger);                    \
    std::fprintf(stderr, __VA_ARGS__); \
    std::fputc('\n', stderr);          \
  } while (false)
#define RCLCPP_INFO(logger, ...) RCLCPP_STUB_LOG(logger, __VA_ARGS__)
#define RCLCPP_WARN(logger, ...) RCLCPP_STUB_LOG(logger, __VA_ARGS__)
#define RCLCPP_ERROR(logger, ...) RCLCPP_STUB_LOG(logger, __VA_ARGS__)
#define RCLCPP_WARN_THROTTLE(logger, clock, duration, ...) \
  do {                                                     \
    rclcpp::Clock& used_clock = (clock);                   \
    (void)used_clock;                                      \
    (void)(duration);                                      \
    RCLCPP_STUB_LOG(logger, __VA_ARGS__);                  \
  } while (false)

// ---- parameters ---------------------------------------------------------------------------------

enum ParameterType {
  PARAMETER_NOT_SET = 0,
  PARAMETER_BOOL = 1,
  PARAMETER_INTEGER = 2,
  PARAMETER_DOUBLE = 3,
  PARAMETER_STRING = 4
};

class ParameterValue {
 public:
  ParameterValue() = default;
  explicit ParameterValue(bool value) : value_(value) {}
  explicit ParameterValue(int value) : value_(int64_t{value}) {}
  explicit ParameterValue(int64_t value) : value_(value) {}
  explicit ParameterValue(double value) : value_(value) {}
  explicit ParameterValue(const std::string& value) : value_(value) {}
  explicit ParameterValue(const char* value) : value_(std::string(value)) {}
  ParameterType get_type() const { return static_cast<ParameterType>(value_.index()); }
  template <class T>
  const T& get() const {
    return std::get<T>(value_);
  }

 private:
  std::variant<std::monostate, bool, int64_t, double, std::string> value_;
};

std::string to_string(const ParameterValue& value);

class Parameter {
 public:
  Parameter(const std::string& name, const ParameterValue& value) : name_(name), value_(value) {}
  const std::string& get_name() const { return name_; }
  const ParameterValue& get_parameter_value() const { return value_; }
  bool as_bool() const { return value_.get<bool>(); }
  int64_t as_int() const { return value_.get<int64_t>(); }
  double as_double() const { return value_.get<double>(); }
  const std::string& as_string() const { return value_.get<std::string>(); }

 private:
  std::string name_;
  ParameterValue value_;
};

class NodeOptions {
 public:
  std::vector<Parameter>& parameter_overrides() { return overrides_; }
  const std::vector<Parameter>& parameter_overrides() const { return overrides_; }

 private:
  std::vector<Parameter> overrides_;
};

// ---- publishers, subscriptions and services -----------------------------------------------------

class QoS {
 public:
  QoS(size_t depth) : depth_(depth) {}  // NOLINT(google-explicit-constructor): as in rclcpp
  QoS& reliable() { return reliable_ = true, *this; }
  QoS& best_effort() { return reliable_ = false, *this; }
  QoS& transient_local() { return kept_ = true, *this; }
  size_t depth() const { return depth_; }

 private:
  friend class Node;
  size_t depth_;
  bool reliable_ = true, kept_ = false;
};

class QosOverridingOptions {
 public:
  static QosOverridingOptions with_default_policies() { return {}; }
};

enum class IntraProcessSetting { Enable, Disable, NodeDefault };

struct PublisherOptions {
  IntraProcessSetting use_intra_process_comm = IntraProcessSetting::NodeDefault;
  QosOverridingOptions qos_overriding_options;
};

template <class M>
class Publisher {
 public:
  using SharedPtr = std::shared_ptr<Publisher>;
  explicit Publisher(std::string topic) : topic_(std::move(topic)) {}
  void publish(const M& message) {
    rclcpp_stub::Graph::Get().published.emplace_back(topic_, rclcpp_stub::BytesOf(message));
  }
  size_t get_subscription_count() const {
    const rclcpp_stub::Graph& graph = rclcpp_stub::Graph::Get();
    return graph.all_listened || graph.listened.count(topic_) ? 1 : 0;
  }

 private:
  const std::string topic_;
};

class SubscriptionBase {
 public:
  using SharedPtr = std::shared_ptr<SubscriptionBase>;
};
template <class M>
class Subscription : public SubscriptionBase {};

class ServiceBase {
 public:
  using SharedPtr = std::shared_ptr<ServiceBase>;
};
template <class S>
class Service : public ServiceBase {};

class TimerBase {
 public:
  using SharedPtr = std::shared_ptr<TimerBase>;
  explicit TimerBase(std::function<void()> callback) : callback_(std::move(callback)) {}
  void cancel() { canceled_ = true; }
  bool is_canceled() const { return canceled_; }
  void execute_callback() const { callback_(); }

 private:
  std::function<void()> callback_;
  bool canceled_ = false;
};

// ---- nodes --------------------------------------------------------------------------------------

namespace node_interfaces {
struct OnSetParametersCallbackHandle {
  using SharedPtr = std::shared_ptr<OnSetParametersCallbackHandle>;
  std::function<rcl_interfaces::msg::SetParametersResult(const std::vector<Parameter>&)> callback;
};
}  // namespace node_interfaces

class Node {
 public:
  using SharedPtr = std::shared_ptr<Node>;
  using OnSetParametersCallbackHandle = node_interfaces::OnSetParametersCallbackHandle;

  Node(const std::string& name, const NodeOptions& options) : name_(name), options_(options) {}
  virtual ~Node() = default;

  Logger get_logger() const { return {}; }
  Clock::SharedPtr get_clock() { return clock_; }

  const ParameterValue& declare_parameter(
      const std::string& name, const ParameterValue& value,
      const rcl_interfaces::msg::ParameterDescriptor& descriptor =
          rcl_interfaces::msg::ParameterDescriptor());
  Parameter get_parameter(const std::string& name) const;
  rcl_interfaces::msg::SetParametersResult set_parameter(const Parameter& parameter);
  OnSetParametersCallbackHandle::SharedPtr add_on_set_parameters_callback(
      std::function<rcl_interfaces::msg::SetParametersResult(const std::vector<Parameter>&)> call);

  template <class M>
  std::shared_ptr<Publisher<M>> create_publisher(const std::string& topic, const QoS& qos,
                                                 const PublisherOptions& = {}) {
    const std::string name = Resolve(topic);
    rclcpp_stub::Graph::Get().publishers.push_back(
        {name, rosidl_generator_traits::name<M>(), qos.depth_, qos.reliable_, qos.kept_});
    return std::make_shared<Publisher<M>>(name);
  }

  template <class M, class F>
  std::shared_ptr<Subscription<M>> create_subscription(const std::string& topic, const QoS&,
                                                       F&& callback) {
    rclcpp_stub::Graph& graph = rclcpp_stub::Graph::Get();
    const std::string name = Resolve(topic);
    graph.subscribed_types[name] = rosidl_generator_traits::name<M>();
    graph.subscriptions[name] = [call =
                                     std::forward<F>(callback)](const rclcpp_stub::Bytes& bytes) {
      call(rclcpp_stub::MessageOf<M>(bytes));
    };
    return std::make_shared<Subscription<M>>();
  }

  template <class S, class F>
  std::shared_ptr<Service<S>> create_service(const std::string& service, F&& callback) {
    rclcpp_stub::Graph::Get().services[Resolve(service)] = [call = std::forward<F>(callback)](
                                                               const rclcpp_stub::Bytes& bytes) {
      const auto request =
          std::make_shared<typename S::Request>(rclcpp_stub::MessageOf<typename S::Request>(bytes));
      const auto response = std::make_shared<typename S::Response>();
      call(request, response);
      return rclcpp_stub::BytesOf(*response);
    };
    return std::make_shared<Service<S>>();
  }

  template <class Duration, class F>
  TimerBase::SharedPtr create_wall_timer(Duration, F callback) {
    timers_.push_back(std::make_shared<TimerBase>(callback));
    return timers_.back();
  }

  /// For tests: calls each timer once that is not cancelled.
  void FireTimers();

 private:
  /// Adds the namespace, which is /, or for ~ the name of the node.
  std::string Resolve(const std::string& name) const;

  const std::string name_;
  const NodeOptions options_;
  const Clock::SharedPtr clock_ = std::make_shared<Clock>();
  std::map<std::string, ParameterValue> parameters_;
  std::set<std::string> read_only_;
  std::vector<std::weak_ptr<OnSetParametersCallbackHandle>> checks_;
  std::vector<TimerBase::SharedPtr> timers_;
};

}  // namespace rclcpp

#endif
