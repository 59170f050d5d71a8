// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/x_server.hh"

#include <X11/XKBlib.h>
#include <X11/Xlib.h>
#include <X11/Xutil.h>
#include <X11/extensions/XTest.h>
#include <X11/keysym.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

#include "support/patience.hh"

namespace gui_testing {

namespace {

constexpr int kStartMilliseconds = static_cast<int>(1000 * patience::kPatience);

/// Display number that the server writes when it is ready; empty if it fails.
std::string ReadNumber(int pipe_end) {
  std::string text;
  for (;;) {
    pollfd ready = {pipe_end, POLLIN, 0};
    if (poll(&ready, 1, kStartMilliseconds) <= 0) return "";
    char c = 0;
    if (read(pipe_end, &c, 1) != 1) return "";
    if (c == '\n') return text;
    text += c;
  }
}

Display* Of(void* display) { return static_cast<Display*>(display); }

/// True if the symbol is typed with Shift held.
bool NeedsShift(Display* display, KeySym symbol, KeyCode code) {
  return XkbKeycodeToKeysym(display, code, 0, 0) != symbol;
}

}  // namespace

XServer::XServer(const std::vector<std::string>& options) {
  int ends[2];
  if (pipe(ends) != 0) return;
  const std::string descriptor = std::to_string(ends[1]);
  std::vector<const char*> words = {"Xvfb",     "-displayfd", descriptor.c_str(),
                                    "-screen",  "0",          "1500x1100x24",
                                    "-noreset", "-nolisten",  "tcp"};
  for (const std::string& option : options) words.push_back(option.c_str());
  words.push_back(nullptr);
  pid_ = fork();
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    close(ends[0]);
    const int null = open("/dev/null", O_RDWR);
    dup2(null, 1);
    dup2(null, 2);
    execvp(words[0], const_cast<char* const*>(words.data()));
    _exit(127);
  }
  close(ends[1]);
  const std::string number = ReadNumber(ends[0]);
  close(ends[0]);
  if (!number.empty()) name_ = ":" + number;
}

XServer::~XServer() {
  if (pid_ <= 0) return;
  kill(pid_, SIGTERM);
  for (int tries = 0; tries < 100; tries++) {
    if (waitpid(pid_, nullptr, WNOHANG) != 0) return;
    poll(nullptr, 0, 50);
  }
  kill(pid_, SIGKILL);  // a server that hangs would block the tests
  waitpid(pid_, nullptr, 0);
}

Hand::Hand(const std::string& display) : display_(XOpenDisplay(display.c_str())) {
  int unused = 0;
  if (!display_ || XTestQueryExtension(Of(display_), &unused, &unused, &unused, &unused)) return;
  XCloseDisplay(Of(display_));
  display_ = nullptr;
}

Hand::~Hand() {
  if (display_) XCloseDisplay(Of(display_));
}

void Hand::MoveTo(int x, int y) {
  XTestFakeMotionEvent(Of(display_), -1, x, y, 0);
  XSync(Of(display_), False);
}

void Hand::Press(int button) {
  XTestFakeButtonEvent(Of(display_), static_cast<unsigned>(button), True, 0);
  XSync(Of(display_), False);
}

void Hand::Release(int button) {
  XTestFakeButtonEvent(Of(display_), static_cast<unsigned>(button), False, 0);
  XSync(Of(display_), False);
}

void Hand::HoldKey(const char* key) {
  XTestFakeKeyEvent(Of(display_), XKeysymToKeycode(Of(display_), XStringToKeysym(key)), True, 0);
  XSync(Of(display_), False);
}

void Hand::ReleaseKey(const char* key) {
  XTestFakeKeyEvent(Of(display_), XKeysymToKeycode(Of(display_), XStringToKeysym(key)), False, 0);
  XSync(Of(display_), False);
}

void Hand::Type(const std::string& key, const std::vector<std::string>& held) {
  std::vector<std::string> all = held;
  const KeySym symbol = XStringToKeysym(key.c_str());
  if (NeedsShift(Of(display_), symbol, XKeysymToKeycode(Of(display_), symbol)))
    all.push_back("Shift_L");
  for (const std::string& other : all) HoldKey(other.c_str());
  HoldKey(key.c_str());
  ReleaseKey(key.c_str());
  for (const std::string& other : all) ReleaseKey(other.c_str());
}

void Hand::Focus(unsigned long window) {
  XSetInputFocus(Of(display_), window, RevertToPointerRoot, CurrentTime);
  XSync(Of(display_), False);
}

void Hand::Close(unsigned long window) {
  Display* display = Of(display_);
  XEvent event = {};
  event.xclient.type = ClientMessage;
  event.xclient.window = window;
  event.xclient.message_type = XInternAtom(display, "WM_PROTOCOLS", False);
  event.xclient.format = 32;
  event.xclient.data.l[0] = static_cast<long>(XInternAtom(display, "WM_DELETE_WINDOW", False));
  XSendEvent(display, window, False, NoEventMask, &event);
  XSync(display, False);
}

void Hand::Resize(unsigned long window, unsigned width, unsigned height) {
  XResizeWindow(Of(display_), window, width, height);
  XSync(Of(display_), False);
}

namespace {

/// Calls f(window, title) for each visible top-level window.
template <typename Function>
void ForEachWindow(Display* display, Function f) {
  Window root, parent, *children = nullptr;
  unsigned count = 0;
  XQueryTree(display, DefaultRootWindow(display), &root, &parent, &children, &count);
  for (unsigned i = 0; i < count; i++) {
    XWindowAttributes attributes;
    if (!XGetWindowAttributes(display, children[i], &attributes)) continue;
    char* title = nullptr;
    if (attributes.map_state != IsViewable || !XFetchName(display, children[i], &title)) continue;
    f(children[i], std::string(title));
    XFree(title);
  }
  if (children) XFree(children);
}

}  // namespace

std::vector<std::string> Hand::Titles() {
  std::vector<std::string> titles;
  ForEachWindow(Of(display_), [&](Window, const std::string& title) { titles.push_back(title); });
  return titles;
}

unsigned long Hand::Find(const std::string& title) {
  unsigned long found = 0;
  ForEachWindow(Of(display_), [&](Window window, const std::string& name) {
    if (name == title) found = window;
  });
  return found;
}

}  // namespace gui_testing
