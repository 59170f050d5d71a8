// SPDX-License-Identifier: GPL-2.0-or-later
//
// A virtual X display, and a hand that moves its mouse and presses its keys, for tests of the
// window. Events go the whole way through the X server, as those of a user do.

#ifndef STAGE_TESTS_GUI_X_SERVER_HH
#define STAGE_TESTS_GUI_X_SERVER_HH

#include <sys/types.h>

#include <string>
#include <vector>

namespace gui_testing {

/// Starts Xvfb, if there is one, and ends it.
class XServer {
 public:
  explicit XServer(const std::vector<std::string>& options = {});
  ~XServer();
  XServer(const XServer&) = delete;
  XServer& operator=(const XServer&) = delete;

  /// ":1"; empty: no server could be started.
  const std::string& name() const { return name_; }

 private:
  pid_t pid_ = -1;
  std::string name_;
};

/// A connection of its own to a display, with the XTest extension.
class Hand {
 public:
  explicit Hand(const std::string& display);
  ~Hand();
  Hand(const Hand&) = delete;
  Hand& operator=(const Hand&) = delete;

  bool works() const { return display_ != nullptr; }
  /// Pixels of the screen.
  void MoveTo(int x, int y);
  void Press(int button);
  void Release(int button);
  void Click(int button = 1) {
    Press(button);
    Release(button);
  }
  void HoldKey(const char* key);
  void ReleaseKey(const char* key);
  /// A key by its X name ("p", "period", "bracketright"), after all of the `held` ones.
  void Type(const std::string& key, const std::vector<std::string>& held = {});
  /// Gives the keyboard to a window.
  void Focus(unsigned long window);
  /// What a window manager does when the close box is clicked.
  void Close(unsigned long window);
  void Resize(unsigned long window, unsigned width, unsigned height);
  /// The top-level windows that are to be seen, by title.
  std::vector<std::string> Titles();
  /// The window of that title; 0: none.
  unsigned long Find(const std::string& title);

 private:
  void* display_;
};

}  // namespace gui_testing

#endif
