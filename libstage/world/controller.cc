// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/controller.hh"

#include <exception>
#include <memory>
#include <mutex>
#include <vector>

#include "geometry/load_error.hh"
#include "messages/report.hh"
#include "models/model.hh"
#include "world/plugin.hh"
#include "world/world.hh"

namespace Stg {

namespace {

/// Controllers may keep the pointer for as long as they like, and libraries are never closed.
class AllArguments {
 public:
  CtrlArgs* Add(const std::string& text) {
    const std::lock_guard<std::mutex> lock(mutex_);  // several threads may load worlds
    all_.push_back(std::make_unique<CtrlArgs>(text, World::ctrlargs));
    return all_.back().get();
  }
  /// The text of the world file; empty if these are not among them.
  std::string TextOf(const void* arguments) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& known : all_)
      if (known.get() == arguments) return known->worldfile;
    return "";
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<CtrlArgs>> all_;
};

AllArguments& Arguments() {
  static AllArguments& all = *new AllArguments;  // there until the very end
  return all;
}

std::string FirstWord(const std::string& text) {
  const size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_first_of(" \t", begin) - begin);
}

}  // namespace

std::string DescribeException() {
  try {
    throw;
  } catch (const std::exception& error) {
    return std::string("an exception: ") + error.what();
  } catch (const char* text) {
    return std::string("the text \"") + text + "\"";
  } catch (int number) {
    return "the number " + std::to_string(number);
  } catch (...) {
    return "an exception of a type of its own";
  }
}

std::string DescribeInitFailure(const std::string& model_name, const void* arguments) {
  const std::string controller = FirstWord(Arguments().TextOf(arguments));
  return (controller.empty() ? "a callback of type CB_INIT"
                             : "Init() of the controller " + messages::Quoted(controller)) +
         " of the model " + messages::Quoted(model_name) + " has thrown " +
         messages::Shortened(DescribeException(), messages::kLongestDetail);
}

void LoadController(Model* model, const std::string& text) {
  const std::string name = FirstWord(text);
  if (name.empty()) throw LoadError("found an empty controller name", 255);

  std::string error;
  void* library = OpenPlugin(name, &error);
  void* init = library ? FindSymbol(library, "Init", &error) : nullptr;
  if (!init)
    throw LoadError("controller " + messages::Quoted(name) + " can't be " +
                        (library ? "used" : "loaded") + ": " +
                        messages::Shortened(error, messages::kLongestDetail) +
                        (library ? "" : "; STAGEPATH names further folders to look in"),
                    255);
  model->AddCallback(Model::CB_INIT, reinterpret_cast<model_callback_t>(init),
                     Arguments().Add(text));
}

}  // namespace Stg
