// Of rclcpp what a node with parameters, publishers and subscriptions uses, within one process: a publisher hands its
// messages to `published`, a test hands messages to a subscription by its topic, and `spin` calls `on_spin`.
#pragma once

#include <any>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace rclcpp {

struct Logger {};

class Duration {
 public:
  explicit Duration(double seconds) : seconds_(seconds) {}
  [[nodiscard]] double seconds() const { return seconds_; }

 private:
  double seconds_;
};

class Time {
 public:
  explicit Time(double seconds = 0) : seconds_(seconds) {}
  friend Duration operator-(const Time& a, const Time& b) { return Duration(a.seconds_ - b.seconds_); }

 private:
  double seconds_;
};

/// Of the type that its YAML has; another one throws, as rclcpp does.
inline std::map<std::string, std::any> parameters;
inline std::vector<std::string> warnings;
inline std::map<std::string, std::any> published;
inline std::map<std::string, std::function<void(const std::any&)>> subscriptions;
inline std::function<void()> on_spin;
inline double clock_s = 0;

template <class Message>
class Publisher {
 public:
  using SharedPtr = std::shared_ptr<Publisher>;
  explicit Publisher(std::string topic) : topic_(std::move(topic)) {}
  void publish(const Message& message) { published[topic_] = message; }

 private:
  std::string topic_;
};

template <class Message>
class Subscription {
 public:
  using SharedPtr = std::shared_ptr<Subscription>;
};

class Node {
 public:
  explicit Node(const std::string&) {}
  template <class Value>
  Value declare_parameter(const std::string& name, const Value& otherwise) {
    const auto found = parameters.find(name);
    return found == parameters.end() ? otherwise : std::any_cast<Value>(found->second);
  }
  template <class Message>
  std::shared_ptr<Publisher<Message>> create_publisher(const std::string& topic, int) {
    return std::make_shared<Publisher<Message>>(topic);
  }
  template <class Message, class Callback>
  std::shared_ptr<Subscription<Message>> create_subscription(const std::string& topic, int, Callback callback) {
    subscriptions[topic] = [callback](const std::any& message) {
      callback(std::make_shared<const Message>(std::any_cast<Message>(message)));
    };
    return std::make_shared<Subscription<Message>>();
  }
  [[nodiscard]] Logger get_logger() const { return {}; }
  [[nodiscard]] Time now() const { return Time(clock_s); }
};

inline void init(int, char**) {}
inline void spin(const std::shared_ptr<Node>&) { on_spin(); }
inline void shutdown() {}

}  // namespace rclcpp

#define RCLCPP_WARN(logger, ...)                         \
  do {                                                   \
    (void)(logger);                                      \
    char warning[400];                                   \
    std::snprintf(warning, sizeof warning, __VA_ARGS__); \
    rclcpp::warnings.emplace_back(warning);              \
  } while (false)
