// SPDX-License-Identifier: GPL-2.0-or-later
//
// A virtual X display, and mouse and keyboard input for tests of the window. Events pass through
// the X server like a user's.

#ifndef STAGE_TESTS_GUI_X_SERVER_HH
#define STAGE_TESTS_GUI_X_SERVER_HH

#include <sys/types.h>

#include <string>
#include <vector>

namespace gui_testing {

/// Starts Xvfb if it is installed; ends it on destruction.
class XServer {
 public:
  explicit XServer(const std::vector<std::string>& options = {});
  ~XServer();
  XServer(const XServer&) = delete;
  XServer& operator=(const XServer&) = delete;

  /// Display name such as ":1"; empty: no server could be started.
  const std::string& name() const { return name_; }

 private:
  pid_t pid_ = -1;
  std::string name_;
};

/// Sends input through a connection of its own to a display, by the XTest extension.
class Hand {
 public:
  explicit Hand(const std::string& display);
  ~Hand();
  Hand(const Hand&) = delete;
  Hand& operator=(const Hand&) = delete;

  bool works() const { return display_ != nullptr; }
  /// Moves the mouse; screen pixels.
  void MoveTo(int x, int y);
  void Press(int button);
  void Release(int button);
  void Click(int button = 1) {
    Press(button);
    Release(button);
  }
  void HoldKey(const char* key);
  void ReleaseKey(const char* key);
  /// Presses a key by its X name ("p", "period", "bracketright") while the `held` keys are down.
  void Type(const std::string& key, const std::vector<std::string>& held = {});
  /// Sets the keyboard focus.
  void Focus(unsigned long window);
  /// Asks the window to close, like a window manager whose close box is clicked.
  void Close(unsigned long window);
  void Resize(unsigned long window, unsigned width, unsigned height);
  /// Titles of the visible top-level windows.
  std::vector<std::string> Titles();
  /// Window with that title; 0: none.
  unsigned long Find(const std::string& title);

 private:
  void* display_;
};

}  // namespace gui_testing

#endif
